"""The picture of a free simulation, drawn from a run folder alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..plots.style import DARK, LIGHT, MIDDLE, logarithmic, panels, plain, scaled, styled
from .figures import series

if TYPE_CHECKING:
    import xarray

_LINES = {
    "measured": ("measured", DARK, "-", 2.2),
    "base": ("base model", LIGHT, "-.", 1.2),
    "last": ("last model", MIDDLE, "--", 1.2),
}
_MARKS = {"base": ("o", LIGHT), "last": ("x", MIDDLE)}


@styled
def free_picture(data: xarray.Dataset, *, ax: Sequence[Axes] | None = None) -> Figure:
    """One run measured and predicted, one of its onsets, and the error of every recurrence against the recurrence."""
    made, (pull, onset, late) = panels(ax, columns=3, width=13.0, height=3.8)
    run = plain(data["free_run_measured_time"].attrs.get("run", ""), 28)
    event = int(data["free_onset_measured_time"].attrs.get("event", 0))
    _lines(pull, data, "run", "gap", "s", "load point less displacement")
    pull.set_title(f"{run}: pull of the spring")
    _lines(onset, data, "onset", "position", "ms", "displacement since the arrest")
    onset.set_title(f"slip {event + 1} of {run}")
    _recurrences(late, data)
    if ax is None:
        made.legend(*pull.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
    else:
        pull.legend()
    return made


def _lines(ax: Axes, data: xarray.Dataset, key: str, name: str, clock: str, text: str) -> None:
    measured = series(data, f"free_{key}_measured", name)
    assert measured is not None
    k, unit = scaled(measured, "m")
    factor = 1e3 if clock == "ms" else 1.0
    for kind, (label, colour, style, width) in _LINES.items():
        t, y = series(data, f"free_{key}_{kind}", "time"), series(data, f"free_{key}_{kind}", name)
        if t is not None and y is not None:
            ax.plot(t * factor, y * k, color=colour, ls=style, lw=width, label=label)
    at = "time from the measured onset" if clock == "ms" else "time"
    ax.set(xlabel=f"{at} / {clock}", ylabel=f"{text} / {unit}")


def _recurrences(ax: Axes, data: xarray.Dataset) -> None:
    """Per cent by which every slip comes late, and the scatter that events have by themselves."""
    measured = series(data, "free_recurrence", "measured")
    assert measured is not None
    scatter = series(data, "free_recurrence", "scatter")
    if scatter is not None:
        share = 200.0 * scatter / measured
        ax.vlines(measured, -share, share, color=LIGHT, alpha=0.35, lw=5, label="two standard deviations")
    for kind, (mark, colour) in _MARKS.items():
        found = series(data, "free_recurrence", kind)
        if found is not None:
            late = 100.0 * (found / measured - 1.0)
            ax.plot(measured, late, mark, color=colour, ms=4.5, label=_LINES[kind][0], mew=1.4)
    ax.axhline(0.0, color=DARK, lw=0.8)
    logarithmic(ax, "x")
    ax.set(xlabel="measured recurrence (arrest to onset) / s", ylabel="predicted less measured / %")
    ax.set_title("recurrence of every slip")
    ax.legend()
