"""How good forecasts are that are given as ensembles: continuous ranked probability score, coverage, errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def crps(members: Array, truth: float) -> float:
    """Continuous ranked probability score of an ensemble, in its unit; smaller is better.

    That of the members' step-wise distribution, exactly: ``E|X - y| - E|X - X'|/2`` with the second mean from the
    sorted members (Gneiting & Raftery 2007, eq. 21; Jordan, Kruger & Lerch 2019).

    Args:
        members: equally likely values, shape (m,).
        truth: what came.
    """
    x = np.sort(members)
    m = x.size
    rank = 2.0 * np.arange(1, m + 1) - m - 1
    return float(np.mean(np.abs(x - truth)) - np.dot(rank, x) / m**2)


def quantiles(members: Array, shares: Sequence[float]) -> Array:
    """Quantiles of an ensemble whose m members stand for equal parts of a distribution, each for its middle (Hazen).

    Args:
        members: equally likely values along the last axis. shares: of the distribution, shape (q,).

    Returns:
        Shape (q, ...).
    """
    return np.asarray(np.quantile(members, shares, axis=-1, method="hazen"))


def score(forecasts: list[Array], truths: Array, groups: NDArray[np.intp] | None = None) -> dict[str, float]:
    """Scores of a method over many moments.

    Args:
        forecasts: members of each, shape (m,); s.
        truths: what came, shape (n,); s.
        groups: which slip each is of, for the standard error of the score; default each by itself.

    Returns:
        ``crps`` (s) with its standard error ``crps_std``, ``coverage_50`` and ``coverage_90`` (shares of truths within
        the central intervals), ``mae`` (s, of the median), ``r2`` (of the mean; 1 is perfect, 0 as good as the mean of
        all truths).
    """
    each = np.array([crps(m, t) for m, t in zip(forecasts, truths, strict=True)])
    edges = np.array([quantiles(m, [0.05, 0.25, 0.5, 0.75, 0.95]) for m in forecasts])
    means = np.array([m.mean() for m in forecasts])
    rest = float(np.sum((truths - truths.mean()) ** 2))
    return {
        "crps": float(each.mean()),
        "crps_std": standard_error(each, groups),
        "coverage_50": float(np.mean((truths >= edges[:, 1]) & (truths <= edges[:, 3]))),
        "coverage_90": float(np.mean((truths >= edges[:, 0]) & (truths <= edges[:, 4]))),
        "mae": float(np.mean(np.abs(edges[:, 2] - truths))),
        "r2": float(1.0 - np.sum((means - truths) ** 2) / rest) if rest > 0 else float("nan"),
    }


def gains(own: list[Array], others: Mapping[str, list[Array]], truths: Array, groups: NDArray[np.intp]) -> dict:
    """By what share the CRPS is below that of other methods, with standard errors from slip to slip."""
    mine = np.array([crps(m, t) for m, t in zip(own, truths, strict=True)])
    out = {}
    for name, theirs in others.items():
        that = np.array([crps(m, t) for m, t in zip(theirs, truths, strict=True)])
        out[name] = {
            "share": float(1.0 - mine.mean() / that.mean()),
            "std": standard_error(that - mine, groups) / float(that.mean()),
        }
    return out


def standard_error(values: Array, groups: NDArray[np.intp] | None = None) -> float:
    """Standard error of a mean whose values belong together by groups; NaN for fewer than two groups."""
    if groups is None:
        groups = np.arange(values.size)
    _, index = np.unique(groups, return_inverse=True)
    sums = np.bincount(index, values - values.mean())
    n = sums.size
    return float(np.sqrt(np.sum(sums**2) * n / max(n - 1, 1)) / values.size) if n > 1 else float("nan")
