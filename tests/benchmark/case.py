"""The rig of the benchmark and what counts as accurate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from tests.solve import brute_force

MASS, C_S, DAMPING = 0.09, 3000.0, 10.0  # kg, N/m, N s/m
RATIO, D_C, T_H = 0.7, 1e-6, 0.02  # 1, m, s
HELD = 2.5  # s of drive before a hold
STIFFNESS, STRENGTH = 7e5, 0.26  # of all elements together: N/m, N
TIMES, CREEP = 1e-3, 1e-9  # what is accurate enough: share of the period; m
REFERENCE = 2e-7  # s, step of the leapfrog that others are measured against
STEPS = (4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5, 1e-5, 5e-6, 2.5e-6, 1e-6, 5e-7)  # s, that the leapfrog may choose from


@dataclass(frozen=True)
class Case:
    """The rig with equally stiff elements whose caps lie evenly between 1/20 of the largest one and that.

    Attributes:
        springs: number of elements.
        duration: of the drive (s), from rest.
        velocity: of the drive (m/s).
        hold: how long (s) the load point stands still after :data:`HELD` of drive.
    """

    springs: int = 256
    duration: float = 5.0
    velocity: float = 5e-5
    hold: float = 0.0

    @property
    def drive(self) -> tuple[list[float], list[float]]:
        """Times (s) and positions (m) of the load point; the last velocity goes on."""
        if not self.hold:
            return [0.0, 1.0], [0.0, self.velocity]
        driven = np.array([0.0, HELD, HELD, HELD + 1.0])
        return list(driven + np.array([0.0, 0.0, self.hold, self.hold])), list(driven * self.velocity)

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(springs,) in N/m."""
        return np.full(self.springs, STIFFNESS / self.springs)

    @cached_property
    def cap(self) -> np.ndarray:
        """(springs,) in N."""
        spread = np.linspace(0.05, 1.0, self.springs)
        return STRENGTH * spread / spread.sum()

    @cached_property
    def grid(self) -> np.ndarray:
        """Times (s) at which traces are compared, 50 us apart and closer where the drive is faster than 0.1 mm/s."""
        n = round(self.duration / (5e-5 * min(1.0, 1e-4 / self.velocity)))
        return np.linspace(0.0, self.duration, n + 1)[1:]

    def lasting(self, events: int) -> Case:
        """The same until half-way between the arrest of the last of so many events and the next onset."""
        guess = 1.3 * self.duration * (5e-5 / self.velocity) * (events + 2) / 6
        long = replace(self, duration=float(np.ceil(guess / 1e-3) * 1e-3))
        found = events_of(long, leapfrog(long, 2.5e-5))
        end = 0.5 * (found.arrest[events - 1] + found.onset[events])
        return replace(self, duration=float(np.round(end / 1e-3) * 1e-3))


class Answer(NamedTuple):
    """A trace on the case's grid (displacement m, velocity m/s)."""

    x: np.ndarray
    v: np.ndarray


def on_grid(case: Case, t: np.ndarray, x: np.ndarray, v: np.ndarray) -> Answer:
    """From the ends of steps: cubic in the displacement, its derivative in the velocity."""
    curve = CubicHermiteSpline(t, x, v)
    return Answer(curve(case.grid), curve(case.grid, 1))


class Events(NamedTuple):
    """Times (s) of complete slips: velocity rises through a threshold, falls to zero."""

    onset: np.ndarray
    arrest: np.ndarray


class Accuracy(NamedTuple):
    """Events found; worst errors of an onset and of a recurrence over the period; worst creep error (m)."""

    events: int
    onset: float
    recurrence: float
    creep: float

    def enough(self, events: int, by: str = "onset") -> bool:
        """Whether all events are there, in time (by ``onset``; or each from the one before, by ``recurrence``)."""
        return self.events == events and getattr(self, by) <= TIMES and self.creep <= CREEP


def leapfrog(case: Case, dt: float) -> Answer:
    """By brute force with a fixed step."""
    every = max(1, round(case.grid[0] / dt))
    path = brute_force.simulate(
        case.stiffness, case.cap, duration=case.duration, mass=MASS, spring_stiffness=C_S, damping=DAMPING,
        ratio=RATIO, slip_distance=D_C, healing_time=T_H, times=case.drive[0], positions=case.drive[1], dt=dt,
        every=every,
    )  # fmt: skip
    if len(path.t) == len(case.grid):
        return Answer(path.x, path.v)
    return Answer(np.interp(case.grid, path.t, path.x), np.interp(case.grid, path.t, path.v))


def measure(case: Case, answer: Answer, reference: Answer) -> Accuracy:
    """Error against the reference; creep curves are laid on each other at each arrest, as a measured one is."""
    seen, exact = events_of(case, answer), events_of(case, reference)
    if len(seen.onset) != len(exact.onset):
        return Accuracy(len(seen.onset), np.inf, np.inf, np.inf)
    period = np.median(np.diff(exact.onset)) if len(exact.onset) > 1 else exact.onset[0]
    late = np.max(np.abs(seen.onset - exact.onset), initial=0.0) / period
    recurrence = np.max(np.abs(np.diff(seen.onset) / np.diff(exact.onset) - 1.0), initial=0.0)
    creep, grid = 0.0, case.grid
    for i, onset in enumerate(exact.onset):
        start, own = (exact.arrest[i - 1], seen.arrest[i - 1]) if i else (0.0, 0.0)
        first, last = np.searchsorted(grid, (start, onset))
        # until the block moves at a fiftieth of the drive's velocity
        slow = grid[first + np.flatnonzero(reference.v[first:last] < 0.02 * case.velocity)[-1]]
        t = np.linspace(0.0, slow - start, 4000)
        gap = np.interp(own + t, grid, answer.x) - np.interp(start + t, grid, reference.x)
        settled = (t > 0.2 * t[-1]) & (t < 0.4 * t[-1])
        creep = max(creep, float(np.max(np.abs(gap - (gap[settled].mean() if i else 0.0)))))
    return Accuracy(len(seen.onset), float(late), float(recurrence), creep)


def events_of(case: Case, answer: Answer) -> Events:
    """Slips, onset at 0.5 mm/s (fast drives: at twice the drive's velocity)."""
    v, threshold = answer.v, max(5e-4, 2.0 * case.velocity)
    rises = np.flatnonzero((v[1:] > threshold) & (v[:-1] <= threshold)) + 1
    falls = np.flatnonzero((v[1:] <= 0.0) & (v[:-1] > 0.0)) + 1
    found, now = [], 0
    while (i := np.searchsorted(rises, now)) < rises.size and (j := np.searchsorted(falls, rises[i])) < falls.size:
        found.append((_cross(case, v, rises[i], threshold), _cross(case, v, falls[j], 0.0)))
        now = falls[j]
    return Events(*np.array(found).reshape(-1, 2).T)


def _cross(case: Case, v: np.ndarray, i: int, level: float) -> float:
    t = case.grid
    return float(t[i - 1] + (t[i] - t[i - 1]) * (level - v[i - 1]) / (v[i] - v[i - 1]))
