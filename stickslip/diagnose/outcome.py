"""What a slip of a simulated experiment is like, and how well an experiment would tell it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..floors import Scatter
from ..solve import Trajectory
from .bench import Run, Slip
from .menu import Conditions, Experiment

FEATURES = ("recurrence", "size", "peak", "creep", "frequency", "hold")


class Outcome(NamedTuple):
    """What the last slip of an experiment is like, SI.

    Attributes:
        recurrence: time from the half of the slip before, or from the start, to its half (s).
        size: of the slip (m).
        peak: largest velocity of the reading (m/s).
        creep: from the slip before, or the start, until shortly before the slip (m).
        frequency: of the ringing after it (Hz).
        hold: creep while the drive is held (m).
        duration: of the slip (s).
        approach: velocity of the creep at its end (m/s).
    """

    recurrence: float
    size: float
    peak: float
    creep: float
    frequency: float
    hold: float
    duration: float
    approach: float


def outcome(run: Run, slips: list[Slip], number: int, period: float, hold: tuple[float, float] | None) -> Outcome:
    """What the slip with this number (from 0) is like.

    Args:
        run: the integration.
        slips: all of them.
        number: of the slip.
        period: of the contact resonance (s).
        hold: when the drive was held (s, s).
    """
    whole, slip = run.trajectory, slips[number]
    before = slips[number - 1] if number > 0 else None
    duration = slip.arrest - slip.onset
    shortest = max(0.13 * duration, 2.0 * period)
    stick = slip.onset - (before.arrest if before is not None else 0.0)

    def read(times: np.ndarray) -> np.ndarray:
        return np.asarray(whole.at(times).reading)

    def level(after: Slip) -> float:
        """Of the reading after a slip (m), the ringing averaged out."""
        begin, length = min(2.5 * duration, 0.25 * stick), min(0.7 * duration, 0.15 * stick)
        return float(np.mean(read(after.arrest + np.linspace(begin, begin + length, 400))))

    def half(of: Slip) -> float:
        t = np.linspace(of.onset, of.arrest, 800)
        x = np.maximum.accumulate(read(t))
        return float(np.interp(0.5 * (x[0] + x[-1]), x, t))

    end = slip.onset - shortest
    last, earlier = read(np.array([end, end - 0.25 * shortest]))
    rest = float(read(np.array([run.stops[0] if run.stops else 0.0]))[0]) if before is None else level(before)
    t = np.linspace(slip.onset, slip.arrest, 800)
    x = read(t)
    crept = math.nan
    if hold is not None and slip.onset > hold[1]:
        first, second = read(np.array(hold))
        crept = float(second - first)
    return Outcome(
        half(slip) - (0.0 if before is None else half(before)),
        level(slip) - float(x[0]),
        float(np.max(np.gradient(x, t))),
        float(last - rest) if stick > 2.0 * shortest else math.nan,
        _frequency(whole, slip.arrest, period),
        crept,
        duration,
        float(last - earlier) / (0.25 * shortest),
    )


def _frequency(whole: Trajectory, arrest: float, period: float) -> float:
    """Of the ringing after an arrest (Hz), from the zeros of the block's velocity; nan where it hardly rings."""
    t = np.linspace(arrest, arrest + 9.0 * period, 1200)
    v = np.asarray(whole.at(t).v)
    v = v - np.mean(v)
    up = np.flatnonzero((v[:-1] < 0.0) & (v[1:] >= 0.0))
    if up.size < 3:
        return math.nan
    zeros = t[up] - v[up] * (t[up + 1] - t[up]) / (v[up + 1] - v[up])
    return float((zeros.size - 1) / (zeros[-1] - zeros[0]))


def floor_of(
    name: str, a: Outcome, b: Outcome, experiment: Experiment, conditions: Conditions, k: Scatter, factor: float
) -> float:
    """Standard deviation of a feature around a perfect model (SI), as of `stickslip.floors`."""
    size = 0.5 * (abs(getattr(a, name)) + abs(getattr(b, name)))
    noise = conditions.noise
    if name == "recurrence":
        moving = max(size - experiment.hold, 0.0)
        real, sensor = math.hypot(k.recurrence * moving, k.recurrence_periods * conditions.period), conditions.clock
    elif name == "size":
        real, sensor = k.size * size, noise
    elif name == "peak":
        # the largest slope of a slip goes as its size over its duration
        duration = 0.5 * (a.duration + b.duration)
        real, sensor = math.hypot(k.size, k.times) * size, 2.0 * noise / (0.1 * duration)
    elif name == "creep":
        clock = k.creep_clock * 0.5 * (a.approach + b.approach)
        real, sensor = math.hypot(k.creep * size, k.creep_largest * size, clock, k.resolution), noise
    elif name == "hold":
        real, sensor = math.hypot(k.hold * size, k.resolution), noise
    else:
        real, sensor = k.frequency * size, 0.0
    return math.hypot(sensor, factor * real * (k.first if experiment.first else 1.0))
