"""Reciprocating loops: the diagnosis, how the fixture gives way, and what the level follows from stroke to stroke."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.data.prescribed import with_motion
from stickslip.inference.forecast.strokes import Strokes
from stickslip.objects.wander import wander, wander_sentence
from stickslip.show.plots.style import DARK, MIDDLE, figure, plain, styled

from .along_the_motion import diagnosed, ladder
from .campaigns import FOLDERS, keep, shipped

PARTS = 3  # of the strokes, whose means are drawn
FIXTURE = "uneven-compliance"
RESTING = 5e-7  # m, within which the stage rests at a turn
LEVELS = np.linspace(-0.8, 0.6, 8)  # of the friction force, towards the new direction


def reciprocating_loops(data: Path, work: Path) -> dict[str, Any]:
    """Five times four cycles diagnosed, once with the fixture alone; all fifty for the level and the turns."""
    campaign = shipped("reciprocating-loops-whole", data, work / FOLDERS["reciprocating-loops-whole"])
    trace = with_motion(campaign.traces[0])
    found, strokes = wander(campaign), Strokes.of(trace)
    assert found is not None and strokes is not None
    keep(picture(strokes), "real-loops-level")
    told = {"wander": found, "follows": wander_sentence(found), "level": float(strokes.level.mean())}
    few = shipped("reciprocating-loops", data, work / "alone").diagnose(candidates=[FIXTURE], max_effects=1)
    assert few.best is not None
    bend = few.best.parameters.loc[f"{FIXTURE}.bend"]
    fixture = {"ladder": ladder(few), "bend": [float(bend["value"]), float(bend["std"])], "turns": turns(trace)}
    keep(gives_way(fixture), "real-loops-fixture")
    return {**diagnosed("reciprocating-loops", data, work), **told, "fixture": fixture}


def turns(trace: Any) -> dict[str, Any]:
    """How far the stage goes from a turn until the force has come to each level towards the new direction (m).

    Forces are over the usual friction force. A contact is loaded one way as it is the other way, so what differs
    between the two directions is the fixture's: the more it gives way to a force of one sign.
    """
    x, force = trace.displacement, trace.spring_force
    usual = float(np.quantile(np.abs(force), 0.9))
    side = np.sign(x - 0.5 * (x.min() + x.max()))
    middles = np.flatnonzero(np.diff(side))
    ways: dict[int, list[list[float]]] = {1: [], -1: []}
    for first, last in pairwise(middles):
        arriving = int(np.sign(x[first + 1] - x[first]))
        way, pull = -arriving * x[first:last], -arriving * force[first:last]
        turn = np.flatnonzero(way < way.min() + RESTING)[-1]
        way, pull = way[turn:] - way[turn], pull[turn:] / usual
        if pull.max() > LEVELS[-1]:
            ways[-arriving].append([float(way[np.argmax(pull > level)]) for level in LEVELS])
    return {
        "force": usual,
        "ways": {
            name: {"turns": len(rows), "mean": np.mean(rows, axis=0).tolist(), "error": _error(rows)}
            for name, rows in (("there", ways[1]), ("back", ways[-1]))
        },
    }


def _error(rows: list[list[float]]) -> list[float]:
    """Standard error of the differences from level to level."""
    return (np.std(np.diff(rows, axis=1), axis=0, ddof=1) / np.sqrt(len(rows))).tolist()


@styled
def picture(found: Strokes) -> Any:
    """Level against place, there and back, of early and late strokes; and mean level of every stroke against time."""
    made, (axes,) = figure(1, 2, width=10.0, height=3.6)
    left, right = axes
    order = np.array_split(np.arange(found.time.size), PARTS)
    x = 1e6 * (found.place - found.place[0])
    for way, color, name in ((1.0, DARK, "there"), (-1.0, MIDDLE, "back")):
        for part, line, when in ((order[0], "-", "first third"), (order[-1], "--", "last third")):
            own = part[found.direction[part] == way]
            left.plot(x, found.level[own].mean(axis=0), line, color=color, lw=1.2, label=f"{name}, {when}")
        own = found.direction == way
        right.plot(found.time[own], found.level[own].mean(axis=1), ".", color=color, ms=4, label=name)
    left.set(xlabel="place of the contact / µm", ylabel="level of friction / N")
    right.set(xlabel="time / s", ylabel="mean level of a stroke / N")
    left.legend(fontsize="x-small")
    right.legend(fontsize="x-small")
    return made


@styled
def gives_way(fixture: dict[str, Any]) -> Any:
    """Way of the stage from a turn, and by how much more compliant the fixture is under a force there than one back."""
    made, (axes,) = figure(1, 2, width=10.0, height=3.6)
    left, right = axes
    usual, ways = fixture["turns"]["force"], fixture["turns"]["ways"]
    for (name, way), color, line in zip(ways.items(), (DARK, MIDDLE), ("o-", "s--"), strict=True):
        left.plot(1e6 * np.array(way["mean"]), usual * LEVELS, line, color=color, lw=1.0, ms=4, label=name)
    there, back = (np.diff(ways[name]["mean"]) for name in ("there", "back"))
    error = np.hypot(*(np.array(ways[name]["error"]) for name in ("there", "back")))
    at, step = 0.5 * (LEVELS[1:] + LEVELS[:-1]) * usual, np.diff(LEVELS) * usual
    right.errorbar(
        at, 1e6 * (there - back) / step, 1e6 * error / step, fmt="o", color=DARK, ms=4, label="from the turns"
    )
    right.plot(at, 4e6 * fixture["bend"][0] * at, "--", color=MIDDLE, label=f"fit of {plain(FIXTURE)}")
    left.set(xlabel="way of the stage from the turn / µm", ylabel="force towards the new direction / N")
    right.set(xlabel="force F / N", ylabel="compliance at F less that at -F / (µm/N)")
    left.legend(fontsize="x-small")
    right.legend(fontsize="x-small")
    return made
