"""The campaign that is shipped: of a clone, or of an installed package, and a copy of it to work in."""

from __future__ import annotations

import shutil
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

from ..errors import InputError
from .campaign import Campaign, load_campaign

EXAMPLE = Path("hidden-effect") / "campaign.toml"


def example() -> Path | None:
    """Its file; None where it was left out."""
    of_clone = Path(__file__).parents[2] / "scenarios" / EXAMPLE
    if of_clone.is_file():
        return of_clone
    with suppress(PackageNotFoundError):
        for file in files("stickslip") or ():
            if file.match(f"stickslip/{EXAMPLE.as_posix()}"):
                return Path(str(file.locate())).resolve()
    return None


def load_example() -> Campaign:
    """A campaign to try things on: five runs of a steel block, with an effect hidden in its friction.

    Its file and records, ``scenarios/hidden-effect``, are shipped with the package.

    Raises:
        InputError: whoever packed this installation left them out.
    """
    found = example()
    if found is None:
        raise InputError("the example is not installed", hint="take scenarios/hidden-effect from the repository")
    return load_campaign(found)


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
