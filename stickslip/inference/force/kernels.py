"""The smooth test function of the weak form and its derivatives, as weights of samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def kernels(half: float, rate: float) -> tuple[Array, Array, Array]:
    """The test function (1 - u^2)^5 and its derivatives as weights of samples, shape (2 h + 1,).

    What the second gives of a polynomial up to the fourth power is what the first gives of its slope, and so for the
    third and its second derivative (1/s, 1/s2): sampled at a few points, the derivatives themselves do not.
    """
    h = max(round(half * rate), 3)
    u = np.arange(-h, h + 1) / (h + 1.0)
    phi = (1.0 - u * u) ** 5
    phi /= phi.sum()
    first = _matched(u * (1.0 - u * u) ** 4, phi, u, 1)
    second = _matched((1.0 - u * u) ** 3 * (9.0 * u * u - 1.0), phi, u, 2)
    scale = (h + 1.0) / rate  # s in one unit of u
    return phi, first / scale, second / scale**2


def band(second: Array, rate: float) -> float:
    """Angular frequency of what the second derivative of the test function leaves of white noise (rad/s)."""
    return float(rate * np.sqrt((np.diff(second, prepend=0.0, append=0.0) ** 2).sum() / (second**2).sum()))


def _matched(shape: Array, phi: Array, u: Array, order: int) -> Array:
    """A derivative of ``phi`` by its shape, with polynomials times ``phi`` added that make its moments those of it."""
    powers = [k for k in range(5) if k % 2 == order % 2]
    moments = [np.prod(np.arange(k - order + 1, k + 1)) * (phi * u ** max(k - order, 0)).sum() for k in powers]
    basis = np.stack([shape / np.abs(shape).sum(), *(phi * u**k for k in powers)])
    found, *_ = np.linalg.lstsq(np.stack([u**k for k in powers]) @ basis.T, np.array(moments), rcond=None)
    return np.asarray(found @ basis)
