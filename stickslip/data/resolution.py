"""Sensor noise and resolution, from the record itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MAINS = (50.0, 60.0)  # Hz
TERMS = 8  # of the Fourier series of rounding, as many as noise of a tenth of a count leaves


def estimate_resolution(values: Array, samples: int = 200_000) -> float | None:
    """One count of a quantised record, in its unit, or None where the values are not on a grid.

    Args:
        values: shape (n,), SI or raw.
        samples: at most so many values are looked at, in stretches over the whole record.
    """
    x = _sample(values, samples)
    steps = np.abs(np.diff(x))
    scale = float(np.max(np.abs(x), initial=0.0))
    steps = steps[steps > 1e-12 * scale]
    if steps.size < 10:
        return None
    # one count is the commonest of the smallest steps; rounding in a file's decimals smears it
    smallest = float(np.min(steps))
    count = float(np.median(steps[steps < 1.5 * smallest]))
    for most in (3, 8, 25):  # far multiples tell the count better, once it is known well enough to number them
        near = steps < (most + 0.5) * count
        numbers = np.round(steps[near] / count)
        count = float(np.sum(steps[near] * numbers) / np.sum(numbers**2))
    numbers = np.round(steps[near] / count)
    on_grid = np.abs(steps[near] / count - numbers) < 0.03
    if near.sum() < 10 or on_grid.mean() < 0.98 or np.unique(numbers).size > 0.5 * near.sum():
        return None
    return count


def noise_level(values: Array, resolution: float | None = None, windows: int = 400, length: int = 64) -> float:
    """Standard deviation of one sample, in the unit of the values, from the quiet stretches of a record.

    Third differences take out position, velocity and acceleration, so that a moving block counts as quiet unless it
    jerks; their rms over sqrt(20) is the standard deviation of white noise. Of many short windows the lower quarter
    is taken. Counts: never below the LSB/sqrt(12) of rounding itself, which a still, undithered counter hides.

    Args:
        values: shape (n,).
        resolution: one count, or None.
    """
    n = values.size
    floor = (resolution or 0.0) / np.sqrt(12.0)
    if n < 8:
        return float(floor)
    length = min(length, n)
    starts = np.unique(np.linspace(0, n - length, min(windows, max(n // length, 1))).astype(int))
    blocks = values[starts[:, None] + np.arange(length)]
    rms = np.sqrt(np.mean(np.diff(blocks, n=3, axis=1) ** 2, axis=1) / 20.0)
    return float(max(np.quantile(rms, 0.25), floor))


def rounding_of_mean(way: Array, count: float, spread: float) -> Array:
    """Variance of what rounding to counts adds to the mean of readings evenly over a way (m^2), shape as ``way``.

    Over whole counts nothing is left, over a part of one as much as a twelfth of its square. Where on the count the way
    begins is not known (Widrow & Kollár, Quantization Noise, 2008, ch. 4 and 9).

    Args:
        way: (m).
        count: (m).
        spread: standard deviation of the noise before the rounding (m).
    """
    k = np.arange(1, TERMS + 1)
    sizes = count / np.pi / k * np.exp(-2.0 * (np.pi * k * spread / count) ** 2)
    return np.asarray((0.5 * sizes**2 * np.sinc(np.abs(way)[..., None] / count * k) ** 2).sum(axis=-1))


def _sample(values: Array, samples: int, length: int = 2000) -> Array:
    if values.size <= samples:
        return values
    starts = np.linspace(0, values.size - length, samples // length).astype(int)
    return values[(starts[:, None] + np.arange(length)).ravel()]
