"""A series of runs: recurrence, slip and peak velocity against what was varied."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .style import DARK, LIGHT, figure, label, logarithmic, plain, remark, scaled, styled

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANELS = (
    ("recurrence", "s", "recurrence time"),
    ("slip", "m", "slip"),
    ("peak_velocity", "m/s", "peak velocity"),
    ("creep_before_slip", "m", "creep before a slip"),
)
_ABSENT = {"recurrence time": "fewer than two slips"}


@styled
def series_figure(table: xarray.Dataset) -> Figure:
    """Means over the events of every run with their spread, against the key that was varied.

    Args:
        table: on the dimension ``run``: value, events, and for each of recurrence, slip, peak_velocity and
            creep_before_slip the mean and, as ``..._std``, the spread; ``attrs["key"]`` and the unit of ``value``.
    """
    made, axes = figure(2, 2, width=9.5, height=7.0)
    value = table["value"].values
    unit = table["value"].attrs.get("units", "1")
    k, shown = scaled(value, unit)
    spread = bool(np.all(value > 0) and value.max() > 4 * value.min())
    for panel, (name, si, text) in zip(axes.flat, _PANELS, strict=True):
        _panel(panel, value * k, table[name].values, table[f"{name}_std"].values, si, text, spread)
        panel.set_xlabel(label(str(table.attrs["key"]), shown))
    slipping = int((table["events"].values > 0).sum())
    made.suptitle(plain(f"{table.attrs['title']}: {slipping} of {value.size} runs slip"))
    return made


def _panel(
    axes: Axes, value: np.ndarray, mean: np.ndarray, spread: np.ndarray, unit: str, text: str, wide: bool
) -> None:
    axes.set_title(text)
    good = np.isfinite(mean)
    if not good.any():
        remark(axes, _ABSENT.get(text, "no slip"))
        return
    k, shown = scaled(mean, unit)
    axes.errorbar(
        value[good], mean[good] * k, spread[good] * k, color=DARK, marker="o", ms=4.5, lw=1.2, ecolor=LIGHT, capsize=3
    )
    if wide:
        logarithmic(axes, "x")
    if np.all(mean[good] > 0) and mean[good].max() > 10 * mean[good].min():
        logarithmic(axes, "y")
    else:
        axes.set_ylim(0.0, 1.08 * float(np.max(mean[good] + spread[good])) * k)
    for at in value[~good]:
        axes.axvline(at, color=LIGHT, ls=":", lw=1.2)
    if (~good).any():
        axes.plot([], [], color=LIGHT, ls=":", label=_ABSENT.get(text, "no slip"))
        axes.legend()
    axes.set_ylabel(label(text, shown))
