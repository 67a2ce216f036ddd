"""Diagnose every case of a challenge, in parallel; what is finished is never done again, nothing is lost."""

from __future__ import annotations

import json
import time
import uuid
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import InputError, RunFolderError, StickslipError
from ..objects.checkpoints import code_digest
from ..objects.diagnosis import check_counts, diagnose_campaign
from ..system.cluster import Workers, cluster
from ..system.runstore import alone, json_text, versions, write_aside
from .one_case import REFUSED, Diagnosis, do_case, failures, is_done
from .seal import CASES, RUNS, case_names, check_seal, digest

PROTOCOL = "protocol.json"
POLL = 0.2  # s after which tasks are asked again
ANSWER = 10.0  # s for the answer of a finished case to arrive
RESUBMITTED = 20  # times a case may be handed out before the cluster is given up
UNRECORDED = "not recorded"  # code of a run that did not write down its own


@dataclass(frozen=True)
class Progress:
    """A finished case and how far the run is; ``left`` is the time left in seconds."""

    case: str
    state: str
    message: str
    seconds: float
    done: int
    total: int
    left: float


def run_challenge(
    folder: str | Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    candidates: Sequence[str] | None = None,
    max_effects: int = 4,
    only: Sequence[str] | None = None,
    retry: bool = False,
    diagnosis: Diagnosis | None = None,
    tell: Callable[[Progress], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> dict[str, int]:
    """Diagnose every case that has neither a result nor a recorded failure.

    Each case is diagnosed as ``stickslip diagnose`` does it. A case whose process dies is started again from its
    finished pieces. The truth is not read.

    Args:
        folder: of the challenge. Workers on other machines must see it under the same path.
        scheduler, workers: see :func:`stickslip.system.cluster.cluster`.
        candidates, max_effects: of the diagnosis; fixed by the first run of this challenge.
        only: names of cases, done in this order, the others left open; default all.
        retry: try cases again that failed before.
        diagnosis: called with the campaign file and the run folder to write; default the package's own.
        tell: told of every finished case.
        note: told how much is to be done as it begins, and where no worker comes.

    Returns:
        How many cases are ``done``, ``failed`` and ``open``.

    Raises:
        SealError: a campaign is not as sealed.
        InputError: other settings than before; a case that there is not; no scheduler answers.
        RunFolderError: another run is at this challenge, or the disk is full or read-only.
        StickslipError: the cluster was lost.
    """
    check_counts(max_effects)
    folder = Path(folder).resolve()
    seal = check_seal(folder, truth=False)
    cases = case_names(seal)
    wanted = cases if only is None else _known(only, cases, folder)
    runs = folder / RUNS
    tags = None if candidates is None else list(candidates)
    if diagnosis is None:
        diagnosis = partial(diagnose_campaign, jobs=1, candidates=tags, max_effects=max_effects)
    with alone(runs):
        runs.mkdir(exist_ok=True)
        _protocol(runs, digest(folder), {"candidates": tags, "max_effects": max_effects})
        waiting = [c for c in wanted if not is_done(runs, c) and (retry or not failures(runs, c))]
        if waiting:
            _go_on(runs, cases, waiting)
            with cluster(scheduler, workers) as client:
                there = Workers(client, note)
                if note is not None:
                    workers_there = f"{there.number} worker{'' if there.number == 1 else 's'}"
                    note(f"{len(waiting)} of {len(wanted)} cases to do, {workers_there}")
                _work(client, there, folder, waiting, len(wanted), diagnosis, tell)
            with suppress(OSError):  # who reads the protocol finds it out as well
                _keep(runs, codes_of(runs, read_protocol(runs), cases))
    done = sum(is_done(runs, c) for c in cases)
    failed = sum(not is_done(runs, c) and bool(failures(runs, c)) for c in cases)
    return {"done": done, "failed": failed, "open": len(cases) - done - failed}


def _known(only: Sequence[str], cases: Sequence[str], folder: Path) -> list[str]:
    for name in only:
        if name not in cases:
            hint = "name the cases as the folder 'cases' does, with commas between them"
            raise InputError("no such case", file=folder, value=name, allowed=f"{cases[0]} to {cases[-1]}", hint=hint)
    return list(dict.fromkeys(only))


def _protocol(runs: Path, seal: str, options: dict[str, Any]) -> None:
    """Write down under what settings this challenge is run, and refuse others later."""
    from ..inference.diagnose import decide

    now = {
        "seal": seal,
        **options,
        "thresholds": {"chance": decide.CHANCE, "errors": decide.ERRORS, "dispersion": decide.DISPERSION},
        "versions": versions(),
    }
    now |= {"code": code_digest(), "codes": {}}
    path = runs / PROTOCOL
    if not path.is_file():
        write_aside(path, json_text(now) + "\n")
        return
    before = read_protocol(runs)
    for key in ("seal", "candidates", "max_effects", "thresholds"):
        if before.get(key) != now[key]:
            raise InputError(
                f"this challenge was begun with other {key}", file=path, value=now[key], allowed=json_text(before[key]),
                hint="one score needs one protocol: continue with the same settings, or remove the folder 'runs'",
            )  # fmt: skip


def _go_on(runs: Path, cases: Sequence[str], waiting: Sequence[str]) -> None:
    """Write down what is done before this code, and that it goes on with the rest."""
    before = codes_of(runs, read_protocol(runs), cases)
    left = {code: [case for case in done if case not in waiting] for code, done in before.items()}
    _keep(runs, {code: done for code, done in left.items() if done}, code_digest())


def _keep(runs: Path, codes: dict[str, list[str]], code: str | None = None) -> None:
    before = read_protocol(runs)
    now = {**before, "code": code or before["code"], "codes": codes}
    if now != before:
        write_aside(runs / PROTOCOL, json_text(now) + "\n")


def codes_of(runs: Path, protocol: dict[str, Any], cases: Sequence[str]) -> dict[str, list[str]]:
    """Which cases were answered by which code: digest of the package -> cases.

    A case that no entry of the protocol lists was answered in the last run, which ended without writing it down.
    """
    codes = {code: list(done) for code, done in protocol.get("codes", {}).items()}
    listed = {case for done in codes.values() for case in done}
    new = [c for c in cases if c not in listed and (is_done(runs, c) or failures(runs, c))]
    if new:
        last = protocol.get("code", UNRECORDED)
        codes[last] = sorted([*codes.get(last, []), *new])
    return codes


def read_protocol(runs: Path) -> dict[str, Any]:
    """The settings of the run.

    Raises:
        InputError: nothing was run yet, or the file is damaged.
    """
    path = runs / PROTOCOL
    if not path.is_file():
        raise InputError("nothing was run yet", file=runs.parent, hint="stickslip challenge run FOLDER")
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        found["seal"], found["thresholds"], found["candidates"], found["max_effects"]
    except (ValueError, KeyError, TypeError):
        raise InputError("the protocol of the run is damaged", file=path) from None
    return found


def _work(
    client: Any,
    there: Workers,
    folder: Path,
    waiting: list[str],
    total: int,
    diagnosis: Diagnosis,
    tell: Callable[[Progress], None] | None,
) -> None:
    """Have the cases done. What the files say counts: a result on a worker that dies is lost, and dask blames a death
    also on the cases that were only queued there.
    """
    runs, session = folder / RUNS, uuid.uuid4().hex
    before = {case: len(failures(runs, case)) for case in waiting}
    given = Counter(waiting)

    def submit(case: str) -> Any:
        campaign = str(folder / CASES / case / "campaign.toml")
        return client.submit(do_case, campaign, str(runs), case, diagnosis, session, pure=False)

    began = time.monotonic()
    at_work = {case: submit(case) for case in waiting}
    unanswered: dict[str, float] = {}  # since when a case is finished whose answer has not come
    count, first = 0, total - len(waiting)
    try:
        while at_work:
            # dask may forget to tell of a task whose answer was lost with its worker, so each is asked again and again
            time.sleep(POLL)
            there.look()
            for case, future in list(at_work.items()):
                if future.status == "pending":
                    if not is_done(runs, case) and len(failures(runs, case)) <= before[case]:
                        continue
                    if time.monotonic() - unanswered.setdefault(case, time.monotonic()) < ANSWER:
                        continue
                told = _outcome(future, runs, case, before[case])
                if told is None and given[case] <= RESUBMITTED and client.status == "running":
                    given[case] += 1
                    at_work[case] = submit(case)
                    continue
                if told is None:
                    raise StickslipError(
                        f"the cluster was lost while {case} was running; finished cases are kept"
                        "\n  to fix: run the same command again"
                    )
                if told["state"] == REFUSED:
                    raise RunFolderError(
                        f"{case} cannot be written: {told['message'].splitlines()[0]}", file=runs,
                        hint="make room, or make the folder writable, and run the same command again;"
                        " finished cases are kept, and this one resumes from its finished parts",
                    )  # fmt: skip
                del at_work[case]
                count += 1
                if tell is not None:
                    left = time_left(time.monotonic() - began, count, len(waiting) - count, there.at_once)
                    tell(Progress(**told, done=first + count, total=total, left=left))
    except BaseException:
        client.cancel(list(at_work.values()))
        raise


def time_left(elapsed: float, finished: int, remaining: int, at_once: int) -> float:
    """Seconds until the remaining cases are done, at the pace so far.

    Of the cases under way the one just begun is at its beginning; the others count as half done.
    """
    half = 0.5 * min(max(at_once, 1) - 1, remaining)
    return elapsed * (remaining - half) / (finished + half)


def _outcome(future: Any, runs: Path, case: str, failed_before: int) -> dict[str, Any] | None:
    """What became of a case whose task has ended; None where it has neither a result nor a new failure."""
    if future.status == "finished":
        with suppress(Exception):  # the worker that held the answer may be gone by now
            told: dict[str, Any] = future.result(timeout=ANSWER)
            return told
    if is_done(runs, case):
        return {"case": case, "state": "done", "message": "", "seconds": 0.0}
    found = failures(runs, case)
    if len(found) > failed_before:
        return {"case": case, "state": "failed", "message": found[-1]["message"], "seconds": found[-1]["seconds"]}
    return None
