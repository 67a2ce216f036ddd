"""Counts of a sensor without what rounding adds to them in the mean.

Between two counts the mean of rounded readings is not the motion's, unless noise of about half a count goes with it
(:func:`stickslip.data.resolution.rounding_of_mean`). What is left depends on the position, in the
same way in all events.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...data.resolution import TERMS

Array = NDArray[np.float64]
ON_GRID = 0.02  # of a count, by which readings may lie beside a multiple


def counted(readings: Array, count: float) -> bool:
    """Whether all readings (m) are multiples of a count (m), from the first on."""
    if not count > 0.0:
        return False
    steps = (readings - readings[0]) / count
    return bool(np.abs(steps - np.round(steps)).max() < ON_GRID)


def rounding(x: Array, count: float, spread: Array | float) -> Array:
    """Mean of what rounding to counts adds where a reading without it would be (m), shape as ``x``.

    Args:
        x: from one of the counts (m).
        count: (m).
        spread: standard deviation of the noise before the rounding, and of ``x`` (m).
    """
    turn, faded = 2.0 * np.pi * x / count, np.exp(-2.0 * (np.pi * np.asarray(spread) / count) ** 2)
    sines = ((-1.0) ** k / k * faded ** (k * k) * np.sin(k * turn) for k in range(1, TERMS + 1))
    return np.asarray(count / np.pi * sum(sines))
