"""Damped Gauss-Newton steps down a long and bent valley (Levenberg 1944, Marquardt 1963)."""

from __future__ import annotations

import numpy as np

from ...errors import FitError
from ...system.progress import breathe
from .linearised import Linearised, moved
from .point import Point, Slopes
from .problem import Problem
from .scatter import Known, Scatter
from .whitening import Whitening

FAILED = 4  # steps in turn that do not lower the cost, after which the search ends
DAMPING, LEAST = 1e-6, 1e-9  # of the first step, and of any: over the curvature of the cost in each parameter
GOOD, POOR = 0.7, 0.25  # shares of the expected fall of the cost, above and below which the damping changes
EASED, STIFFENED = 0.1, 3.0  # change of the damping after a good step, and after a poor or a failed one
SHORTENED, LENGTHENED = 0.2, 2.0  # change of the step's length after a failed one, and after others
SETTLED = 0.3  # fall of the cost (in units of chi-square) at which a search ends


def descend(
    problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, known: Known, most: int,
    damping: float = DAMPING,
) -> tuple[Point, Slopes, float, int, float]:  # fmt: skip
    """Damped Gauss-Newton steps, with the covariance as it is, until the cost falls no more (Levenberg 1944).

    The valley of the cost is long and bent. Damping over the curvature in each parameter (Marquardt 1963) holds back
    what leads along it and lets a step go straight down its sides. It does not hold back what is the events' own: an
    error of the position moves elements over kinks of the force. So a step that fails is also made shorter as a whole.

    Raises:
        FitError: derivatives are beyond what a covariance can hold.

    Returns:
        The point and the slopes there, by how much the cost fell, how often the model was evaluated, and the damping.
    """
    count, failed, poor, share = 0, 0, 0, 1.0
    first = cost = np.nan
    # what the noise is carried by stays as it is, or costs would jump; derivatives in the events are those here
    white = Whitening(scatter.sizes, known)
    while count < most and failed < FAILED and poor < 2:
        breathe()
        if not failed:
            try:
                system = Linearised(problem, point, slopes, scatter, white)
            except np.linalg.LinAlgError:
                raise FitError(
                    "derivatives with respect to the random effects of an event are too large for a likelihood"
                ) from None
            cost = system.objective(point, slopes)
            first = cost if count == 0 else first
        change, events, expected = system.step(damping)
        if cost - expected < SETTLED:
            break
        trial = moved(point, share * change, point.events + share * (events - point.events))
        there = problem.evaluate(trial)
        count += 1
        then = system.objective(trial, there) if there.finite and trial.weights.sum() > 0.0 else np.inf
        if not then < cost:
            failed, damping, share = failed + 1, STIFFENED * damping, SHORTENED * share
            continue
        kept = (cost - then) / ((cost - expected) * share * (2.0 - share))
        damping = max(damping * (EASED if kept > GOOD else STIFFENED if kept < POOR else 1.0), LEAST)
        failed, poor, share = 0, poor + 1 if cost - then < SETTLED else 0, min(1.0, LENGTHENED * share)
        point, slopes, cost = trial, there, then
    return point, slopes, first - cost, count, damping
