"""A smooth curve through scattered points, and a scale on which small and large values can both be seen."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_smoothing_spline

KNOTS, FEWEST = 40, 5  # medians of the smooth curve, and how many different ones it needs


def smooth(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A smooth curve through medians of y over x, by generalised cross-validation; empty where there is too little."""
    parts = [p for p in np.array_split(np.argsort(x, kind="stable"), KNOTS) if p.size]
    at = np.array([np.median(x[p]) for p in parts])
    middle = np.array([np.median(y[p]) for p in parts])
    apart = np.unique(np.round(at / max(np.ptp(at), 1e-300), 4), return_index=True)[1] if at.size else at.astype(int)
    if apart.size < FEWEST:
        return np.zeros(0), np.zeros(0)
    along = np.linspace(at[apart[0]], at[apart[-1]], 200)
    return along, make_smoothing_spline(at[apart], middle[apart])(along)


def _knee(x: np.ndarray) -> float:
    return max(0.002 * float(np.abs(x).max(initial=0.0)), 1e-300)


def bent(x: np.ndarray) -> np.ndarray:
    """On a scale that is linear around zero and logarithmic beyond."""
    return np.asarray(np.arcsinh(x / _knee(x)))


def straight(at: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Values at places of the scale on which ``x`` is bent."""
    return np.asarray(np.sinh(at) * _knee(x))


def bent_ticks(x: np.ndarray) -> tuple[list[float], dict[float, str]]:
    """Places and texts of powers of ten on that scale."""
    knee, top = _knee(x), float(np.abs(x).max(initial=0.0))
    powers = [10.0**p for p in range(int(np.ceil(np.log10(knee))), int(np.floor(np.log10(max(top, knee)))) + 1)]
    values = [0.0, *powers, *(-p for p in powers if x.min(initial=0.0) < -p)]
    at = [float(np.arcsinh(v / knee)) for v in values]
    return at, {a: f"{v:g}" for a, v in zip(at, values, strict=True)}
