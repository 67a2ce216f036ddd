"""One self-contained HTML file from a run folder, and from nothing else."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import RunFolderError
from ...system.runstore import RESULT, read_result, write_aside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REPORT = "report.html"


def write_report(folder: str | Path) -> Path:
    """Write ``report.html`` beside the ``result.json`` of a run folder.

    Everything is inside the file: no network, no scripts, figures as data. All text from files is escaped.

    Raises:
        RunFolderError: the folder holds no readable result or arrays, or cannot be written.
    """
    folder = Path(folder)
    result = read_result(folder)
    from jinja2 import UndefinedError

    from .sections import pictures

    try:
        text = render(result, pictures(result, _arrays(folder)))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, UndefinedError) as error:
        what = f"the result does not have the form of a stickslip result ({type(error).__name__}: {error})"
        raise RunFolderError(what, file=folder / RESULT) from error
    path = folder / REPORT
    try:
        return write_aside(path, text)
    except OSError as error:
        raise RunFolderError(f"the report cannot be written ({error.strerror})", file=path) from error


def render(result: dict[str, Any], images: Iterable[tuple[str, str, Figure]]) -> str:
    """HTML of a result and its pictures (section, caption, figure)."""
    import jinja2

    from .tables import deviation, lasting, percent, show, tables

    # results of all commands share the template, so what a result does not have is left blank
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.ChainableUndefined
    )
    environment.filters |= {"quantity": show, "percent": percent, "lasting": lasting, "deviation": deviation}
    template = environment.from_string(files(__package__).joinpath("report.html.j2").read_text(encoding="utf-8"))
    shown: dict[str, list[dict[str, str]]] = {}
    for section, caption, drawn in images:
        shown.setdefault(section, []).append({"caption": caption, "data": _png(drawn)})
    return template.render({**tables(result), "images": shown})


def _png(drawn: Figure) -> str:
    buffer = io.BytesIO()
    drawn.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def _arrays(folder: Path) -> Any:
    import xarray

    path = folder / "arrays.nc"
    if not path.is_file():
        return xarray.Dataset()
    try:
        return xarray.load_dataset(path, engine="h5netcdf")
    except (OSError, ValueError, KeyError) as error:
        raise RunFolderError(f"the arrays cannot be read ({error})", file=path) from None
