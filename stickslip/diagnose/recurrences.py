"""What the recurrences alone tell of an effect: how large it is, if it makes them differ within a run."""

from __future__ import annotations

import numpy as np
from scipy.stats import theilslopes

LEAST = 6  # recurrences; fewer tell nothing


def told(off: np.ndarray, rate: np.ndarray, floor: np.ndarray, valid: np.ndarray) -> tuple[float, float]:
    """The amplitude that makes a model's recurrences differ within each run as the measured ones do.

    A sensor's error of scale, drift or wear move the force at every onset by what has piled up since the run began, so
    they change recurrences by far more than all else, and a base that was fitted without them is bent beyond what a
    linear step of everything finds. What is alike in all cycles of a run is left out: when a run begins, and what the
    base can do about a velocity. The slope is that of Theil and Sen, which single slips that went astray do not move.

    Args:
        off: measured recurrences less the model's, s, shape (R, n).
        rate: change of the model's for a unit of the amplitude, s, shape (R, n).
        floor: how well each is known, s, shape (R, n).
        valid: cycles to be looked at, shape (R, n).

    Returns:
        The amplitude (from the one at which the model is), and the share of the differences that it explains: of the
        sum of their sizes in floors, at most 1; 0 where nothing is told.
    """
    known = valid & np.isfinite(off) & np.isfinite(rate)
    y, x = ((_beside_median(a, known) / floor)[known] for a in (off, rate))
    if y.size < LEAST or not np.ptp(x) or not np.ptp(y):
        return 0.0, 0.0
    size = float(theilslopes(y, x).slope)
    return size, float(1.0 - np.sum(np.abs(y - size * x)) / np.sum(np.abs(y)))


def _beside_median(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Less the median of each run."""
    return values - np.array([[np.median(v[k]) if k.any() else 0.0] for v, k in zip(values, known, strict=True)])
