"""Make the cases of a challenge and seal them."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import ArgumentError, RunFolderError, StickslipError
from ..system.extras import need
from ..system.parent_watch import end_with
from ..system.progress import Tell
from ..system.runstore import Run, json_text, open_run, versions
from ..system.threads import processors
from .case_plan import MIX, Case, case_seed, plan
from .seal import CASES, TRUTH, make_seal

ATTEMPTS = 8
SAME = 3  # attempts before the effects are made weaker
MADE = "made"


def make_challenge(
    folder: str | Path,
    cases: int = 100,
    seed: int = 0,
    *,
    own: Sequence[Case] | None = None,
    grouped: bool = False,
    jobs: int | None = None,
    tell: Tell | None = None,
) -> str:
    """Write the campaigns, the truth apart from them, and the seal of both.

    An interrupted making goes on where it was; the folder appears under its name when all is there.

    Args:
        folder: must not exist, or be empty.
        cases, seed: see :func:`stickslip.blind.case_plan.plan`.
        own: cases of one's own in place of the mix.
        grouped: join springs of about the same threshold: ten times faster, slips a little beside (docs/challenge).
        jobs: parallel processes; default the number of processors that this process may use.
        tell: told the case that was finished and the share done.

    Returns:
        The digest of the seal.

    Raises:
        RunFolderError: the folder exists.
        InputError: a number or the seed makes no sense, or numba is missing.
    """
    if jobs is not None and jobs < 1:
        raise ArgumentError("out of range", key="jobs", value=jobs, allowed="1 or more")
    folder = Path(folder)
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise RunFolderError(
            "something is there already, and a challenge is never replaced", file=folder, hint="choose another folder"
        )
    need("the generator of the challenge", "challenge", "numba")
    planned = plan(cases, seed) if own is None else list(own)
    with open_run(folder, resume=True) as run:
        made = _make_all(run, planned, seed, grouped, processors() if jobs is None else jobs, tell)
        truth = {
            "schema": 1,
            "seed": seed,
            "mix": MIX if own is None else "cases of one's own",
            "versions": versions(),
            "cases": [made[case.name] for case in planned],
        }
        path = run.json(truth, TRUTH)
        for left in set((run.folder / CASES).iterdir()) - {run.folder / CASES / case.name for case in planned}:
            shutil.rmtree(left)  # of a making with another plan that was interrupted
        files = [path, *(p for p in (run.folder / CASES).rglob("*") if p.is_file())]
        seal = make_seal(run.folder, files, cases=len(planned), versions=versions())
        shutil.rmtree(run.folder / MADE)
    return seal


def _make_all(
    run: Run, planned: list[Case], seed: int, grouped: bool, jobs: int, tell: Tell | None
) -> dict[str, dict[str, Any]]:
    from joblib import Parallel, delayed

    made = {case.name: kept for case in planned if (kept := _kept(run, case, grouped)) is not None}
    work = [(number, case) for number, case in enumerate(planned, start=1) if case.name not in made]
    root = str(run.folder)
    results = Parallel(n_jobs=max(1, min(jobs, len(work) or 1)), return_as="generator_unordered")(
        delayed(_made)(os.getpid(), root, case, seed, number, grouped) for number, case in work
    )
    for truth in results:
        made[truth["name"]] = truth
        run.json(truth, f"{MADE}/{truth['name']}.json")
        if tell is not None:
            tell(truth["name"], len(made) / len(planned))
    return made


def _made(parent: int, *case: Any) -> dict[str, Any]:
    """A case made in a worker."""
    end_with(parent)
    return make_case(*case)


def _fingerprint(case: Case, grouped: bool) -> str:
    return hashlib.sha256(json_text({**case.plain(), "grouped": grouped}).encode()).hexdigest()


def _kept(run: Run, case: Case, grouped: bool) -> dict[str, Any] | None:
    path = run.path(f"{MADE}/{case.name}.json")
    try:
        truth: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return truth if truth.get("plan") == _fingerprint(case, grouped) else None


def make_case(root: str, case: Case, seed: int, number: int, grouped: bool = False) -> dict[str, Any]:
    """Simulate one case into ``root/cases/NAME``; returns its truth.

    A rig that does not stick and slip is drawn again, from the fourth attempt on with effects half as large; how often
    is in the truth.

    Raises:
        StickslipError: no attempt stuck and slipped.
    """
    from .generator import make_campaign

    folder = Path(root) / CASES / case.name
    shutil.rmtree(folder, ignore_errors=True)
    tried, reason = case, ""
    for attempt in range(ATTEMPTS):
        if attempt >= SAME:
            tried = tried.weaker()
        tried = replace(tried, seed=case_seed(seed, number, attempt))
        try:
            truth = make_campaign(
                folder,
                tried.seed,
                [(h.tag, h.amplitude, h.form) for h in tried.hidden],
                new_lines=tried.new_lines,
                runs=tried.runs(),
                virgin=tried.virgin,
                spring_known=tried.spring_known,
                recorder=tried.recorder,
                grouped=grouped,
            )
        except StickslipError as error:
            reason = str(error)
            continue
        for effect, hidden in zip(truth["effects"], tried.hidden, strict=True):
            effect["multiple"] = hidden.multiple
        circumstances = {"velocities": list(tried.velocities), "holds": list(tried.holds)}
        head = {"name": case.name, "kind": case.kind, "plan": _fingerprint(case, grouped), "attempts": attempt + 1}
        return {**head, **circumstances, **truth}
    raise StickslipError(f"{case.name} could not be made in {ATTEMPTS} attempts: {reason}")
