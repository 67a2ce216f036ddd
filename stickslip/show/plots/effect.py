"""A trace with an effect beside the one without it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...data.segment import thin
from .style import DARK, MIDDLE, figure, remark, scaled, styled

if TYPE_CHECKING:
    from .style import Axes, Figure, Run


@styled
def effect_figure(without: Run, with_it: Run, tag: str, values: str) -> Figure:
    """Whole trace, a stick, a slip and the spring's force, without and with an effect.

    Args:
        without, with_it: data sets of `simulate`, of one rig.
        tag: name of the effect.
        values: its parameters, for the title.
    """
    made, axes = figure(2, 2, width=10.5, height=7.0)
    made.suptitle(f"{tag}: {values}", fontsize=11)
    pairs = (
        (without, {"color": MIDDLE, "ls": "--", "lw": 1.6, "label": "without"}),
        (with_it, {"color": DARK, "lw": 1.1, "label": "with"}),
    )
    _curves(axes[0, 0], [(d["time"].values, d["reading"].values, k) for d, k in pairs], "m", "whole trace, as read")
    axes[0, 0].set_xlabel("time / s")
    axes[0, 0].legend(loc="upper left")
    _curves(axes[0, 1], [(d["time"].values, d["spring_force"].values, k) for d, k in pairs], "N", "spring force")
    axes[0, 1].set_xlabel("time / s")
    _around(axes[1, 0], pairs, "stick after the first slip", "s", stick=True)
    _around(axes[1, 1], pairs, "first slip and ring-down", "ms", stick=False)
    return made


def _curves(axes: Axes, curves: list[tuple[np.ndarray, np.ndarray, dict]], unit: str, title: str) -> None:
    k, shown = scaled(np.concatenate([y for _, y, _ in curves]), unit)
    for t, y, look in curves:
        axes.plot(*thin(t, y * k), **look)
    axes.set(title=title, ylabel=f"{'displacement' if unit == 'm' else 'force'} / {shown}")


def _around(axes: Axes, pairs: tuple, title: str, unit: str, *, stick: bool) -> None:
    """The reading from just after the first arrest to the next onset, or around the first slip."""
    curves = []
    for data, look in pairs:
        onset, arrest = data["onset"].values, data["arrest"].values
        if onset.size < (2 if stick else 1):
            continue
        length = arrest[0] - onset[0]
        begin, end = (arrest[0], onset[1]) if stick else (onset[0] - 0.2 * length, arrest[0] + 0.6 * length)
        t, y = data["time"].values, data["reading"].values
        part = (t >= begin) & (t <= end)
        zero = begin if stick else onset[0]
        curves.append(((t[part] - zero) * (1.0 if stick else 1e3), y[part] - y[part][0], look))
    if not curves:
        remark(axes, "no such slip")
        axes.set_title(title)
        return
    _curves(axes, curves, "m", title)
    if stick:
        # the last nanometres before a slip run away: show the creep
        ends = [np.quantile(y, (0.02, 0.97)) for _, y, _ in curves]
        low, high = min(e[0] for e in ends), max(e[1] for e in ends)
        k = scaled(np.concatenate([y for _, y, _ in curves]), "m")[0]
        axes.set_ylim((low - 0.3 * (high - low)) * k, (high + 0.3 * (high - low)) * k)
    axes.set_xlabel(f"time after {'arrest' if stick else 'onset'} / {unit}")
