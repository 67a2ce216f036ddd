"""Slip events of a computed trajectory, from the true motion.

A slip begins when the block outruns the load point, so that the spring's force falls, and ends when it no longer does:
between, the spring gives back. Ringing outruns the load point as well, but hardly unloads the spring.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..solve import Steps, Trajectory
from .drive import Motion

LEAST_DROP = 0.01  # of the full friction force; ringing of the contact drops the spring by a thousandth of it
LEAST_PEAK = 2.0  # times the drive's speed; what free sliding after a start from rest reaches at most


class Events(NamedTuple):
    """One entry for each slip, shape (n,).

    Fields:
        onset, arrest: when the spring's force begins and ceases to fall (s), on the solver's dense output.
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
        onset, arrest = (_zero(s, pull[i - 1] * speed[i - 1 : i + 1], i) for i in (first, after))
        begin, end = np.interp([onset, arrest], s.t, force)
        peak = _peak(s, first, after, float(pull[first]))
        if begin - end > LEAST_DROP * strength and peak > LEAST_PEAK * speed[first]:
            found.append(Slip(onset, arrest, peak, float(pull[first])))
    return found


def _velocity(s: Steps, i: int) -> np.ndarray:
    """Velocity in the step that ends at index ``i``: a polynomial in the share of the step, highest power first.

    It is the derivative of the solver's own cubic for the displacement.
    """
    mean = (s.x[i] - s.x[i - 1]) / (s.t[i] - s.t[i - 1])
    v0, v1 = s.v[i - 1], s.v[i]
    return np.array([3.0 * (v0 + v1 - 2.0 * mean), 6.0 * mean - 4.0 * v0 - 2.0 * v1, v0])


def _zero(s: Steps, level: np.ndarray, i: int) -> float:
    """Time at which the velocity goes through a level (m/s, at both ends of the step) just before index ``i``."""
    a, b, c = _velocity(s, i) - [0.0, level[1] - level[0], level[0]]
    root = np.sqrt(max(b * b - 4.0 * a * c, 0.0))
    # the ends differ in sign, so one of the two lies within the step; both without cancellation
    far = -0.5 * (b + np.copysign(root, b))
    shares = [share for share in (far / a if a else np.inf, c / far if far else np.inf) if 0.0 <= share <= 1.0]
    share = shares[0] if shares else c / (c - (a + b + c))
    return float(s.t[i - 1] + share * (s.t[i] - s.t[i - 1]))


def _peak(s: Steps, first: int, after: int, pull: float) -> float:
    """Largest velocity of a slip in the direction of the pull, between the steps as well (m/s)."""
    top = first + int(np.argmax(s.v[first:after] * pull))
    best = float(s.v[top] * pull)
    for i in (top, top + 1):
        a, b, c = pull * _velocity(s, i)
        share = -0.5 * b / a if a < 0.0 else -1.0
        if 0.0 < share < 1.0:
            best = max(best, float(c + 0.5 * b * share))
    return best


def _settled(trajectory: Trajectory, begin: float, end: float, rings: bool) -> float:
    """Displacement at a stick's start (m): a line through 2 to 20 % of it, drawn back, which averages ringing out."""
    if not rings:
        return float(trajectory.at(np.array([begin])).x[0])
    t = np.linspace(begin + 0.02 * (end - begin), begin + 0.2 * (end - begin), 2000)
    x = trajectory.at(t).x
    level = np.polyfit(t - begin, x - x[0], 1)[1]
    return float(x[0] + level)
