"""Parameters that several commands have, with what their help says of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

Flag = Annotated[bool, Parameter(negative="", show_default=False)]
Several = Annotated[tuple[str, ...], Parameter(negative="", show_default=False)]
Files = Annotated[tuple[Path, ...], Parameter(negative="", show_default=False)]

CampaignFile = Annotated[Path, Parameter(help="TOML file that names the measurements.")]
OutFolder = Annotated[Path | None, Parameter(help="Folder for result.json, arrays.nc and report.html.")]
OwnEffects = Annotated[Files, Parameter(help="A Python file with an effect of your own. Its code is run.")]
Candidates = Annotated[str | None, Parameter(help="Try these effects only: contact-ageing,drive-ripple.")]
MaxEffects = Annotated[int, Parameter(help="Add at most so many, one after the other.")]
Jobs = Annotated[int | None, Parameter(help="Parallel processes; default one a core.")]
Changes = Annotated[
    Several, Parameter(help="Change a key of the scenario: --set contact.H=0.5. May be given several times.")
]
MoreChanges = Annotated[str, Parameter(help="Further changes such as contact.H=0.5.")]
Json = Annotated[Flag, Parameter(help="Print the result as JSON.")]
Force = Annotated[Flag, Parameter(help="Replace an existing run folder.")]


def names(text: str | None) -> list[str] | None:
    """What is between the commas."""
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]
