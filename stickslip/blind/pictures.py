"""Pictures of a score: what was named for each hidden effect, and the share of right answers over the amplitude."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..show.plots.style import DARK, LIGHT, MIDDLE, figure, logarithmic, styled
from .figures import VERDICTS, WORDS

ANSWERED = "answered (number of cases, right ones in red; grey: share of the row)"
LAST = ("set with it", "set without it", "several", "unknown", "failed", "not run")


@styled
def confusion_figure(score: Mapping[str, Any]) -> Figure:
    """Confusion matrix of names (one effect, nothing, outside), and of kinds of case against kinds of answer."""
    names = score["confusion"]["names"]
    rows, columns = _order(names)
    size = 2.6 + 0.27 * len(rows)
    made = Figure(figsize=(4.0 + 0.3 * max(len(columns), 12), 3.4 + size), layout="constrained")
    upper, lower = made.subplots(2, 1, height_ratios=(size, 2.0))
    is_right = partial(_right_name, _outside(score))
    _matrix(upper, names, rows, columns, is_right, "What was hidden (one effect, or none) and what was named")
    kinds = score["confusion"]["kinds"]
    _matrix(lower, kinds, list(kinds), list(VERDICTS), _right_kind, "What was hidden and what was answered")
    return made


@styled
def confusion_by_amplitude_figure(score: Mapping[str, Any]) -> Figure:
    """The same two matrices for every bin of amplitude, one below the other; only names that occur in a bin."""
    bins = score["by_amplitude"]
    orders = [_order(b["confusion"]["names"]) for b in bins]
    heights = [2.2 + 0.25 * max(len(rows), 3) for rows, _ in orders]
    made = Figure(figsize=(13.0, sum(heights)), layout="constrained")
    panels = made.subplots(len(bins), 2, squeeze=False, height_ratios=heights, width_ratios=(3, 2))
    for (left, right), b, (rows, columns) in zip(panels, bins, orders, strict=True):
        where = f"{b['from']:g} to {b['to']:g} times detection"
        table = b["confusion"]
        is_right = partial(_right_name, _outside(score))
        _matrix(left, table["names"], rows, columns, is_right, f"{where}: what was named (one effect hidden)")
        kinds = [kind for kind in table["kinds"] if kind != "nothing"]
        _matrix(right, table["kinds"], kinds, list(VERDICTS), _right_kind, f"{where}: what was answered")
    for axes in panels.flat:
        axes.set_xlabel("")
    made.supxlabel(ANSWERED)
    return made


def _order(names: Mapping[str, Mapping[str, int]]) -> tuple[list[str], list[str]]:
    """Rows and columns in the same order, so that right names lie on the diagonal."""
    given = {column for row in names.values() for column in row}
    rows = sorted(names, key=lambda name: (name != "nothing", name))
    tags = [name for name in rows if name in given]
    columns = [*tags, *sorted(given - set(tags) - set(LAST)), *(name for name in LAST if name in given)]
    return [*tags, *(name for name in rows if name not in tags)], columns


def _outside(score: Mapping[str, Any]) -> set[str]:
    return {h["tag"] for case in score["list"] if case["kind"] == "outside" for h in case["hidden"]}


def _right_name(outside: set[str], row: str, column: str) -> bool:
    return column == "unknown" if row in outside else column in (row, "set with it")


def _right_kind(row: str, column: str) -> bool:
    return column in {"nothing": ("complete",), "outside": ("unknown",)}.get(row, ("named", "set with it"))


def _matrix(
    axes: Axes,
    table: Mapping[str, Mapping[str, int]],
    rows: list[str],
    columns: list[str],
    is_right: Callable[[str, str], bool],
    title: str,
) -> None:
    if not rows or not columns:
        axes.set_axis_off()
        axes.set_title(f"{title}: no case")
        return
    values = np.array([[table[row].get(column, 0) for column in columns] for row in rows], dtype=float)
    whole = values.sum(axis=1, keepdims=True)
    shares = np.divide(values, whole, out=np.zeros_like(values), where=whole > 0)
    axes.imshow(shares, cmap="Greys", vmin=0.0, vmax=2.5, aspect="auto")
    for i, j in np.argwhere(values > 0):
        right = is_right(rows[i], columns[j])
        axes.text(j, i, f"{values[i, j]:.0f}", ha="center", va="center", color=MIDDLE if right else DARK,
                  weight="bold" if right else "normal")  # fmt: skip
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(rows)), [WORDS.get(row, row) for row in rows])
    axes.set_ylabel("hidden")
    axes.set_xlabel(ANSWERED)
    axes.grid(False)
    axes.set_title(title)


@styled
def amplitude_figure(score: Mapping[str, Any]) -> Figure:
    """Share of right answers, fall of the held-out error and stated confidence against the amplitude."""
    made, panels = figure(1, 3, width=13.0, height=3.8)
    left, right, last = panels[0]
    bins = score["by_amplitude"]
    for number, (name, colour, marker) in enumerate(
        (("right", DARK, "o"), ("exact", MIDDLE, "s"), ("class", LIGHT, "^"))
    ):
        x, y, low, high = _points(bins, name)
        shift = 1.06 ** (number - 1)
        left.errorbar(np.array(x) * shift, y, [low, high], color=colour, marker=marker, linestyle="", capsize=3,
                      label=name)  # fmt: skip
    left.axhline(0.85, color=LIGHT, linestyle=":", label="aim from 5 times on")
    left.set_ylim(0, 1.02)
    left.set_ylabel("share of the cases with hidden effects")
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=4)
    left.set_title("Right answers")
    for case in score["list"]:
        if case["hidden"] and case["heldout_base"] and case["heldout_final"] is not None:
            x0 = min(h["multiple"] for h in case["hidden"])
            colour = DARK if case["right"] else MIDDLE
            right.plot(x0, case["heldout_final"] / case["heldout_base"], "o" if case["right"] else "x", color=colour)
    right.plot([], [], "o", color=DARK, label="answered rightly")
    right.plot([], [], "x", color=MIDDLE, label="answered wrongly")
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=2)
    right.set_ylabel("held-out error, last / base model\n(1: nothing added, or nothing gained)")
    logarithmic(right, "y")
    right.set_title("Fall of the held-out error")
    _confidence(last, bins)
    for axes in (left, right, last):
        logarithmic(axes, "x")
        axes.set_xlim(bins[0]["from"] * 0.9, bins[-1]["to"] * 1.1)
        axes.set_xlabel("weakest hidden effect (times detection)")
    return made


def _confidence(axes: Axes, bins: Sequence[Mapping[str, Any]]) -> None:
    """Stated confidence beside how often what it is stated of holds, in every bin."""
    stated = [b for b in bins if b["confidence"]["stated"] is not None]
    x, y, low, high = _points([{**b, "stated": b["confidence"]["holds"]} for b in stated], "stated")
    axes.plot(np.array(x) / 1.06, [b["confidence"]["stated"] for b in stated], "D", color=MIDDLE, label="stated, mean")
    axes.errorbar(np.array(x) * 1.06, y, [low, high], color=DARK, marker="o", linestyle="", capsize=3,
                  label="claim correct")  # fmt: skip
    for b, at in zip(stated, x, strict=True):
        axes.annotate(f"n = {b['confidence']['holds']['of']}", (at, 1.04), ha="center", va="bottom", color=DARK)
    axes.set_ylim(0, 1.13)
    axes.set_ylabel("share of the answers with a confidence")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=2)
    axes.set_title("Stated confidence" if stated else "Stated confidence: none")


def _points(bins: Sequence[Mapping[str, Any]], name: str) -> tuple[list[float], list[float], list[float], list[float]]:
    x, y, low, high = [], [], [], []
    for b in bins:
        found = b[name]
        if found["of"]:
            x.append(float(np.sqrt(b["from"] * b["to"])))
            y.append(found["share"])
            low.append(max(found["share"] - found["low"], 0.0))
            high.append(max(found["high"] - found["share"], 0.0))
    return x, y, low, high
