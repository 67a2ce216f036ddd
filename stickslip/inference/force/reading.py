"""The samples of a reading, and what an error of each does to the motion that is made of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, vstack

from ...physics.sensor.chain import FRINGE

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Reading:
    """Samples of a run, grouped where they have the same weights everywhere: the samples of a window.

    A record of 150 000 samples has some 5 000 such groups, and its covariance is found from those.

    Attributes:
        samples: the reading (m), shape (N,).
        group: of every sample, shape (N,).
        displacement: (n, g) from one sample of each group to the displacement at the knots.
        rate, acceleration: (p, g) the same for rate and acceleration at the points.
        count: samples in each group, shape (g,).
        variance: of the sum of a group's errors over that of one sample, shape (g,).
    """

    samples: Array
    group: Index
    displacement: csr_array
    rate: csr_array
    acceleration: csr_array
    count: Array
    variance: Array

    @classmethod
    def of(
        cls, samples: Array, displacement: csr_array, rate: csr_array, acceleration: csr_array,
        inflation: Array | None = None,
    ) -> Reading:  # fmt: skip
        """From matrices with a column for each sample.

        Args:
            inflation: factor on the variance of each sample by errors common to its window, shape (N,).
        """
        every = csc_array(vstack([displacement, rate, acceleration]))
        every.sort_indices()
        begins = ~_repeats(every)
        first = np.flatnonzero(begins)
        group = np.cumsum(begins) - 1
        at_knots, rate, acceleration = (csr_array(m[:, first]) for m in (displacement, rate, acceleration))
        count = np.bincount(group).astype(float)
        return cls(samples, group, at_knots, rate, acceleration, count, np.bincount(group, inflation).astype(float))

    def sums(self, values: Array) -> Array:
        """Sums over each group, shape (g, ...), of a value for each sample, shape (N, ...)."""
        starts = np.flatnonzero(np.diff(self.group, prepend=-1))
        return np.asarray(np.add.reduceat(values, starts, axis=0))

    @cached_property
    def fringe(self) -> Array:
        """What errors of 1 m that are periodic within a fringe add to the samples of each group (m), shape (g, 4).

        A fringe counter interpolates between fringes with an error periodic in half a wavelength, and about half as
        large in a quarter of it: sine and cosine of both.
        """
        phase = 2.0 * np.pi * self.samples / FRINGE
        waves = [np.sin(phase), np.cos(phase), 0.5 * np.sin(2.0 * phase), 0.5 * np.cos(2.0 * phase)]
        return self.sums(np.stack(waves, axis=1))

    def points(self, index: Index) -> Reading:
        """Some of the points."""
        return replace(self, rate=self.rate[index], acceleration=self.acceleration[index])


def _repeats(matrix: csc_array) -> NDArray[np.bool_]:
    """Whether a column is the same as the one before it."""
    counts = np.diff(matrix.indptr)
    equal = np.append(False, counts[1:] == counts[:-1])
    back = np.arange(matrix.nnz) - np.repeat(counts, counts)  # the same entry of the column before
    own = np.repeat(equal, counts)
    differs = np.zeros(matrix.nnz, bool)
    for entries in (matrix.indices, matrix.data):
        differs[own] |= entries[own] != entries[back[own]]
    column = np.repeat(np.arange(counts.size), counts)
    equal[column[differs]] = False
    return np.asarray(equal)
