"""One case on whatever process it lands: diagnosed to the end, or its failure written down."""

from __future__ import annotations

import json
import socket
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import RunFolderError, StickslipError
from ..system import process
from ..system.runstore import RESULT, is_of_the_disk, json_text, write_aside

Diagnosis = Callable[[Path, Path], Any]
WAIT = 60.0  # s for a process that was given up, but still holds the case, to finish or to end

REFUSED = "refused"  # state of a case that the disk stands in the way of: neither done nor failed
LIVES = 3  # processes that a case may take down with it in one run


class ProcessDiedError(StickslipError):
    """A case took its process down every time: out of memory, or a crash in compiled code."""


def is_done(runs: Path, case: str) -> bool:
    """Whether the case has a result."""
    return (runs / case / RESULT).is_file()


def failures_file(runs: Path, case: str) -> Path:
    """Where failures of a case are kept, one after the other."""
    return runs / f"{case}.failures.json"


def failures(runs: Path, case: str) -> list[dict[str, Any]]:
    """All failures of a case so far."""
    try:
        found = json.loads(failures_file(runs, case).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return []
    except (OSError, ValueError) as error:  # it is there, so it did fail
        return [{"error": "damaged record", "message": str(error)}]
    return list(found)


def record_failure(runs: Path, case: str, error: BaseException, seconds: float) -> dict[str, Any]:
    """Add a failure to the case's record; returns it."""
    entry = {
        "error": type(error).__name__,
        "message": str(error),
        "traceback": "".join(traceback.format_exception(error)),
        "seconds": round(seconds, 1),
        "host": socket.gethostname(),
    }
    write_aside(failures_file(runs, case), json_text([*failures(runs, case), entry]) + "\n")
    return entry


def do_case(campaign: str, runs: str, case: str, diagnosis: Diagnosis, session: str) -> dict[str, Any]:
    """Diagnose one case, unless it is done; an error of whatever kind is written down, not raised.

    A process that dies writes nothing, so every start is: a case started three times in one ``session`` without coming
    to an end has failed. A full or read-only disk is no failure of the case, and could not be written down.

    Returns:
        ``case``, ``state`` ("done", "failed" or "refused", by the disk), ``message`` and ``seconds``.
    """
    process.begin()
    began = time.monotonic()
    try:
        return _attempt(campaign, Path(runs), case, diagnosis, session, began)
    except Exception as error:
        if not is_of_the_disk(error):
            raise
        return _told(case, REFUSED, str(error), began)
    finally:
        process.forget_programs()


def _attempt(
    campaign: str, folder: Path, case: str, diagnosis: Diagnosis, session: str, began: float
) -> dict[str, Any]:
    if not is_done(folder, case):
        if _starts(folder, case, session) >= LIVES:
            error: BaseException = ProcessDiedError(f"the process died {LIVES} times during this case")
            record_failure(folder, case, error, 0.0)
            return _told(case, "failed", str(error), began)
        with _starts_file(folder, case).open("a", encoding="utf-8") as stream:
            stream.write(session + "\n")
    while True:
        try:
            if not is_done(folder, case):
                diagnosis(Path(campaign), folder / case)
            if not is_done(folder, case):
                raise RunFolderError("the diagnosis wrote no result.json", file=folder / case)
        except RunFolderError as fault:
            if is_done(folder, case):
                continue
            # a worker that the scheduler gave up may live on and hold the case
            if time.monotonic() - began < WAIT and _held(folder, case):
                time.sleep(1.0)
                continue
            error = fault
        except Exception as fault:
            error = fault
        else:
            return _told(case, "done", _verdict(folder / case), began)
        if is_of_the_disk(error):
            raise error
        record_failure(folder, case, error, time.monotonic() - began)
        return _told(case, "failed", f"{type(error).__name__}: {error}", began)


def _starts_file(runs: Path, case: str) -> Path:
    return runs / f".{case}.starts"


def _starts(runs: Path, case: str, session: str) -> int:
    path = _starts_file(runs, case)
    return path.read_text(encoding="utf-8").split().count(session) if path.is_file() else 0


def _held(runs: Path, case: str) -> bool:
    return (runs / f".{case}.lock").exists()


def _verdict(folder: Path) -> str:
    try:
        verdict = json.loads((folder / RESULT).read_text(encoding="utf-8"))["verdict"]
        return " ".join([verdict["kind"], *verdict["set"]])
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def _told(case: str, state: str, message: str, began: float) -> dict[str, Any]:
    return {"case": case, "state": state, "message": message, "seconds": time.monotonic() - began}
