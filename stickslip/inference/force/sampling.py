"""Samples in even steps of time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def even(t: Array, x: Array) -> tuple[Array, Array]:
    """Equal steps of time; lost samples are filled in linearly."""
    step = np.median(np.diff(t))
    if np.ptp(np.diff(t)) < 1e-3 * step:
        return np.asarray(t), np.asarray(x)
    even = np.arange(t[0], t[-1], step)
    return even, np.interp(even, t, x)
