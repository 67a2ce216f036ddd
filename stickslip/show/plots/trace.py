"""A simulated trace: the whole, one creep, one slip with its ring-down, the phase plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from ...data.segment import thin
from .style import DARK, LIGHT, MIDDLE, figure, label, plain, remark, scaled, styled

if TYPE_CHECKING:
    from .style import Axes, Figure, Run


@styled
def trace_figure(data: Run) -> Figure:
    """Four panels of a data set of `simulate`."""
    made, axes = figure(2, 2, width=11.0, height=7.6)
    made.suptitle(plain(f"{data.attrs['title']}: {data.attrs['verdict']}", 240), fontsize=11, wrap=True)
    whole(axes[0, 0], data)
    creep(axes[0, 1], data)
    slip(axes[1, 0], data)
    phase_plane(axes[1, 1], data)
    return made


def whole(axes: Axes, data: Run) -> None:
    """Displacement and load point against time."""
    t, x, drive = (data[name].values for name in ("time", "displacement", "drive_position"))
    k, unit = scaled(np.concatenate([x, drive]), "m")
    axes.plot(*thin(t, drive * k), color=MIDDLE, ls="--", lw=1.1, label="load point")
    axes.plot(*thin(t, x * k), color=DARK, label="block")
    axes.set(xlabel="time / s", ylabel=f"displacement / {unit}", title="whole run")
    axes.legend(loc=_free_corner(drive))


def creep(axes: Axes, data: Run) -> None:
    """The last stick before a slip, or the whole run where there is none, as the vibrometer shows it."""
    onset, arrest = data["onset"].values, data["arrest"].values
    t, x, reading = (data[name].values for name in ("time", "displacement", "reading"))
    axes.set_title("creep of the stick")
    if onset.size:
        begin = arrest[-2] if onset.size > 1 else t[0]
        end = onset[-1]
        part = (t >= begin + 0.01 * (end - begin)) & (t <= end)
        clock = f"time before slip {onset.size} / s"
    else:
        part, end, clock = t >= t[0], 0.0, "time / s"
    if part.sum() < 2:
        remark(axes, "no creep between the samples")
        return
    zero = x[part][0]
    k, unit = scaled(x[part] - zero, "m")
    shown = reading[part] - reading[part][0]
    if not np.allclose(shown, x[part] - zero, rtol=0.0, atol=1e-3 * np.ptp(x[part]) + 1e-15):
        axes.plot(*thin(t[part] - end, shown * k), color=LIGHT, lw=1.0, label="vibrometer")
    axes.plot(*thin(t[part] - end, (x[part] - zero) * k), color=DARK, label="block")
    low, high = (x[part] - zero).min() * k, (x[part] - zero).max() * k
    axes.set_ylim(low - 0.15 * (high - low) - 1e-12, high + 0.15 * (high - low) + 1e-12)
    axes.set(xlabel=clock, ylabel=f"displacement / {unit}")
    axes.locator_params(axis="x", nbins=6)
    axes.legend(loc=_free_corner(x[part] - zero))


def _free_corner(y: np.ndarray) -> Literal["lower left", "upper left"]:
    """Where a curve from zero leaves room: on the left above one that rises, below one that falls."""
    return "lower left" if y[-1] < y[0] else "upper left"


def slip(axes: Axes, data: Run) -> None:
    """The last slip and the ring-down after it: displacement, and velocity on a second axis."""
    axes.set_title("slip and ring-down")
    if not data.sizes["event"]:
        remark(axes, "no slip event")
        return
    t = data["time"].values
    onsets, arrests = data["onset"].values, data["arrest"].values
    followed = np.flatnonzero(arrests + 0.8 * (arrests - onsets) <= t[-1])  # a run may end with its last slip
    chosen = int(followed[-1]) if followed.size else -1
    onset, arrest = float(onsets[chosen]), float(arrests[chosen])
    part = (t >= onset - 0.3 * (arrest - onset)) & (t <= arrest + 0.8 * (arrest - onset))
    if part.sum() < 3:
        remark(axes, "too few samples in the slip: raise output.sampling_rate")
        return
    ms = (t[part] - onset) * 1e3
    x, v = data["displacement"].values[part], data["velocity"].values[part]
    k, unit = scaled(x - x[0], "m")
    axes.plot(ms, (x - x[0]) * k, color=DARK, label="displacement")
    axes.set(xlabel="time after onset / ms", ylabel=f"displacement / {unit}")
    other = axes.twinx()
    k, unit = scaled(v, "m/s")
    other.plot(ms, v * k, color=MIDDLE, ls="--", lw=1.1, label="velocity")
    other.set_ylabel(label("velocity", unit))
    other.grid(False)
    other.spines["right"].set_visible(True)
    lines = [*axes.get_lines(), *other.get_lines()]
    # a slip ends when it no longer outruns the drive; with a fast drive the block comes to rest only after that
    rests = np.flatnonzero((t >= arrest) & (data["velocity"].values * np.sign(x[-1] - x[0]) <= 0.0))
    begin = t[rests[0]] if rests.size else arrest
    after = (t >= begin + 0.03 * (arrest - onset)) & (t <= arrest + 0.8 * (arrest - onset))
    names = [str(line.get_label()) for line in lines]
    if after.sum() > 8:
        _ring(axes, t[after] - onset, data["displacement"].values[after])
        axes.legend(lines, names, loc="center right", bbox_to_anchor=(1.0, 0.66))
    else:
        axes.legend(lines, names, loc="upper left" if x[-1] > x[0] else "lower left")


def _ring(axes: Axes, t: np.ndarray, x: np.ndarray) -> None:
    """An inset with the ring-down in its own scale."""
    inset = axes.inset_axes((0.66, 0.2, 0.33, 0.27))
    middle = 0.5 * (x.min() + x.max())
    k, unit = scaled(x - middle, "m")
    inset.plot(t * 1e3, (x - middle) * k, color=DARK, lw=0.9)
    inset.set_title(f"ring-down / {unit}", fontsize=8)
    inset.tick_params(labelsize=7)


def phase_plane(axes: Axes, data: Run) -> None:
    """Velocity against the spring's force, with the force of full friction."""
    force, v = data["spring_force"].values, data["velocity"].values
    kf, unit_f = scaled(force, "N")
    kv, unit_v = scaled(v, "m/s")
    axes.plot(force * kf, v * kv, color=DARK, lw=0.8)
    full, name = data.attrs["friction_force"] * kf, "full static friction"
    for side, reached in ((full, force.max() * kf > 0.02 * full), (-full, force.min() * kf < -0.02 * full)):
        if reached:
            axes.axvline(side, color=MIDDLE, ls="--", lw=1.1, label=name)
            name = "_" + name  # named once
    axes.set(xlabel=f"spring force / {unit_f}", ylabel=label("velocity", unit_v), title="phase plane")
    if axes.get_legend_handles_labels()[0]:
        both = force.max() * kf > 0.02 * full and force.min() * kf < -0.02 * full
        axes.legend(loc="upper center" if both else "upper left" if v.max() > -v.min() else "lower right")
