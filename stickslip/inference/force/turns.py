"""Turning points of the measured motion as knots of their own, where the block stands for a moment.

A law of the velocity is at its strongest change there: what slid with a cap that follows the velocity lets go of it at
rest, and unloads from there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]
Index = NDArray[np.intp]
NEAR = 1e-6  # of a step


@dataclass(frozen=True)
class Turns:
    """Where turning points come in between knots.

    Attributes:
        before: knots (of those without) that a turning point follows.
        share: of the time to the next knot at which it comes, by a constant deceleration.
        ahead: how far it lies beyond the knot before (m).
        place: where each of the knots comes to lie among all.
        source: of all, the knot (of those without) whose event it shares: its own, or the one after the turn.
    """

    before: Index
    share: Array
    ahead: Array
    place: Index
    source: Index

    @classmethod
    def of(cls, t: Array, x: Array, v: Array, slow: NDArray[np.bool_]) -> Turns:
        """Between two knots that are samples (not ``slow``) and whose velocities have two signs; shape (n,) each."""
        both = ~slow[:-1] & ~slow[1:]
        along = v[:-1] / np.where(v[:-1] == v[1:], 1.0, v[:-1] - v[1:])
        # at a knot itself there is no room for another
        before = np.flatnonzero(both & (v[:-1] * v[1:] < 0.0) & (along > NEAR) & (along < 1.0 - NEAR))
        first, second = v[before], v[before + 1]
        share = first / (first - second)
        ahead = 0.5 * share * np.diff(t)[before] * first
        place = np.arange(t.size) + np.searchsorted(before, np.arange(t.size), side="left")
        source = np.zeros(t.size + before.size, int)
        source[place] = np.arange(t.size)
        source[place[before] + 1] = before + 1
        return cls(before, share, ahead, place, source)

    @property
    def size(self) -> int:
        """Number of all knots."""
        return self.source.size

    def at(self, t: Array, x: Array, d: Array) -> tuple[Array, Array, Array, Array]:
        """Time (s), displacement (m), velocity (zero) and load point (m) of the turning points."""
        b = self.before
        return (
            t[b] + self.share * (t[b + 1] - t[b]), x[b] + self.ahead, np.zeros(b.size),
            d[b] + self.share * (d[b + 1] - d[b]),
        )  # fmt: skip

    def joined(self, values: Array, own: Array) -> Array:
        """Values at the knots, with those of the turning points in between."""
        out = np.zeros(self.size)
        out[self.place] = values
        out[self.place[self.before] + 1] = own
        return out

    def rows(self, matrix: csr_array) -> csr_array:
        """Rows of a matrix, with those of the turning points, which lie between the two beside them."""
        mixed = self.place[self.before] + 1
        rows = np.concatenate([self.place, mixed, mixed])
        columns = np.concatenate([np.arange(self.place.size), self.before, self.before + 1])
        weights = np.concatenate([np.ones(self.place.size), 1.0 - self.share, self.share])
        return csr_array((weights, (rows, columns)), shape=(self.size, self.place.size)) @ matrix
