"""Coarser sampling: means of so many samples, and what they leave of noise and hum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .resolution import MAINS, rounding_of_mean

Array = NDArray[np.float64]
COARSENED = "coarsened"  # what a repair of this kind is called


class Means:
    """Means of ``size`` samples each. None reaches over a gap; samples that are too few for one are left out.

    Args:
        time: of the samples (s), shape (n,).
        missing: times of the last samples before gaps (s).
        size: of a mean.
    """

    def __init__(self, time: Array, missing: Sequence[float], size: int) -> None:
        edges = [0, *np.searchsorted(time, missing, side="right").tolist(), time.size]
        self.size, self.starts = size, edges[:-1]
        self.numbers = [(stop - start) // size for start, stop in pairwise(edges)]  # between gaps

    def __len__(self) -> int:
        return sum(self.numbers)

    def __call__(self, values: Array) -> Array:
        """Means of values of the samples, shape (number of means,)."""
        parts = [
            values[a : a + self.size * n].reshape(n, self.size) for a, n in zip(self.starts, self.numbers, strict=True)
        ]
        return np.concatenate([part.mean(axis=1) for part in parts])

    @property
    def before_gaps(self) -> NDArray[np.intp]:
        """Indices of the last means before gaps."""
        last = np.unique(np.cumsum(self.numbers)) - 1
        return last[(last >= 0) & (last < len(self) - 1)]


def noise_of_mean(noise: float | None, resolution: float | None, size: int) -> tuple[float | None, bool]:
    """Noise of the mean of so many samples, and whether most of it is rounding, an error common to all of them."""
    if noise is None:
        return None, False
    whole, rounding = noise**2, 0.0
    if resolution:
        spread = math.sqrt(max(whole - resolution**2 / 12.0, 0.0))
        rounding = min(float(rounding_of_mean(np.zeros(()), resolution, spread)), whole)
    return math.sqrt((whole - rounding) / size + rounding), 2.0 * rounding > whole


def hum_of_mean(hum: float, duration: float) -> float:
    """Amplitude that a mean over a time (s) leaves of hum at the mains frequency, in the unit of ``hum``."""
    return hum * max(abs(float(np.sinc(f * duration))) for f in MAINS)
