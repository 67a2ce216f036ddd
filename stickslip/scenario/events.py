"""Slip events of a computed trajectory, from the true motion.

A slip begins when the block outruns the load point, so that the spring's force falls, and ends when it no longer does:
between, the spring gives back. Ringing outruns the load point as well, but hardly unloads the spring.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..solve import Trajectory
from .drive import Motion

LEAST_DROP = 0.01  # of the full friction force; ringing of the contact drops the spring by a thousandth of it
LEAST_PEAK = 2.0  # times the drive's speed; what free sliding after a start from rest reaches at most


class Events(NamedTuple):
    """One entry for each slip, shape (n,).

    Fields:
        onset, arrest: when the spring's force begins and ceases to fall (s).
        slip: displacement between them, in the direction of the pull (m).
        peak_velocity: largest velocity between them, in that direction (m/s).
        recurrence: time since the onset before (s); nan for the first.
        creep_before_slip: displacement from the stick's start, ringing averaged out, to the onset (m).
    """

    onset: np.ndarray
    arrest: np.ndarray
    slip: np.ndarray
    peak_velocity: np.ndarray
    recurrence: np.ndarray
    creep_before_slip: np.ndarray

    @property
    def number(self) -> int:
        return int(self.onset.size)


UNITS = {"onset": "s", "arrest": "s", "slip": "m", "peak_velocity": "m/s", "recurrence": "s", "creep_before_slip": "m"}


class Slip(NamedTuple):
    """Onset and arrest (s), largest velocity in the direction of the pull (m/s), and that direction (+1 or -1)."""

    onset: float
    arrest: float
    peak: float
    sign: float


def find_events(trajectory: Trajectory, motion: Motion, strength: float) -> Events:
    """The table of all slips that are complete within the trajectory; arguments as of `find_slips`."""
    slips = find_slips(trajectory, motion, strength)
    if not slips:
        return Events(*(np.zeros(0) for _ in Events._fields))
    onset, arrest, peak, sign = np.array(slips).T
    from_, to = trajectory.at(onset).x, trajectory.at(arrest).x
    begin = np.concatenate([[trajectory.steps.t[0]], arrest[:-1]])
    rest = np.array([_settled(trajectory, a, b, i > 0) for i, (a, b) in enumerate(zip(begin, onset, strict=True))])
    recurrence = np.concatenate([[np.nan], np.diff(onset)])
    return Events(onset, arrest, (to - from_) * sign, peak, recurrence, (from_ - rest) * sign)


def find_slips(trajectory: Trajectory, motion: Motion, strength: float) -> list[Slip]:
    """Slips that are complete within the trajectory.

    Args:
        trajectory: of the solver.
        motion: of the load point.
        strength: full friction force of all contacts (N).
    """
    s = trajectory.steps
    pull = np.where(s.spring_force < 0.0, -1.0, 1.0)
    speed = np.abs(motion.velocity(s.t))
    lead = s.v * pull - speed
    ahead = np.concatenate([[False], lead > 0.0, [False]])
    edges = np.flatnonzero(ahead[1:] != ahead[:-1]).reshape(-1, 2)
    edges = edges[(edges[:, 0] > 0) & (edges[:, 1] < s.t.size)]  # neither cut off at the start nor at the end
    # ringing brings thousands of stretches; what their own samples already rule out is not looked at closely
    force = np.abs(s.spring_force)
    edges = edges[force[edges[:, 0] - 1] - force[edges[:, 1]] > 0.5 * LEAST_DROP * strength]
    found = []
    for first, after in edges:
        onset, arrest = (_zero(s.t, lead, i) for i in (first, after))
        peak = float(np.max(s.v[first:after] * pull[first:after]))
        begin, end = np.interp([onset, arrest], s.t, force)
        if begin - end > LEAST_DROP * strength and peak > LEAST_PEAK * speed[first]:
            found.append(Slip(onset, arrest, peak, float(pull[first])))
    return found


def _zero(t: np.ndarray, lead: np.ndarray, i: int) -> float:
    """Time at which ``lead`` goes through zero just before index ``i``."""
    share = lead[i - 1] / (lead[i - 1] - lead[i])
    return float(t[i - 1] + share * (t[i] - t[i - 1]))


def _settled(trajectory: Trajectory, begin: float, end: float, rings: bool) -> float:
    """Displacement at a stick's start (m): a line through 2 to 20 % of it, drawn back, which averages ringing out."""
    if not rings:
        return float(trajectory.at(np.array([begin])).x[0])
    t = np.linspace(begin + 0.02 * (end - begin), begin + 0.2 * (end - begin), 2000)
    x = trajectory.at(t).x
    level = np.polyfit(t - begin, x - x[0], 1)[1]
    return float(x[0] + level)
