"""Knots between two others: where the block turns, and where it comes to rest after a slip.

A law of the velocity changes most where the block stands. What slid with a cap that follows the velocity lets go of it
at rest and unloads from there. What it holds then is decided while the velocity falls to zero, within a few samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.sparse import csr_array

from .later_ringing import Turns

Array = NDArray[np.float64]
Index = NDArray[np.intp]
NEAR = 1e-6  # of a step
LAST = 0.25  # of a period of the ringing, in which a slip comes to rest
FINE = 100  # knots of a period there


@dataclass(frozen=True)
class Inserted:
    """Knots that come in between others.

    Attributes:
        before: knots (of those without) that they follow, in order.
        share: of the time to the next knot at which they come.
        x, v: displacement (m) and velocity (m/s) there.
        place: where each of the knots comes to lie among all.
        source: of all, the knot (of those without) whose event it shares: its own, or the next one.
    """

    before: Index
    share: Array
    x: Array
    v: Array
    place: Index
    source: Index

    @classmethod
    def of(
        cls, t: Array, x: Array, v: Array, slow: NDArray[np.bool_], arrests: Array, period: float, turns: Turns
    ) -> Inserted:
        """Between knots that are samples (not ``slow``), and where the block goes on to ring between the others.

        Where the velocity has two signs the block stands between them, by a constant deceleration. The last quarter of
        a period before the first such place at or after an arrest (or before the arrest, where the block does not go
        back) is followed in hundredths of a period, by the cubic through displacements and velocities.

        Args:
            t, x, v: time (s), displacement (m) and velocity (m/s) of the knots, shape (n,).
            slow: whether they are means over windows.
            arrests: of the events (s).
            period: of the ringing, or the time within which a slip comes to rest (s).
            turns: where the block goes on to ring after the last sample that is followed.
        """
        both = ~slow[:-1] & ~slow[1:]
        along = v[:-1] / np.where(v[:-1] == v[1:], 1.0, v[:-1] - v[1:])
        # at a knot itself there is no room for another
        turning = np.flatnonzero(both & (v[:-1] * v[1:] < 0.0) & (along > NEAR) & (along < 1.0 - NEAR))
        stands = t[turning] + along[turning] * np.diff(t)[turning]
        found = [
            (turning, along[turning], x[turning] + 0.5 * (stands - t[turning]) * v[turning], np.zeros(turning.size)),
            turns.knots(t, x, slow, period),
        ]
        for arrest in arrests:
            later = np.flatnonzero((stands >= arrest - LAST * period) & (stands <= arrest + LAST * period))
            rest = float(stands[later[0]]) if later.size else float(arrest)
            for i in np.flatnonzero(both & (t[1:] > rest - LAST * period) & (t[:-1] < rest)):
                end = min(float(t[i + 1]), rest)
                parts = int(np.ceil((end - t[i]) * FINE / period))
                at = t[i] + (end - t[i]) * np.arange(1, parts) / parts
                if later.size and i == turning[later[0]]:
                    speed = v[i] * (1.0 - (at - t[i]) / (end - t[i]))
                    way = x[i] + 0.5 * (v[i] + speed) * (at - t[i])
                else:
                    curve = CubicHermiteSpline(t[i : i + 2], x[i : i + 2], v[i : i + 2])
                    way, speed = curve(at), curve(at, 1)
                found.append((np.full(at.size, i), (at - t[i]) / (t[i + 1] - t[i]), way, speed))
        before, share, way, speed = (np.concatenate(parts) for parts in zip(*found, strict=True))
        order = np.lexsort((share, before))
        before = before[order].astype(int)
        place = np.arange(t.size) + np.searchsorted(before, np.arange(t.size), side="left")
        source = np.zeros(t.size + before.size, int)
        source[place] = np.arange(t.size)
        source[before + 1 + np.arange(before.size)] = before + 1
        return cls(before, share[order], way[order], speed[order], place, source)

    @property
    def size(self) -> int:
        """Number of all knots."""
        return self.source.size

    def between(self, values: Array) -> Array:
        """Values at the knots that come in, on a line between those beside them, shape (m,)."""
        b = self.before
        return np.asarray(values[b] + self.share * (values[b + 1] - values[b]))

    def joined(self, values: Array, own: Array) -> Array:
        """Values at the knots, with those of the others in between."""
        out = np.zeros(self.size)
        out[self.place] = values
        out[self.before + 1 + np.arange(self.before.size)] = own
        return out

    def rows(self, matrix: csr_array) -> csr_array:
        """Rows of a matrix, with those of the knots that come in, which lie between the two beside them."""
        own = self.before + 1 + np.arange(self.before.size)
        rows = np.concatenate([self.place, own, own])
        columns = np.concatenate([np.arange(self.place.size), self.before, self.before + 1])
        weights = np.concatenate([np.ones(self.place.size), 1.0 - self.share, self.share])
        return csr_array((weights, (rows, columns)), shape=(self.size, self.place.size)) @ matrix
