"""Static creep curves, alone and beside the motion with inertia."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...data.segment import thin
from .style import DARK, MIDDLE, figure, plain, remark, scaled, styled

if TYPE_CHECKING:
    from .style import Axes, Figure, Run


@styled
def creep_figure(tau: np.ndarray, u: np.ndarray, t: np.ndarray, title: str) -> Figure:
    """A static creep curve against load and against virtual time: ``creep_figure(*ss.static_creep(scenario), "rig")``.

    Args:
        tau: share of full friction (1), shape (n,).
        u: displacement, m, shape (n,).
        t: virtual time, s, shape (n,).
        title: above both panels.
    """
    made, axes = figure(1, 2, width=10.0, height=4.2)
    made.suptitle(plain(title), fontsize=11)
    k, unit = scaled(u, "m")
    axes[0, 0].plot(tau, u * k, color=DARK)
    axes[0, 0].set(xlabel="share of full friction", ylabel=f"displacement / {unit}", title="static curve")
    axes[0, 1].plot(t, u * k, color=DARK)
    axes[0, 1].set(xlabel="virtual time / s", ylabel=f"displacement / {unit}", title="creep curve")
    return made


@styled
def static_against_inertial(runs: Sequence[Run], labels: Sequence[str]) -> Figure:
    """The first stick of every run: static curve and simulated motion side by side, and their difference below."""
    columns = min(len(runs), 4)
    chosen = np.unique(np.linspace(0, len(runs) - 1, columns).round().astype(int))
    made, axes = figure(2, len(chosen), width=max(3.4 * len(chosen), 6.0), height=6.2)
    made.suptitle("First stick: static curve against the motion with inertia and weakening", fontsize=11)
    for i, run in enumerate(chosen):
        _pair(axes[0, i], axes[1, i], runs[run], labels[run], legend=i == 0)
    return made


def _pair(top: Axes, low: Axes, data: Run, label: str, *, legend: bool) -> None:
    top.set_title(plain(label))
    u, moment = data["static_displacement"].values, data["static_time"].values
    t, x = data["time"].values, data["displacement"].values
    end = float(data["onset"].values[0]) if data.sizes["event"] else float(t[-1])
    # a block that slides without an event is followed until it has left the static curve
    gone = np.flatnonzero(np.abs(x) > 1.3 * np.max(np.abs(u), initial=0.0))
    part = t <= (min(end, t[gone[0]]) if gone.size else end)
    if u.size < 2 or part.sum() < 3:
        remark(top, "the drive stands still at first")
        remark(low, "")
        return
    t, x = t[part], x[part]
    k, unit = scaled(u, "m")
    top.plot(moment, u * k, color=MIDDLE, ls="--", lw=1.8, label="static")
    top.plot(*thin(t, x * k), color=DARK, label="with inertia")
    bound = 1.3 * float(np.max(np.abs(u))) * k
    top.set_ylim((-0.05 * bound, bound) if u[-1] > 0 else (-bound, 0.05 * bound))
    top.set(xlabel="time / s", ylabel=f"displacement / {unit}")
    difference = x - np.interp(t, moment, u, right=np.nan)
    known = np.isfinite(difference) & (np.abs(x) < 1.3 * np.max(np.abs(u)))
    if legend:
        top.legend(loc="upper left")
    if known.sum() < 3:
        remark(low, "no common time")
        return
    # the end runs away; what comes before it is the news
    least, most = np.quantile(difference[known], (0.01, 0.97))
    size = max(most - least, 1e-15)
    k, unit = scaled(np.array([size]), "m")
    low.plot(*thin(t[known], difference[known] * k), color=DARK, lw=0.9)
    low.set_ylim((least - 0.3 * size) * k, (most + 0.5 * size) * k)
    low.set(xlabel="time / s", ylabel=f"inertial - static / {unit}", xlim=top.get_xlim())
