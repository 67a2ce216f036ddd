"""The picture of a comparison of two runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..plots.style import DARK, LIGHT, MIDDLE, figure, logarithmic, plain, remark, styled
from .compare import MOST

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = 12.0  # standard deviations; beyond it a bar is cut and its number says how far it goes


@styled
def comparison_figure(found: Mapping[str, Any]) -> Figure:
    """Errors by phase of both runs (left), differences of their parameters in standard deviations (right)."""
    rows = [r for r in found["parameters"] if r["deviations"] is not None and any(r["std"])]
    made, axes = figure(1, 2, width=11.0, height=max(3.8, 1.4 + 0.28 * len(rows)))
    _errors(axes[0, 0], found)
    if rows:
        _deviations(axes[0, 1], rows)
    else:
        remark(axes[0, 1], "no parameter that both fits determine")
    return made


def _errors(ax: Any, found: Mapping[str, Any]) -> None:
    rows = found["errors"]
    x = np.arange(len(rows))
    for k, (run, colour) in enumerate(zip(found["runs"], (DARK, MIDDLE), strict=True)):
        name = plain(f"{k + 1}: {' + '.join(run['model'][2:]) or run['model'][-1]}", 40)
        for key, share, text in (("train", 1.0, "fitted"), ("heldout", 0.45, "unseen")):
            y = np.array([np.nan if r[key][k] is None else r[key][k] for r in rows], float)
            if np.isfinite(y).any():
                place = x + (k - 0.5) * 0.4 + (0.0 if key == "train" else 0.18) - 0.09
                ax.bar(place, y, 0.17, color=colour, alpha=share, label=f"{name}, {text}")
    ax.axhline(1.0, color=LIGHT, ls=":", lw=1.2)
    logarithmic(ax, "y")
    ax.set_xticks(x, [plain(r["phase"], 30) for r in rows], rotation=20, ha="right")
    ax.set_ylabel("residual / floor")
    ax.legend(fontsize=8)


def _deviations(ax: Any, rows: list[Mapping[str, Any]]) -> None:
    far = np.array([r["deviations"] for r in rows], float)
    y = np.arange(len(rows))[::-1]
    ax.barh(y, np.clip(far, -_SHOWN, _SHOWN), color=[MIDDLE if abs(d) > MOST else DARK for d in far])
    for at, d in zip(y, far, strict=True):
        if abs(d) > _SHOWN:
            ax.text(np.sign(d) * 0.95 * _SHOWN, at, f"{d:.3g}", ha="right" if d > 0 else "left", va="center", color="w")
    ax.axvspan(-1.0, 1.0, color=LIGHT, alpha=0.25, lw=0, zorder=0)
    ax.axvline(0.0, color=DARK, lw=0.8)
    ax.set_yticks(y, [plain(r["name"], 34) for r in rows])
    ax.set_xlim(-1.05 * _SHOWN, 1.05 * _SHOWN)
    ax.set_xlabel("second less first, in standard deviations")
