"""The rig of the benchmark and what counts as accurate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tests.solve import brute_force
from tests.solve.rig import Slips, slips

SPRINGS = 256
DURATION, MASS, C_S, DAMPING, VELOCITY = 5.0, 0.09, 3000.0, 10.0, 5e-5  # s, kg, N/m, N s/m, m/s
RATIO, D_C, T_H = 0.7, 1e-6, 0.02  # 1, m, s
STIFFNESS = np.full(SPRINGS, 7e5 / SPRINGS)  # N/m
_SPREAD = np.linspace(0.05, 1.0, SPRINGS)
CAP = 0.26 * _SPREAD / _SPREAD.sum()  # N
RECURRENCE, CREEP = 1e-3, 1e-9  # share of the period; m
GRID = np.linspace(0.0, DURATION, 100_001)[1:]  # s; where traces are compared, 50 us apart


class Answer(NamedTuple):
    """A trace on GRID (displacement m, velocity m/s)."""

    x: np.ndarray
    v: np.ndarray


class Accuracy(NamedTuple):
    """Events found; worst recurrence error over the period; worst creep error (m)."""

    events: int
    recurrence: float
    creep: float

    def enough(self, events: int) -> bool:
        return self.events == events and self.recurrence <= RECURRENCE and self.creep <= CREEP


def leapfrog(dt: float) -> Answer:
    """By brute force with a fixed step."""
    every = max(1, round(GRID[0] / dt))
    path = brute_force.simulate(
        STIFFNESS, CAP, duration=DURATION, mass=MASS, spring_stiffness=C_S, damping=DAMPING, ratio=RATIO,
        slip_distance=D_C, healing_time=T_H, times=[0.0, 1.0], positions=[0.0, VELOCITY], dt=dt, every=every,
    )  # fmt: skip
    if len(path.t) == len(GRID):
        return Answer(path.x, path.v)
    return Answer(np.interp(GRID, path.t, path.x), np.interp(GRID, path.t, path.v))


def measure(answer: Answer, reference: Answer) -> Accuracy:
    """Error against the reference; creep curves are laid on each other at each arrest, as a measured one is."""
    seen, exact = _events(answer), _events(reference)
    if len(seen.onset) != len(exact.onset):
        return Accuracy(len(seen.onset), np.inf, np.inf)
    recurrence = np.max(np.abs(seen.recurrence / exact.recurrence - 1.0))
    creep = 0.0
    for i, onset in enumerate(exact.onset):
        start, own = (exact.arrest[i - 1], seen.arrest[i - 1]) if i else (0.0, 0.0)
        slow = GRID[(onset > GRID) & (reference.v < 1e-6)][-1]
        t = np.linspace(0.0, slow - start, 4000)
        gap = np.interp(own + t, GRID, answer.x) - np.interp(start + t, GRID, reference.x)
        settled = (t > 0.2 * t[-1]) & (t < 0.4 * t[-1])
        creep = max(creep, float(np.max(np.abs(gap - (gap[settled].mean() if i else 0.0)))))
    return Accuracy(len(seen.onset), float(recurrence), creep)


def _events(answer: Answer) -> Slips:
    return slips(GRID, answer.x, answer.v)
