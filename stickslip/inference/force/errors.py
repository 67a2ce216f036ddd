"""Error of a residual force in floors, and how far chance moves it: points of one event go together."""

from __future__ import annotations

import numpy as np

from .fit import Fit
from .knots import PHASES

Sums = tuple[np.ndarray, np.ndarray]


def sums(fit: Fit, residual: np.ndarray, floor: np.ndarray) -> Sums:
    """Sums of squared residuals (N) over their floors, and numbers of points, by event and phase, each (E, phases)."""
    problem, use = fit.problem, ~fit.dropped
    shape = problem.event_run.size, len(PHASES)
    cell = problem.of[use] * shape[1] + problem.phase[use]
    squares = np.bincount(cell, (residual[use] / floor[use]) ** 2, shape[0] * shape[1])
    return squares.reshape(shape), np.bincount(cell, minlength=squares.size).reshape(shape)


def of_all(found: Sums) -> tuple[float, float]:
    """Error of all points together, and its deviation."""
    squares, numbers = (a.sum(axis=1) for a in found)
    return error(squares, numbers), deviation(squares, numbers)


def error(squares: np.ndarray, numbers: np.ndarray) -> float:
    """Root mean square of residuals over their floors, from sums and numbers of points by event."""
    return float(np.sqrt(squares.sum() / numbers.sum())) if numbers.any() else float("nan")


def deviation(squares: np.ndarray, numbers: np.ndarray) -> float:
    """Standard deviation of :func:`error`: that of a ratio of sums over events, which are independent."""
    events = np.count_nonzero(numbers)
    if events < 2:
        return float("nan")
    mean = squares.sum() / numbers.sum()
    spread = np.sqrt(((squares - mean * numbers) ** 2).sum() * events / (events - 1)) / numbers.sum()
    return float(spread / (2.0 * np.sqrt(mean)))
