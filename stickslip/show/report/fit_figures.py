"""Pictures of fits, drawn from a run folder alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...errors import ArgumentError
from ..plots.style import DARK, LIGHT, MIDDLE, figure, label, panels, plain, remark, scaled, styled
from .figures import series

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

LINEAR = 10.0  # of a gain, up to which an axis of gains is linear
_MARKS = {
    "creep": ("o", DARK),
    "slip": ("s", MIDDLE),
    "ring-down": ("^", LIGHT),
    "recurrence": ("D", "#4f772d"),
    "hold": ("v", "#7b5ea7"),
}


def _grid(count: int, tall: int, width: float, height: float) -> tuple[Figure, np.ndarray, list[np.ndarray]]:
    """A figure, its axes, and those of ``count`` places, up to four beside one another, each of so many axes."""
    columns = min(4, count)
    rows = -(-count // columns)
    made, axes = figure(tall * rows, columns, width=width * columns, height=height * rows)
    places = [axes[tall * r : tall * (r + 1), c] for r in range(rows) for c in range(columns)]
    for ax in (ax for place in places[count:] for ax in place):
        ax.set_visible(False)
    return made, axes, places[:count]


@styled
def creep_grid(data: xarray.Dataset, fits: Sequence[Mapping[str, Any]], most: int = 8) -> Figure:
    """Some creep processes, the best and the worst among them, with the model and the residual."""
    known = [i for i in range(len(fits)) if f"creep{i}_time" in data]
    order = sorted(known, key=lambda i: fits[i]["nrmse"] or 0.0)
    chosen = [order[int(k)] for k in np.unique(np.linspace(0, len(order) - 1, min(most, len(order))).round())]
    made, axes, pairs = _grid(len(chosen), 2, 2.9, 3.6)
    for (top, low), i in zip(pairs, chosen, strict=True):
        t, u, model = (series(data, f"creep{i}", name) for name in ("time", "displacement", "model"))
        assert t is not None and u is not None and model is not None
        k, unit = scaled(u, "m")
        top.plot(t, u * k, color=DARK, lw=1.2, label="measured")
        top.plot(t, model * k, color=MIDDLE, ls="--", lw=1.2, label="static model")
        fit = fits[i]
        top.set_title(plain(f"{fit['trace']}, event {fit['event']}: {100 * fit['nrmse']:.2g} %", 40), fontsize=9)
        top.set_ylabel(f"u / {unit}")
        k, unit = scaled(u - model, "m")
        low.plot(t, (u - model) * k, color=DARK, lw=1.0)
        low.axhline(0.0, color=LIGHT, lw=0.8)
        low.set(xlabel="time to v_lim / s", ylabel=f"residual / {unit}")
        for ax in (top, low):
            ax.xaxis.set_major_locator(MaxNLocator(4))  # 0.0625 is a wide label
    axes[0, 0].legend(fontsize=8, loc="upper left")
    return made


@styled
def ramp_grid(data: xarray.Dataset, fits: Sequence[Mapping[str, Any]], most: int = 16) -> Figure:
    """Break-away ramps with their fits."""
    chosen = [i for i in range(len(fits)) if f"ramp{i}_tau" in data][:most]
    made, axes, places = _grid(len(chosen), 1, 2.8, 2.3)
    for (ax,), i in zip(places, chosen, strict=True):
        tau, u, model = (series(data, f"ramp{i}", name) for name in ("tau", "displacement", "model"))
        assert tau is not None and u is not None and model is not None
        scale = fits[i]["u_max"]
        ax.plot(tau, u / scale, color=DARK, lw=1.2, label="measured")
        ax.plot(tau, model / scale, color=MIDDLE, ls="--", lw=1.2, label="static model")
        ax.set_title(plain(f"{fits[i]['trace']}: {100 * fits[i]['nrmse']:.2g} %", 36), fontsize=9)
        ax.set(xlabel="share of break-away force", ylabel="u / u_max")
    axes[0, 0].legend(fontsize=8, loc="upper left")
    return made


@styled
def ladder_picture(ladder: Sequence[Mapping[str, Any]], *, ax: Sequence[Axes] | None = None) -> Figure:
    """Errors of every model, on fitted (solid) and on unseen runs (dashed): over all phases, and by phase."""
    made, (whole, by_phase) = panels(ax, columns=2, width=10.0, height=3.8)
    labels, before = [], 0
    for i, step in enumerate(ladder):
        parts = step.get("model") or ["model"]
        name = str(step.get("added") or " + ".join(parts[before:] or parts[-1:]))
        removed = step.get("removed")
        labels.append(plain(f"without {removed}" if removed else ("+ " if i else "") + name, 28))
        before = len(parts)
    x = np.arange(len(ladder))
    for name, text, style in (("train_error", "fitted runs", "-"), ("heldout_error", "unseen runs", "--")):
        y = np.array([np.nan if step.get(name) is None else step[name] for step in ladder], float)
        if np.isfinite(y).any():
            whole.plot(x, y, style, marker="o", color=DARK if style == "-" else MIDDLE, label=text)
    kinds = ("by_phase", "heldout_by_phase")
    phases = list(dict.fromkeys(p for step in ladder for key in kinds for p in (step.get(key) or {})))
    for phase in phases:
        mark, colour = _MARKS.get(phase, ("x", DARK))
        name = plain(phase, 30)
        for key, style in zip(kinds, ("-", "--"), strict=True):
            found = [(step.get(key) or {}).get(phase) for step in ladder]
            y = np.array([np.nan if v is None else v for v in found], float)
            if np.isfinite(y).any():
                by_phase.plot(x, y, style, marker=mark, color=colour, label=name)
                name = "_unseen"  # once in the legend
    whole.set_title("all phases")
    by_phase.set_title("by phase (dashed: unseen runs)")
    for panel in (whole, by_phase):
        panel.axhline(1.0, color=LIGHT, ls=":", lw=1.0)
        if panel.get_lines()[:-1]:
            panel.set_yscale("log")
            panel.legend()
        panel.set_xticks(x, labels, rotation=20, ha="right")
        panel.set_ylabel("residual / floor")
    return made


@styled
def candidates_picture(table: pandas.DataFrame, most: int = 15, *, ax: Axes | None = None) -> Figure:
    """What every effect takes off the cost, of the runs it was fitted to and of unseen ones, the best on top.

    Args:
        table: with a row for each effect: ``gain``, ``unseen gain`` and its deviation ``+-``.
        most: rows that are drawn.
        ax: axes to draw in; default a figure of its own.

    Raises:
        InputError: less than one row.
    """
    if not isinstance(most, int) or most < 1:
        raise ArgumentError("out of range", key="most", value=most, allowed="1, 2, 3, ...")
    columns = ["gain", "unseen gain", "+-"]
    rows = table.reindex(columns=columns).dropna(subset="gain").head(most)
    made, (ax,) = panels(ax, width=7.5, height=1.3 + 0.3 * len(rows))
    if not len(rows):
        remark(ax, "no effect was refitted")
        return made
    y = np.arange(len(rows))
    gain, unseen, error = (rows[name].to_numpy(float) for name in columns)
    ax.plot(gain, y, "o", color=DARK, mfc="none", label="fitted runs")
    ax.errorbar(unseen, y, xerr=error, fmt="D", ms=5, color=MIDDLE, capsize=3, label="unseen runs, one deviation")
    ax.axvline(0.0, color=LIGHT, lw=1.0)
    ax.set_xscale("symlog", linthresh=LINEAR, linscale=0.5)
    ax.set_yticks(y, [plain(name, 40) for name in rows.index])
    ax.set(xlabel="gain (2 Δ log-likelihood)", ylim=(len(rows) - 0.5, -0.5))
    ax.legend()
    return made


@styled
def profile_picture(profile: Mapping[str, Any]) -> Figure:
    """Rise of chi-square against a held parameter."""
    made, axes = figure(1, 1, width=5.0, height=3.0)
    ax = axes[0, 0]
    value, unit = scaled(np.array(profile["value"], float), profile.get("unit") or "1")
    ax.plot(np.array(profile["value"]) * value, profile["rise"], "o-", color=DARK)
    ax.axhline(3.84, color=MIDDLE, ls="--", lw=1.0, label="95 %")
    ax.set(xlabel=plain(label(profile["name"], unit)), ylabel="rise of chi-square")
    ax.legend()
    return made
