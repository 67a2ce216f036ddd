"""``stickslip challenge``: make sealed campaigns with hidden effects, diagnose them, and score the answers."""

from __future__ import annotations

import shutil
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App

from ..system.progress import working
from .parameters import Candidates, Flag, Jobs, MaxEffects, names

if TYPE_CHECKING:
    from ..blind.run import Progress

UNRESOLVED = 3
SCORE = ("score.json", "score.txt", "confusion.png", "confusion-by-amplitude.png", "amplitude.png")
challenge = App(
    name="challenge",
    help="Test the diagnosis blindly on campaigns with a hidden effect: make, seal, run, score.",
    help_format="markdown",
)


@challenge.command(sort_key=0)
def make(folder: Path, *, cases: int = 100, seed: int = 0, grouped: Flag = False, jobs: Jobs = None) -> int:
    """Make campaigns with hidden effects; the truth is sealed in a file apart.

    Parameters
    ----------
    folder:
        Where to; must not exist yet. Interrupted, it resumes where it stopped.
    cases:
        How many: 30 % with nothing missing, 45 % with one effect, 15 % with two, 10 % outside the catalogue.
    seed:
        Fixes every file.
    grouped:
        Join springs of about the same threshold, instead of moving every one of them: ten times faster, not quite the
        same slips.
    """
    from ..blind.make import make_challenge

    with working("making campaigns") as tell:
        seal = make_challenge(folder, cases, seed, grouped=grouped, jobs=jobs, tell=tell)
    print(f"{cases} campaigns in {folder}\nseal {seal}")
    return 0


@challenge.command(sort_key=2)
def run(
    folder: Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    candidates: Candidates = None,
    max_effects: MaxEffects = 4,
    only: str | None = None,
    retry: Flag = False,
) -> int:
    """Diagnose every case; finished cases are not repeated, and an interrupted one resumes from its finished parts.

    Parameters
    ----------
    folder:
        Of the challenge. Workers on other machines must see it under the same path.
    scheduler:
        Address of a running dask.distributed scheduler: tcp://host:8786. Default: a cluster on this machine.
    workers:
        Processes of the cluster on this machine; default one a core.
    only:
        Diagnose these cases only, in this order, and leave the others open: case-003,case-001.
    retry:
        Try cases again that failed.
    """
    from ..blind.run import run_challenge

    some = names(only)
    try:
        found = run_challenge(
            folder,
            scheduler=scheduler,
            workers=workers,
            candidates=names(candidates),
            max_effects=max_effects,
            only=some,
            retry=retry,
            tell=_tell,
            note=partial(print, file=sys.stderr, flush=True),
        )
    except KeyboardInterrupt:
        raise KeyboardInterrupt("finished cases are kept; repeat the command to resume") from None
    print(f"{found['done']} diagnosed, {found['failed']} failed, {found['open']} open")
    if found["failed"]:
        print(f"failures are described in {folder / 'runs'}; try again with --retry")
    left_open = found["open"] and some is None
    return UNRESOLVED if left_open or found["failed"] else 0


def _tell(p: Progress) -> None:
    left = f", about {_time(p.left)} left" if p.done < p.total else ""
    message = p.message.splitlines()[0] if p.message else ""
    print(f"{p.done}/{p.total} {p.case} {p.state}: {message} ({p.seconds:.0f} s{left})", file=sys.stderr, flush=True)


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


@challenge.command(sort_key=1)
def seal(folder: Path) -> int:
    """Print the seal again: the digest that fixes cases and truth once it is published.

    Parameters
    ----------
    folder:
        Of the challenge. Its campaigns must be as sealed; the truth is not read.
    """
    from ..blind.seal import case_names, check_seal, digest

    number = len(case_names(check_seal(folder, truth=False)))
    print(f"{number} campaigns in {folder}\nseal {digest(folder)}")
    return 0


@challenge.command(sort_key=3)
def score(
    folder: Path, *, answers: Path | None = None, seal: str | None = None, json: Flag = False, force: Flag = False
) -> int:
    """Compare the answers with the truth; refuses a folder whose seal does not match.

    Writes score.json, score.txt, confusion.png, confusion-by-amplitude.png and amplitude.png into FOLDER/score.

    Parameters
    ----------
    folder:
        Of the challenge.
    answers:
        TOML or JSON file with the answers of another method, which are scored in place of the run's into
        FOLDER/score-NAME, NAME being that of the file.
    seal:
        The seal as it was published when the challenge was made; the score is refused for any other.
    json:
        Print the score as JSON.
    force:
        Replace a score that is there already.
    """
    from ..blind.score import score_challenge
    from ..errors import RunFolderError
    from ..system.runstore import json_text

    out = folder / ("score" if answers is None else f"score-{answers.stem}")
    there = {path.name for path in out.iterdir()} if out.is_dir() else {""} if out.exists() else set()
    if there - set(SCORE):
        raise RunFolderError("there is something else under the score's name", file=out, hint="move it away")
    if there and not force:
        raise RunFolderError("there is a score already", file=out, hint="move it away, or replace it with --force")
    found = score_challenge(folder, answers=answers, expected=seal)
    text = _write(out, found)
    print(json_text(found) if json else text, end="")
    return 0 if not found["not_run"] else UNRESOLVED


def _write(out: Path, found: dict[str, Any]) -> str:
    from ..blind.pictures import amplitude_figure, confusion_by_amplitude_figure, confusion_figure
    from ..blind.score_text import score_text
    from ..errors import RunFolderError
    from ..show.plots import save
    from ..system.runstore import json_text, write_aside

    text = score_text(found)
    aside = out.with_name(f".{out.name}.part")
    try:
        shutil.rmtree(aside, ignore_errors=True)
        aside.mkdir()
        write_aside(aside / "score.json", json_text(found) + "\n")
        write_aside(aside / "score.txt", text)
        save(confusion_figure(found), aside / "confusion.png")
        save(confusion_by_amplitude_figure(found), aside / "confusion-by-amplitude.png")
        save(amplitude_figure(found), aside / "amplitude.png")
        if out.exists():
            shutil.rmtree(out)
        aside.rename(out)
    except OSError as error:
        shutil.rmtree(aside, ignore_errors=True)
        raise RunFolderError(f"the score cannot be written ({error.strerror})", file=out) from error
    return text
