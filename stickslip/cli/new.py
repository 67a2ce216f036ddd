"""``stickslip new``: a commented file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from ..errors import RunFolderError
from .parameters import Flag


def new(
    what: Literal["scenario", "campaign"],
    file: Annotated[Path | None, Parameter(allow_leading_hyphen=True)] = None,
    *,
    force: Flag = False,
) -> int:
    """Write a commented scenario or campaign file to start from.

    Parameters
    ----------
    what:
        scenario (a rig to simulate) or campaign (measurements of a rig).
    file:
        Where to write it; default scenario.toml or campaign.toml. A dash prints it.
    force:
        Replace an existing file.
    """
    if what == "scenario":
        from ..simulation.scenario.template import scenario_template

        text = scenario_template()
    else:
        from ..data.campaign import campaign_template

        text = campaign_template()
    path = file or Path(f"{what}.toml")
    if str(path) == "-":
        print(text, end="")
        return 0
    _write(path, text, force)
    if what == "scenario":
        print(f"written to {path}; next: stickslip simulate {path}")
    else:
        print(f"written to {path}; next: name your records in it, then: stickslip inspect {path}")
    return 0


def _write(path: Path, text: str, force: bool) -> None:
    if path.exists() and (not force or not path.is_file()):
        hint = "choose another name, or replace it with --force" if path.is_file() else "choose another name"
        raise RunFolderError("the file exists already", file=path, hint=hint)
    from ..system.runstore import write_aside

    try:
        write_aside(path, text)
    except OSError as error:
        raise RunFolderError(f"the file cannot be written ({error.strerror})", file=path) from None
