"""The campaign that is shipped: of a clone, or of an installed package."""

from __future__ import annotations

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
