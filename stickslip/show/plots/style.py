"""The look all pictures share."""

from __future__ import annotations

import functools
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, ParamSpec

import numpy as np

from ...errors import InputError
from ...system.runstore import write_aside
from ...system.units import PREFIXES, power_for, takes_prefix

if TYPE_CHECKING:  # what only takes colours from here need not wait for matplotlib
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...simulation.scenario.recording import Recording

    Run = xarray.Dataset | Recording

P = ParamSpec("P")
# dark, middle and light, so that a grey print keeps them apart; the line styles differ as well
DARK, MIDDLE, LIGHT = "#14213d", "#c8553d", "#8d99ae"
# of runs, in reports and in the workbench: the first three of Okabe and Ito, the others as far from all as may be
# for those who see red or green otherwise, which a test computes
RUNS = ("#0072b2", "#d55e00", "#009e73", "#7e5de8", "#949db1", "#fd0e60", "#792419")
PARTS = 15  # of a variable's range, each with as many points, whose medians are drawn
_DASHES = ("-", "--", "-.", ":")
_LOOK: Any = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e6ea",
    "grid.linewidth": 0.6,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.3,
    "axes.formatter.useoffset": False,
}


def of_run(number: int) -> dict[str, str]:
    """Colour and dash of a run's curve, by the run's number; a grey print tells runs apart by the dash."""
    return {"color": RUNS[number % len(RUNS)], "ls": _DASHES[number % len(_DASHES)]}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Decorator of a function that makes a figure: it is drawn in this look, and nobody else's settings change.

    Axes of one's own (``ax``) keep the settings of their owner.
    """

    @functools.wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Figure:
        from matplotlib import rc_context

        if kwargs.get("ax") is not None:
            return draw(*args, **kwargs)
        with rc_context(_LOOK):
            return draw(*args, **kwargs)

    return wrapper


def figure(rows: int = 1, columns: int = 1, *, width: float = 7.0, height: float = 4.2) -> tuple[Figure, np.ndarray]:
    """A figure and its axes, shape (rows, columns); sizes in inches of the whole. A notebook shows it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    made: Any = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    made._repr_png_ = functools.partial(_png, made)  # also where pyplot was not set up for it
    return made, np.asarray(made.subplots(rows, columns, squeeze=False))


def _png(figure: Figure, dpi: float | Literal["figure"] = "figure") -> bytes:
    """A picture as PNG, without time stamp or version, so that equal results are equal files."""
    from matplotlib import rc_context

    buffer = io.BytesIO()
    metadata: dict[str, Any] = {"Software": None}
    with rc_context(_LOOK):
        figure.savefig(buffer, format="png", dpi=dpi, metadata=metadata)
    return buffer.getvalue()


def panels(
    given: Axes | Sequence[Axes] | None, rows: int = 1, columns: int = 1, *, width: float = 7.0, height: float = 4.2
) -> tuple[Figure, list[Axes]]:
    """The axes to draw in, row by row, and their figure: those given, else a :func:`figure` of that size.

    Raises:
        InputError: what is given are no axes, or another number of them is needed.
    """
    if given is None:
        made, axes = figure(rows, columns, width=width, height=height)
        return made, list(axes.flat)
    from matplotlib.axes import Axes

    found = list(np.ravel(np.asarray(given, dtype=object)))
    for one in found:
        if not isinstance(one, Axes):
            raise InputError(f"a {type(one).__name__} is no axes", key="ax", hint="give those of figure.subplots()")
    if len(found) != rows * columns:
        raise InputError("another number of axes", key="ax", value=len(found), allowed=str(rows * columns))
    return found[0].figure, found


def plain(text: object, most: int = 120) -> str:
    """Text from a file as matplotlib shows it literally, without its formula signs."""
    shown = str(text).replace("\\", "/").replace("$", r"\$")
    return shown if len(shown) <= most else shown[:most] + "..."


def scaled(values: np.ndarray, unit: str) -> tuple[float, str]:
    """The factor and the unit text that show values (in the SI ``unit``) as numbers between 1 and 1000."""
    finite = np.abs(np.asarray(values, float))
    finite = finite[np.isfinite(finite)]
    top = float(finite.max()) if finite.size else 0.0
    if top == 0.0 or not takes_prefix(unit):
        return 1.0, unit
    power = power_for(top, 12, 0)
    return 10.0**-power, PREFIXES[power] + unit


def label(text: str, unit: str = "") -> str:
    """Text of an axis: quantity over unit."""
    if unit in ("", "1"):
        return text
    return f"{text} / ({unit})" if "/" in unit else f"{text} / {unit}"


def medians(axes: Axes, x: np.ndarray, z: np.ndarray, number: int, name: str, bold: bool = False) -> None:
    """Points of a run as faint dots, and the medians of :data:`PARTS` of them, each with as many points.

    Args:
        axes: drawn in.
        x, z: the points, shape (n,).
        number: of the run, by which it has its colour.
        name: of the run, for the legend.
        bold: for a picture that stands alone.
    """
    curve = of_run(number)
    axes.plot(x, np.clip(z, -6, 6), ".", ms=2.0 if bold else 1.5, color=curve["color"], alpha=0.3 if bold else 0.25)
    pieces = [p for p in np.array_split(np.argsort(x), PARTS) if p.size]
    middle = [[np.median(v[p]) for p in pieces] for v in (x, z)]
    axes.plot(*middle, color=curve["color"], ls=curve["ls"], lw=1.5 if bold else 1.4, label=name)


def logarithmic(axes: Axes, which: str) -> None:
    """A logarithmic axis ("x" or "y") with plain numbers at 1, 2 and 5 of every decade."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def signed_log(axes: Axes, values: np.ndarray) -> None:
    """A horizontal axis that is logarithmic to both sides of a linear piece, with numbers that do not touch.

    Args:
        axes: drawn in.
        values: that are drawn, in the axis' unit.
    """
    from matplotlib.ticker import FixedLocator

    low, high = float(np.min(values)), float(np.max(values))
    top = max(-low, high, 1e-300)
    linear = 0.002 * top
    axes.set_xscale("symlog", linthresh=linear)
    least = linear * (3.0 if low > -linear else 30.0)  # numbers of both sides meet at zero
    decades = 10.0 ** np.arange(np.ceil(np.log10(least)), np.floor(np.log10(top)) + 1.0)
    axes.xaxis.set_major_locator(FixedLocator([*-decades[decades <= -low], 0.0, *decades[decades <= high]]))


def remark(axes: Axes, text: str) -> None:
    """A sentence in an empty panel."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", wrap=True, color=DARK)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(False)


def save(figure: Figure, path: str | Path, dpi: int = 130) -> Path:
    """Write a PNG without time stamp or version, so that equal results are equal files."""
    return write_aside(Path(path), _png(figure, dpi))
