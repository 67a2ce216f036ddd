"""The load point's position against time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..system.units import shown
from .read_only import Rebuilt, read_only
from .resolution import noise_level

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Drive(Rebuilt):
    """The load point's position against time, piecewise linear.

    Args:
        times: breakpoints, s, shape (k,), k >= 2, strictly increasing.
        positions: load-point positions there, m, shape (k,).

    Beyond its ends the drive goes on with the velocity of its first and last piece.

    Raises:
        InputError: fewer than two times, other than as many positions, times that do not increase, values that are not
            finite.

    Examples:
        A drive that is halted for a second:

        >>> from stickslip.data.drive import Drive
        >>> drive = Drive.from_pieces([4.0, 5.0, 9.0], [50e-6, 0.0, 50e-6])
        >>> drive
        Drive(from 0 s: 50 µm/s until 4 s, 0 m/s until 5 s, 50 µm/s until 9 s)
        >>> drive.holds(0.0, 9.0)
        [(4.0, 5.0)]
        >>> round(float(drive.position(7.0)), 9)  # m
        0.0003
    """

    times: Array
    positions: Array

    def __post_init__(self) -> None:
        times, positions = read_only(self.times, "drive times"), read_only(self.positions, "drive positions")
        if times.size < 2 or times.shape != positions.shape:
            what = "a drive needs at least two times and as many positions"
            raise InputError(what, value=(times.size, positions.size))
        if not (np.all(np.isfinite(times)) and np.all(np.isfinite(positions)) and np.all(np.diff(times) > 0)):
            raise InputError("the times of a drive must be finite and increase", hint="check the drive's 'until' times")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", positions)

    def __repr__(self) -> str:
        ends, speeds = self.times[1:].tolist(), self.velocities.tolist()
        pieces = [f"{shown(v, 'm/s')} until {shown(end, 's')}" for v, end in zip(speeds[:5], ends[:5], strict=True)]
        if len(ends) > len(pieces):
            pieces.append(f"... {len(ends)} pieces until {shown(ends[-1], 's')}")
        return f"{type(self).__name__}(from {shown(float(self.times[0]), 's')}: {', '.join(pieces)})"

    @classmethod
    def constant(cls, velocity: float, start: float = 0.0, stop: float | None = None) -> Drive:
        """A drive at one velocity (m/s), at position zero at ``start`` (s)."""
        end = start + 1.0 if stop is None or stop <= start else stop
        return cls(np.array([start, end]), np.array([0.0, velocity * (end - start)]))

    @classmethod
    def from_pieces(cls, until: ArrayLike, velocities: ArrayLike, start: float = 0.0) -> Drive:
        """A drive of constant velocities (m/s), each lasting until a time (s), at position zero at ``start``."""
        ends, speeds = np.asarray(until, float), np.asarray(velocities, float)
        if ends.shape != speeds.shape or ends.ndim != 1 or ends.size == 0:
            raise InputError("every piece of a drive needs one end time and one velocity")
        times = np.concatenate([[start], ends])
        if not np.all(np.diff(times) > 0):
            raise InputError("the times of a drive must be finite and increase", hint="check the drive's 'until' times")
        return cls(times, np.concatenate([[0.0], np.cumsum(speeds * np.diff(times))]))

    @classmethod
    def from_samples(cls, time: ArrayLike, position: ArrayLike, tolerance: float) -> Drive:
        """Few straight pieces that stay within about ``tolerance`` (m) of sampled positions (never beyond its double).

        The "swinging door" of process historians: a piece is stretched as long as one slope serves all its
        samples, so a million samples of steady drive become one piece while ripple above the tolerance stays. Each
        piece ends at the mean of a few samples: one that ended at the tolerance's edge would make the next one short.
        """
        t, y = np.asarray(time, float), np.asarray(position, float)
        knots, values, n = [0], [float(y[0])], t.size
        while knots[-1] < n - 1:
            i = knots[-1]
            stop = _reach(t, y, i, values[-1], tolerance)
            near = min(3, stop - i - 1, n - 1 - stop)
            value = float(y[stop - near : stop + near + 1].mean())
            knots.append(stop)
            values.append(min(max(value, float(y[stop]) - tolerance), float(y[stop]) + tolerance))
        return cls(t[knots], np.array(values))

    @classmethod
    def sampled(
        cls, time: ArrayLike, position: ArrayLike, resolution: float = 0.0, noise: float | None = None
    ) -> Drive:
        """A drive from measured positions (m), straight within a few counts and what their noise (m) makes."""
        values = np.asarray(position, float)
        level = noise_level(values, resolution or None) if noise is None else noise
        return cls.from_samples(time, values, max(1.5 * resolution, 4 * level, 1e-9 * float(np.ptp(values)), 1e-15))

    @property
    def velocities(self) -> Array:
        """Velocity of each piece, m/s, shape (k - 1,)."""
        return np.diff(self.positions) / np.diff(self.times)

    def _piece(self, time: ArrayLike) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, self.times.size - 2)

    def velocity(self, time: ArrayLike) -> Array:
        """Load-point velocity, m/s, same shape as ``time``; at a breakpoint that of the piece it opens."""
        return self.velocities[self._piece(time)]

    def position(self, time: ArrayLike) -> Array:
        """Load-point position, m, same shape as ``time`` (s)."""
        t = np.asarray(time, float)
        if self.times.size == 2:  # one piece: no search through millions of samples
            speed = (self.positions[1] - self.positions[0]) / (self.times[1] - self.times[0])
            return np.asarray(self.positions[0] + speed * (t - self.times[0]))
        piece = self._piece(t)
        return self.positions[piece] + self.velocities[piece] * (t - self.times[piece])

    @property
    def breakpoints(self) -> Array:
        """Times (s) where the velocity changes, the two ends left out."""
        return self.times[1:-1]

    @property
    def speed(self) -> float:
        """Median over time of the speeds at which the drive moves, its holds left out, m/s."""
        lengths, speeds = np.diff(self.times), np.abs(self.velocities)
        moving = speeds > 0.05 * speeds.max(initial=0.0)
        if not moving.any():
            return 0.0
        order = np.argsort(speeds[moving])
        weight = np.cumsum(lengths[moving][order])
        return float(speeds[moving][order][np.searchsorted(weight, 0.5 * weight[-1])])

    def speeds(self, apart: float, share: float = 0.05) -> list[float]:
        """The speeds at which the drive moves for a share of the time that it moves (m/s), the least first.

        Args:
            apart: pieces whose speeds are closer than this factor count as one speed, their mean over time.
            share: of the time.
        """
        lengths, speeds = np.diff(self.times), np.abs(self.velocities)
        moving = np.flatnonzero(speeds > 0.05 * self.speed)
        moving = moving[np.argsort(speeds[moving])]
        edges = np.flatnonzero(speeds[moving][1:] > apart * speeds[moving][:-1]) + 1
        groups = [g for g in np.split(moving, edges) if lengths[g].sum() > share * lengths[moving].sum()]
        return [float(np.average(speeds[g], weights=lengths[g])) for g in groups]

    def holds(self, start: float, stop: float, fraction: float = 0.05) -> list[tuple[float, float]]:
        """Stretches (s, s) within [start, stop] where the drive is slower than ``fraction`` of its usual speed."""
        limit = fraction * self.speed
        if limit == 0:
            return [(start, stop)]
        slow = np.abs(self.velocities) < limit
        edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]]).astype(np.int8)))
        found = []
        for first, last in edges.reshape(-1, 2):
            a = start if first == 0 else max(start, self.times[first])
            b = stop if last == slow.size else min(stop, self.times[last])
            if b > a:
                found.append((float(a), float(b)))
        return found


def _reach(t: Array, y: Array, i: int, anchor: float, tolerance: float) -> int:
    """Last index that one line from ``anchor`` at sample ``i`` reaches within the tolerance."""
    low, high, j, chunk = -np.inf, np.inf, i + 1, 64
    while j < t.size:
        part = slice(j, min(j + chunk, t.size))
        dt = t[part] - t[i]
        lows = np.maximum.accumulate(np.maximum((y[part] - tolerance - anchor) / dt, low))
        highs = np.minimum.accumulate(np.minimum((y[part] + tolerance - anchor) / dt, high))
        bad = np.flatnonzero(lows > highs)
        if bad.size:
            return max(j + int(bad[0]) - 1, i + 1)
        low, high, j, chunk = float(lows[-1]), float(highs[-1]), part.stop, min(2 * chunk, 1 << 20)
    return t.size - 1
