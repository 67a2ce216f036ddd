"""A copy of the shipped campaign to work in."""

from __future__ import annotations

import shutil
from pathlib import Path

from ..objects.example import EXAMPLE, example


def copied(path: Path, home: Path | None) -> bool:
    """Whether a campaign is the shipped one and does not lie below ``home``."""
    shipped = example()
    own = shipped is not None and path.resolve() == shipped.resolve()
    return own and home is not None and not path.resolve().is_relative_to(home)


def to_work_in(path: Path, home: Path | None) -> Path:
    """A campaign as it is; of the shipped one a copy below ``home``, for its own folder may go with an upgrade.

    Raises:
        OSError: the copy cannot be written.
    """
    if home is None or not copied(path, home):
        return path
    copy = home / EXAMPLE
    if not copy.is_file():
        shutil.copytree(path.parent, copy.parent, ignore=shutil.ignore_patterns(".*"), dirs_exist_ok=True)
    return copy
