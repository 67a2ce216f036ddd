"""The seal of a challenge: SHA-256 of the truth and of every campaign file, taken when they were made."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..system.runstore import file_record, json_text, write_aside

SEAL = "seal.json"
TRUTH = "sealed/truth.json"
CASES = "cases"
RUNS = "runs"


class SealError(InputError):
    """A challenge is not what was sealed."""


def make_seal(folder: Path, files: Iterable[Path], **more: Any) -> str:
    """Write ``seal.json`` for ``files`` below ``folder``; returns its own digest, by which it can be published."""
    found = {path.relative_to(folder).as_posix(): file_record(path)["sha256"] for path in sorted(files)}
    text = json_text({"schema": 1, **more, "files": found}) + "\n"
    write_aside(folder / SEAL, text)
    return digest(folder)


def digest(folder: Path) -> str:
    """SHA-256 of the seal itself.

    Raises:
        InputError: the folder holds no challenge.
    """
    if not (folder / SEAL).is_file():
        raise InputError("there is no challenge here", file=folder, hint="stickslip challenge make FOLDER")
    return hashlib.sha256((folder / SEAL).read_bytes()).hexdigest()


def read_seal(folder: Path) -> dict[str, Any]:
    """The seal as written; :class:`SealError` if it is damaged."""
    digest(folder)
    try:
        seal = json.loads((folder / SEAL).read_text(encoding="utf-8"))
        ok = isinstance(seal["files"], dict) and TRUTH in seal["files"]
    except (OSError, ValueError, KeyError, TypeError):
        ok = False
    if not ok:
        raise SealError("the seal is damaged", file=folder / SEAL, hint="make the challenge again from its seed")
    return dict(seal)


def check_seal(folder: Path, *, truth: bool = True, expected: str | None = None) -> dict[str, Any]:
    """Compare every sealed file with its hash.

    Args:
        folder: of the challenge.
        truth: whether to look at the truth as well; a run does not touch it.
        expected: the digest of the seal as it was published.

    Raises:
        SealError: a file was changed or is gone, or this is another seal than the one expected.
    """
    seal = read_seal(folder)
    if expected is not None and digest(folder) != expected.strip().lower():
        raise SealError("this is not the seal that was published", file=folder / SEAL, value=digest(folder))
    broken = []
    for name, sha256 in seal["files"].items():
        if name == TRUTH and not truth:
            continue
        path = folder / name
        if not path.is_file():
            broken.append(f"{name} is gone")
        elif file_record(path)["sha256"] != sha256:
            broken.append(f"{name} was changed")
    if broken:
        more = f" and {len(broken) - 3} more" if len(broken) > 3 else ""
        hint = "a score of altered cases means nothing; make the challenge again from its seed"
        raise SealError(f"the seal is broken: {', '.join(broken[:3])}{more}", file=folder, hint=hint)
    return seal


def case_names(seal: dict[str, Any]) -> list[str]:
    """Names of all cases, from the files that were sealed."""
    return sorted({name.split("/")[1] for name in seal["files"] if name.startswith(f"{CASES}/")})


def case_hashes(seal: dict[str, Any], case: str) -> set[str]:
    """Hashes of one case's files."""
    return {sha for name, sha in seal["files"].items() if name.startswith(f"{CASES}/{case}/")}


def read_truth(folder: Path) -> dict[str, Any]:
    """The truth; check the seal first."""
    truth: dict[str, Any] = json.loads((folder / TRUTH).read_text(encoding="utf-8"))
    return truth
