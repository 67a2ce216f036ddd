"""Pictures of measured traces, drawn from a run folder's arrays alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..plots.style import DARK, MIDDLE, figure, plain, remark, scaled, styled

if TYPE_CHECKING:
    import xarray

HIDDEN = 0.1  # share of the way below which the distance to the load point is drawn in place of both
CROWD = 40  # slips beyond which marks would cover the trace


def series(data: xarray.Dataset, key: str, name: str) -> np.ndarray | None:
    """An array of the data set, or None."""
    found = data.get(f"{key}_{name}")
    return None if found is None else np.asarray(found.values, float)


@styled
def trace_picture(data: xarray.Dataset, number: int, facts: dict[str, Any]) -> Figure:
    """The whole trace with its events, one stick, one slip and what follows it."""
    made, axes = figure(1, 4, width=14.0, height=3.4)
    slips = len(facts.get("events", ()))
    made.suptitle(plain(f"{facts['name']}: {facts.get('regime', '')}, {slips} slips"), fontsize=11)
    key = f"trace{number}"
    _whole(axes[0, 0], data, key)
    _zoom(axes[0, 1], data, f"{key}_creep", "one stick", clip=True)
    _zoom(axes[0, 2], data, f"{key}_slip", "one slip", clip=False)
    _after(axes[0, 3], data, key)
    return made


def _unit(data: xarray.Dataset, name: str) -> str:
    return str(data[name].attrs.get("units", "m"))


def _whole(axes: Axes, data: xarray.Dataset, key: str) -> None:
    """Position and load point against time; their distance where nothing else could be seen of a long way."""
    t, y = series(data, f"{key}_whole", "time"), series(data, f"{key}_whole", "position")
    axes.set_title("whole trace")
    if t is None or y is None:
        remark(axes, "no samples")
        return
    unit, label = _unit(data, f"{key}_whole_position"), "position"
    drive = series(data, f"{key}_whole", "drive")
    if drive is not None and unit == "m" and np.ptp(drive - y) < HIDDEN * np.ptp(y):
        y, drive, label = drive - y, None, "load point less position"
    zero = float(y[0] if label == "position" else y.min())
    k, unit = scaled(y - zero, unit)
    if drive is not None:
        axes.plot(t, (drive - zero) * k, color=MIDDLE, ls="--", lw=1.0, label="load point")
    onset = series(data, f"{key}_event", "onset")
    crowded = onset is not None and onset.size > CROWD
    axes.plot(t, (y - zero) * k, color=DARK, lw=0.6 if crowded else 1.0, label="measured")
    if onset is not None and not crowded:
        axes.plot(onset, (np.interp(onset, t, y) - zero) * k, "v", ms=4, color=MIDDLE, label="onset")
    axes.set(xlabel="time / s", ylabel=f"{label} / {unit}")
    if len(axes.get_lines()) > 1:
        axes.legend(loc="upper left", fontsize=8)


def _zoom(axes: Axes, data: xarray.Dataset, key: str, title: str, *, clip: bool) -> None:
    t, y = series(data, key, "time"), series(data, key, "position")
    axes.set_title(title)
    if t is None or y is None or t.size < 3:
        remark(axes, "no slip")
        return
    zero = float(np.median(y[len(y) // 4 : max(len(y) // 2, len(y) // 4 + 1)])) if clip else float(y[0])
    shown = y - zero
    if clip:
        # the slip's own start would hide the creep before it
        low, high = np.quantile(shown, (0.02, 0.97))
        margin = 0.35 * (high - low) + 1e-15
        k, unit = scaled(np.array([high - low]), _unit(data, f"{key}_position"))
        axes.set_ylim((low - margin) * k, (high + margin) * k)
        when, factor, text = t - t[-1], 1.0, "time before onset / s"
    else:
        k, unit = scaled(shown, _unit(data, f"{key}_position"))
        factor, suffix = (1e3, "ms") if np.ptp(t) < 1 else (1.0, "s")
        when, text = t - t[0], f"time / {suffix}"
    axes.plot(when * factor, shown * k, color=DARK, lw=1.2)
    axes.set(xlabel=text, ylabel=f"position / {unit}")
    axes.locator_params(axis="x", nbins=5)


def _after(axes: Axes, data: xarray.Dataset, key: str) -> None:
    """What follows the same slip: a ring-down is too small to be seen beside it."""
    axes.set_title("after the slip")
    t, y, arrests = (
        series(data, f"{key}_{a}", b) for a, b in (("slip", "time"), ("slip", "position"), ("event", "arrest"))
    )
    inside = np.array([]) if t is None or arrests is None else arrests[(arrests > t[0]) & (arrests < t[-1])]
    if t is None or y is None or not inside.size or np.count_nonzero(t >= inside[0]) < 3:
        remark(axes, "no slip")
        return
    late = t >= inside[0]
    zero = float(np.median(y[late][late.sum() // 2 :]))
    k, unit = scaled(y[late] - zero, _unit(data, f"{key}_slip_position"))
    factor, suffix = (1e3, "ms") if np.ptp(t[late]) < 1 else (1.0, "s")
    axes.plot((t[late] - inside[0]) * factor, (y[late] - zero) * k, color=DARK, lw=1.0)
    axes.set(xlabel=f"time after the arrest / {suffix}", ylabel=f"position / {unit}")
    axes.locator_params(axis="x", nbins=5)


@styled
def ripple_picture(data: xarray.Dataset, number: int, facts: dict[str, Any]) -> Figure:
    """Amplitude spectrum of the position while the block sticks, with its lines."""
    made, axes = figure(1, 1, width=6.5, height=3.0)
    frequency, amplitude = (series(data, f"trace{number}_ripple", n) for n in ("frequency", "amplitude"))
    ax = axes[0, 0]
    if frequency is None or amplitude is None:
        remark(ax, "no sticks long enough")
        return made
    k, unit = scaled(amplitude, _unit(data, f"trace{number}_ripple_amplitude"))
    ax.loglog(frequency, amplitude * k, color=DARK, lw=0.8)
    for line in facts.get("lines", ()):
        f = 1.0 / line["period"]
        ax.axvline(f, color=MIDDLE, ls="--", lw=0.8)
        at = (f, line["amplitude"] * k)
        ax.annotate(f"{line['period']:.3g} s", at, (4, -2), textcoords="offset points", fontsize=8, color=MIDDLE)
    ax.set(xlabel="frequency / Hz", ylabel=f"amplitude / {unit}", title=plain(f"{facts['name']}: ripple in the sticks"))
    return made
