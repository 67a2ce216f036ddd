"""Levels of strokes: friction where a contact slides over the same places again and again, both ways.

No slip tells a level where the motion is prescribed; the force that was measured while the contact slides does. What
differs from stroke to stroke at the same places does not belong to a place. What belongs to one is the same there
either way; what comes with the way since the motion turned is mirrored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...data.resolution import estimate_resolution, noise_level
from ...data.trace import Trace
from ..force.prescribed import both_ways, stretches

Array = NDArray[np.float64]
PLACES = 6
WHOLE = 0.5  # of the longest stroke, from which a stretch counts as one
KNEE = 0.25  # of what a stroke slides, before which its contact is still being loaded
LOADED = 0.5  # of the strength, below which force over displacement is the stiffness of what gives way
LEFT_OUT = 0.05  # share of the strokes that may not reach the places of the others


@dataclass(frozen=True)
class Strokes:
    """Levels of n strokes at the same places.

    Attributes:
        level: friction against the motion (N), less what differs between the two ways on the whole, shape (n, p).
        place: of the contact (m), ascending: of the motion, less what gives way under the force; shape (p,).
        time: when the middle of the places is passed (s), shape (n,).
        path: way of the motion until then (m), shape (n,).
        direction: 1 or -1, shape (n,).
    """

    level: Array
    place: Array
    time: Array
    path: Array
    direction: Array

    @property
    def arrays(self) -> dict[str, Array]:
        """Mean levels of strokes in pairs, there and back, as :func:`.levels.level_arrays` has those of slips."""
        first = int(np.argmax(self.direction > 0))
        pairs = [i for i in range(first, self.direction.size - 1) if self.direction[i] > 0 > self.direction[i + 1]]
        there, back = np.array(pairs), np.array(pairs) + 1
        mean = self.level.mean(axis=1)
        out = {"direction": np.ones(there.size)}
        for end, own in (("onset", there), ("arrest", back)):
            out |= {end: mean[own], f"time_{end}": self.time[own], f"path_{end}": self.path[own]}
            out[f"place_{end}"] = out[f"path_{end}"]
        return out

    @property
    def shares(self) -> dict[str, float]:
        """Of the variance of the level: from stroke to stroke, by the place, by the way from a turn, and the rest."""
        mean = self.level.mean(axis=1)
        within = self.level - mean[:, None]
        forth, back = within[self.direction > 0], within[self.direction < 0]
        there, here = forth.mean(axis=0), back.mean(axis=0)
        parts = {
            "from stroke to stroke": float(mean.var()),
            "by the place": float((0.5 * (there + here)).var()),
            "by the way from the turn": float((0.5 * (there - here)).var()),
            "by neither": float(np.concatenate([forth - there, back - here]).var()),
        }
        whole = sum(parts.values())
        return {name: value / whole for name, value in parts.items()}

    @classmethod
    def of(cls, trace: Trace) -> Strokes | None:
        """Of a run with displacement and measured force; None where no place is passed both ways.

        What gives way under the force leaves the contact behind the motion by force over stiffness: the slope of the
        force while it goes through zero.
        """
        assert trace.displacement is not None and trace.spring_force is not None
        t, x, force = trace.time, trace.displacement, trace.spring_force
        if not both_ways(force):
            return None
        count = estimate_resolution(x)
        parts = [s for s in stretches(t, x, noise_level(x, count), count) if s.moving]
        longest = max((abs(s.way) for s in parts), default=0.0)
        own = [slice(s.first, s.last) for s in parts if abs(s.way) > WHOLE * longest]
        stiffness = _stiffness(x, force, own)
        if stiffness <= 0.0:
            return None
        slid, gone = x - force / stiffness, np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
        ways = np.array([np.sign(x[s.stop - 1] - x[s.start]) for s in own])
        # along the stroke, and never back
        along = [np.maximum.accumulate(d * slid[s]) for s, d in zip(own, ways, strict=True)]
        reach = np.array([[at[0] + KNEE * (at[-1] - at[0]), at[-1]] for at in along])
        reach = np.sort(reach * ways[:, None], axis=1)
        low, high = float(np.quantile(reach[:, 0], 1.0 - LEFT_OUT)), float(np.quantile(reach[:, 1], LEFT_OUT))
        kept = np.flatnonzero((reach[:, 0] <= low) & (reach[:, 1] >= high))
        if low >= high or np.unique(ways[kept]).size < 2:
            return None
        place = np.linspace(low, high, PLACES)
        rows = []
        for i in kept:
            s, d = own[i], ways[i]
            passed = np.interp(d * np.append(place, 0.5 * (low + high)), along[i], np.arange(along[i].size))
            rows.append([np.interp(passed, np.arange(along[i].size), v[s]) for v in (d * force, t, gone)])
        level, time, path = (np.array(v) for v in zip(*rows, strict=True))
        level, ways = level[:, :-1], ways[kept]
        # the force's zero
        level = level - 0.5 * ways[:, None] * (level[ways > 0].mean() - level[ways < 0].mean())
        return cls(level, place, time[:, -1], path[:, -1], ways)


def _stiffness(x: Array, force: Array, strokes: list[slice]) -> float:
    """Of what gives way between motion and contact (N/m): the median slope of strokes while the force is small."""
    small = np.abs(force) < LOADED * np.quantile(np.abs(force), 0.95)
    own = [s for s in strokes if small[s].sum() > 2 and np.ptp(x[s][small[s]]) > 0.0]
    return float(np.median([np.polyfit(x[s][small[s]], force[s][small[s]], 1)[0] for s in own])) if own else 0.0
