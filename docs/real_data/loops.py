"""Reciprocating loops: the diagnosis, and what the level of friction follows from stroke to stroke."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from stickslip.data.prescribed import with_motion
from stickslip.inference.forecast.strokes import Strokes
from stickslip.objects.wander import wander, wander_sentence
from stickslip.show.plots.style import DARK, MIDDLE, figure, styled

from .along_the_motion import diagnosed
from .campaigns import FOLDERS, keep, shipped

PARTS = 3  # of the strokes, whose means are drawn


def reciprocating_loops(data: Path, work: Path) -> dict[str, Any]:
    """Five times four cycles diagnosed; all fifty for the level."""
    campaign = shipped("reciprocating-loops-whole", data, work / FOLDERS["reciprocating-loops-whole"])
    found, strokes = wander(campaign), Strokes.of(with_motion(campaign.traces[0]))
    assert found is not None and strokes is not None
    keep(picture(strokes), "real-loops-level")
    told = {"wander": found, "follows": wander_sentence(found), "level": float(strokes.level.mean())}
    return {**diagnosed("reciprocating-loops", data, work), **told}


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
