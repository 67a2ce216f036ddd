"""Errors of a fit by phase of the cycle and by run, and how far chance moves them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..inference.force.fit import Fit as ForceFit
from ..inference.force.knots import PHASES
from .shown import table

if TYPE_CHECKING:
    import pandas

Sums = tuple[np.ndarray, np.ndarray]


def sums(fit: ForceFit, residual: np.ndarray, floor: np.ndarray) -> Sums:
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


def by_phase(fit: ForceFit, found: Sums, measure: Callable[[np.ndarray, np.ndarray], float]) -> pandas.DataFrame:
    """A measure of :func:`sums`: a row for each phase, a column for each run."""
    problem, (squares, numbers) = fit.problem, found
    runs = {"all": slice(None), **{k.name: problem.event_run == r for r, k in enumerate(problem.runs)}}
    phases = {"all": slice(None), **{name: [i] for i, name in enumerate(PHASES) if numbers[:, i].any()}}
    rows = {
        p: {r: measure(*(a[own][:, some].sum(axis=1) for a in (squares, numbers))) for r, own in runs.items()}
        for p, some in phases.items()
    }
    return table(rows, "phase")


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
