"""How far the block travels over whole cycles for each metre of its load point, in one run.

The spring is as long at one slip as at the next, so over whole cycles the block goes as far as the load point does. The
middle of onset and arrest is taken: there the spring holds the friction of the sliding block, which hardly varies where
the strength at the onset does (new asperities, a hold), for a slip that begins higher ends lower.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..drive import Drive
from ..segment import Event, Segmentation, block_motion
from ..trace import Trace

Array = NDArray[np.float64]
FEWEST = 3  # slips that make a slope with an error
TREND = 0.04  # of a slip: how far the spring's length at the slips may trend over a run without anything being wrong
DEEP = 6.0  # lengths of the spring at the onset, in slips: a trend of the slips tells one of the friction's level
DRIFT = 5e-8  # m/s that a sensor may drift, which is physics
_CLOCKS = np.geomspace(0.6, 1.6, 393)  # factors on the file's time that are tried, 0.25 % apart
_BETTER = 3.0  # factor by which another clock must bring slips and drive together


@dataclass(frozen=True)
class Travel:
    """Of one run.

    Attributes:
        slope: travel of the block over travel of the load point (1).
        scatter: standard deviation of the slope from the slips' own scatter.
        allowance: standard deviation of the slope from what friction and sensor may do over a run.
        trend: growth of the slips for each metre of travel, as far as chance does not explain it (1).
        clock: factor on the file's times that makes the slips fit the pieces of the drive, 1 where the file's own time
            does; None where it has one piece only, which fits any clock.
        block: mean velocity of the block from slip to slip (m/s). drive: the same of the load point.
        release: by how much a slip shortens the spring (m, median).
        duration: release over peak velocity relative to the load point (s, median): of the slip, whatever its size.
        speed: of the drive at the slips (m/s, median).
        slips: how many were used.
    """

    slope: float
    scatter: float
    allowance: float
    trend: float
    clock: float | None
    block: float
    drive: float
    release: float
    duration: float
    speed: float
    slips: int

    @property
    def std(self) -> float:
        """Standard deviation of the slope where all slips are equal."""
        return float(np.hypot(self.scatter, self.allowance))

    def trend_std(self, trend: float) -> float:
        """Standard deviation of the slope from friction whose level changes, where that of others has a ``trend``."""
        return DEEP * abs(self.trend - trend)


def travel(trace: Trace, found: Segmentation) -> Travel | None:
    """Travel of the block against its load point, or None: too few slips, no drive, or a record of force alone."""
    if trace.drive is None or trace.leading == "spring_force" or len(found.events) < FEWEST:
        return None
    # the first slip of a contact never loaded is not like the others
    events = found.events[1:] if trace.virgin and len(found.events) > FEWEST else found.events
    x = np.array([(e.x_onset, e.x_arrest) for e in events])
    t = np.array([(e.t_onset, e.t_arrest) for e in events])
    drive, noise = trace.drive, found.settings.noise
    seen = _slope(drive, t, x, noise)
    if seen is None:
        return None
    clock = None
    if drive.times.size > 2:
        clock, seen = _clocked(drive, t, x, noise, seen)
    way = drive.position(t)
    release, speed = _releases(trace, found, events), np.abs(drive.velocity(np.array([e.t_peak for e in events])))
    relative = np.array([e.peak_velocity for e in events]) - speed
    lasts = release / np.where(relative > 0, relative, np.nan)
    slope, scatter, span = seen
    allowance = abs(slope) * np.hypot(TREND * float(np.mean(release)) / (span * abs(slope)), _drift(drive, t))
    ends = t.mean(axis=1)[[0, -1]]
    block, went = (float(np.diff(v.mean(axis=1)[[0, -1]])[0] / np.ptp(ends)) for v in (x, way))
    return Travel(
        slope, scatter, float(allowance), _trend(release, way.mean(axis=1)), clock, block, went,
        float(np.median(release)), _middle(lasts), float(np.median(speed)), len(events),
    )  # fmt: skip


def _releases(trace: Trace, found: Segmentation, events: Sequence[Event]) -> Array:
    """By how much each slip shortens the spring (m): from its longest to its shortest, whatever counts as an onset."""
    position, drive, _, _ = block_motion(trace)
    assert drive is not None
    step = 1.0 / trace.sampling_rate
    few = max(1, round(found.settings.window / step / 3))  # samples of a mean, against noise
    out = []
    for event in events:
        around = 0.5 * event.duration + few * step
        low, high = np.searchsorted(trace.time, [event.t_onset - around, event.t_arrest + around])
        length = event.direction * (drive.position(trace.time[low:high]) - position[low:high])
        means = np.convolve(length, np.full(few, 1.0 / few), mode="valid") if length.size > few else length
        top = int(np.argmax(means[: max(means.size // 2, 1)]))
        out.append(float(means[top] - means[top:].min()))
    return np.array(out)


def _drift(drive: Drive, t: Array) -> float:
    """What a drift of the sensor adds to the slope: its way over that of the load point."""
    went = float(np.sum(np.abs(np.diff(drive.position(np.linspace(t[0, 0], t[-1, 1], 400))))))
    return DRIFT * float(t[-1, 1] - t[0, 0]) / went if went > 0 else np.inf


def _middle(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else float("nan")


def _slope(drive: Drive, t: Array, x: Array, noise: float) -> tuple[float, float, float] | None:
    """Slope of the slips' middles on the load point, its standard deviation, and the load point's travel (m).

    Where the drive turns, the spring pulls the other way and its length counts with the slip's direction. One slip far
    off the others (a jump of the sensor) is not used.
    """
    from scipy.special import stdtrit  # a tenth of a second that reading a campaign does not need

    middle, way = x.mean(axis=1), drive.position(t).mean(axis=1)
    turn = np.sign(x[:, 1] - x[:, 0])
    use = np.ones(middle.size, bool)
    while True:
        columns = [np.ones(middle.size), *([turn] if np.ptp(turn[use]) else []), way - way[use].mean()]
        a = np.stack(columns, axis=1)
        free = int(use.sum()) - a.shape[1]
        span = float(np.ptp(way[use]))
        if free < 1 or span == 0.0 or np.linalg.matrix_rank(a[use]) < a.shape[1]:
            return None
        found = np.linalg.lstsq(a[use], middle[use], rcond=None)[0]
        rest = middle - a @ found
        far = int(np.argmax(np.abs(rest) * use))
        others = use & (np.arange(use.size) != far)
        usual = 1.4826 * float(np.median(np.abs(rest[others])))
        if use.all() and free > 4 and abs(rest[far]) > 10.0 * max(usual, noise):
            use = others
            continue
        level = max(float(np.sqrt(np.sum(rest[use] ** 2) / free)), noise)
        inverse = np.linalg.inv(a[use].T @ a[use])
        # few slips know their own scatter badly
        std = level * float(np.sqrt(inverse[-1, -1])) * float(stdtrit(free, 0.8413))
        return float(found[-1]), std, span


def _clocked(
    drive: Drive, t: Array, x: Array, noise: float, seen: tuple[float, float, float]
) -> tuple[float, tuple[float, float, float]]:
    """The clock with which slips and pieces of the drive go together, and the slope by it."""
    start = drive.times[0]
    tried = [(c, _slope(drive, start + c * (t - start), x, noise)) for c in _CLOCKS]
    known = [(c, found) for c, found in tried if found is not None and found[0] != 0.0]
    if not known:
        return 1.0, seen
    clock, best = min(known, key=lambda item: item[1][1] / abs(item[1][0]))
    better = best[1] / abs(best[0]) < seen[1] / abs(seen[0]) / _BETTER
    return (float(clock), best) if better and abs(clock - 1.0) > 0.006 else (1.0, seen)


def _trend(release: Array, way: Array) -> float:
    """How much larger slips become for each metre of travel, as far as their scatter does not explain it."""
    if release.size < 5 or np.ptp(way) == 0.0:
        return 0.0
    a = np.stack([np.ones(way.size), way - way.mean()], axis=1)
    found = np.linalg.lstsq(a, release, rcond=None)[0]
    level = np.sqrt(np.sum((release - a @ found) ** 2) / (way.size - 2))
    chance = 2.0 * float(level * np.sqrt(np.linalg.inv(a.T @ a)[1, 1]))
    return float(np.sign(found[1])) * max(abs(float(found[1])) - chance, 0.0)
