"""Pictures of a forecast, drawn from a run folder alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from ..plots.style import DARK, LIGHT, MIDDLE, panels, plain, scaled, styled

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes


@styled
def levels_picture(data: xarray.Dataset, *, ax: Sequence[Axes] | None = None) -> Figure:
    """Levels at onset and arrest against time, and the level at onset against that of the slip before."""
    made, (first, beside) = panels(ax, columns=2, width=11.0, height=3.6)
    k, unit = scaled(data.onset.values, data.onset.attrs["units"])
    t = data.time_onset.values
    first.plot(t, data.onset.values * k, ".-", color=DARK, lw=0.8, ms=4, label="at onset")
    first.plot(data.time_arrest.values, data.arrest.values * k, ".-", color=MIDDLE, lw=0.8, ms=4, label="at arrest")
    first.axvline(data.attrs["split"], color=LIGHT, ls="--", lw=1.2, label="end of training")
    name = {"N": "force of the spring", "m": "elongation of the spring"}.get(data.onset.attrs["units"], "level")
    first.set(xlabel="time / s", ylabel=f"{name} / {unit}", title=plain(data.attrs["title"]))
    first.legend(loc="best", ncols=3)
    on, before = data.onset.values[1:] * k, data.arrest.values[:-1] * k
    beside.plot(before, on, ".", color=DARK, ms=4)
    beside.set(xlabel=f"at the arrest before / {unit}", ylabel=f"at onset / {unit}")
    return made


@styled
def calibration_picture(data: xarray.Dataset, *, ax: Sequence[Axes] | None = None) -> Figure:
    """Forecast intervals against measured times, and the distribution of their forecast probabilities."""
    made, (first, beside) = panels(ax, columns=2, width=11.0, height=3.8)
    order = np.argsort(data.truth.values, kind="stable")
    truth, q = data.truth.values[order], data.quantile_times.values[order]
    every = np.unique(np.linspace(0, truth.size - 1, min(truth.size, 150)).astype(int))
    low, high = q[every, 0], q[every, -1]
    first.vlines(truth[every], low, high, color=LIGHT, lw=1.0, label="90 % interval")
    first.vlines(truth[every], q[every, 1], q[every, 3], color=MIDDLE, lw=1.6, label="50 % interval")
    first.plot(truth[every], q[every, 2], ".", color=DARK, ms=4, label="median")
    top = float(max(truth.max(), high.max()))
    first.plot([0, top], [0, top], color=DARK, lw=0.8, ls="--")
    first.set(xlabel="time to the slip, measured / s", ylabel="forecast / s")
    first.legend(loc="upper left")
    share = np.linspace(0.0, 1.0, 101)
    for name, style, colour in zip(
        data.forecaster.values, ("-", "--", "-.", ":"), (MIDDLE, DARK, LIGHT, LIGHT), strict=True
    ):
        pit = np.sort(data.pit.sel(forecaster=name).values)
        beside.plot(share, np.searchsorted(pit, share, side="right") / pit.size, style, color=colour, label=str(name))
    beside.plot([0, 1], [0, 1], color=DARK, lw=0.6)
    beside.set(xlabel="forecast probability of an earlier slip", ylabel="share of slips")
    beside.legend(loc="upper left")
    return made
