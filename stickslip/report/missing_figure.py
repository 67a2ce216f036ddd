"""The picture of the missing force, drawn from a run folder alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..plots.style import DARK, LIGHT, MIDDLE, figure, logarithmic, plain, remark, scaled, styled
from .figures import series

if TYPE_CHECKING:
    import xarray

BAND = 2.0  # standard deviations
_PANELS = (
    ("displacement", "m", "displacement", "along the track, less its mean", False),
    ("velocity", "m/s", "speed", "with velocity", True),
    ("age", "s", "time in contact", "with time in contact, from the shortest", True),
)
_LOOKS = ((DARK, "-"), (MIDDLE, "--"))


@styled
def missing_picture(data: xarray.Dataset, shown: Sequence[Mapping[str, Any]]) -> Figure:
    """Force on the block that each model lacks (positive drives it on), with bands and marks where the data are."""
    made, axes = figure(1, 3, width=12.0, height=3.9)
    text = "A display, no proof: force that the model lacks (positive: in the direction of the drive)"
    made.suptitle(text, fontsize=11)
    shown = shown[-len(_LOOKS) :]
    known = [[_part(data, i, panel[0]) for i in range(len(shown))] for panel in _PANELS]
    heights = [max([_reach(*part) for part in parts if part is not None], default=0.0) for parts in known]
    per, unit = scaled(np.array([max(heights)]), "N")
    for ax, (_, base, text, title, logarithm), parts, height in zip(axes.flat, _PANELS, known, heights, strict=True):
        ax.set_title(title)
        if height == 0.0:
            remark(ax, "not known")
            continue
        for i, part in enumerate(parts):
            if part is None:
                continue
            at, force, std, seen = part
            colour, style = _LOOKS[len(shown) - 1 - i]  # the last model is the dark one
            k, name = scaled(at, base)
            low, high = (force - BAND * std) * per, (force + BAND * std) * per
            ax.fill_between(at * k, low, high, color=colour, alpha=0.18, lw=0.0)
            ax.plot(at * k, force * per, style, color=colour, label=plain(" + ".join(shown[i]["model"]), 60))
            ax.set_xlim(at[0] * k, at[-1] * k)
            ax.set_xlabel(f"{text} / ({name})" if "/" in name else f"{text} / {name}")
        _rug(ax, np.unique(seen) * k)
        if logarithm:
            logarithmic(ax, "x")
        ax.axhline(0.0, color=LIGHT, lw=0.9)
        ax.set_ylim(-1.1 * height * per, 1.1 * height * per)
    axes[0, 0].set_ylabel(f"missing force / {unit}")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if handles:
        made.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=9)
    return made


def _part(data: xarray.Dataset, number: int, key: str) -> tuple[np.ndarray, ...] | None:
    """Where, force, its standard deviation, and where the data are."""
    found = [series(data, f"missing{number}_{key}", name) for name in ("at", "force", "std", "seen")]
    if any(a is None for a in found):
        return None
    return tuple(a for a in found if a is not None)


def _reach(at: np.ndarray, force: np.ndarray, std: np.ndarray, seen: np.ndarray) -> float:
    """Half of the height of a panel (N): bands that become wide at the ends of the data are cut."""
    inside = (at >= seen.min()) & (at <= seen.max())
    if not inside.any():
        return 0.0
    force, std = np.abs(force[inside]), std[inside]
    return float(max(np.max(force) + BAND * np.median(std), np.quantile(force + BAND * std, 0.9)))


def _rug(axes: Axes, at: np.ndarray) -> None:
    """Marks at the lower border where the data are."""
    axes.plot(at, np.zeros(at.size), "|", color=DARK, ms=9, mew=0.8, alpha=0.6, transform=axes.get_xaxis_transform(),
              clip_on=False)  # fmt: skip
