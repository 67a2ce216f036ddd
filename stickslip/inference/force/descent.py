"""Damped Gauss-Newton steps down a long and bent valley (Levenberg 1944, Marquardt 1963)."""

from __future__ import annotations

import numpy as np

from ...errors import FitError
from ...system.progress import breathe
from .linearised import Linearised, moved
from .problem import Point, Problem, Slopes
from .scatter import Blocks, Known, Scatter, Whitening

FAILED = 4  # steps in turn that do not lower the cost, after which the search ends
DAMPING, LEAST = 1e-6, 1e-9  # of the first step, and of any: over the curvature of the cost in each parameter
GOOD, POOR = 0.7, 0.25  # shares of the expected fall of the cost, above and below which the damping changes
EASED, STIFFENED, RAISED = 0.1, 3.0, 30.0  # change of the damping after a good, a poor and a failed step
SETTLED = 0.3  # fall of the cost (in units of chi-square) at which a search ends


def descend(
    problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, known: Known, blocks: Blocks, most: int,
    damping: float = DAMPING,
) -> tuple[Point, Slopes, float, int, float]:  # fmt: skip
    """Damped Gauss-Newton steps, with the covariance as it is, until the cost falls no more (Levenberg 1944).

    The valley of the cost is long and bent. Damping over the curvature in each parameter (Marquardt 1963) holds back
    what leads along it and lets a step go straight down its sides. A step along it may lead up its side and the next
    one down to its bottom again: one step after which the cost is higher is gone on from (the watchdog of Chamberlain,
    Powell, Lemarechal & Pedersen 1982) before the damping is raised.

    Raises:
        FitError: derivatives are beyond what a covariance can hold.

    Returns:
        The point and the slopes there, by how much the cost fell, how often the model was evaluated, and the damping.
    """
    here, count, failed, poor, above = (point, slopes), 0, 0, 0, False
    first = cost = np.nan
    # what the noise is carried by stays as it is, or costs would jump; derivatives in the events are those here
    white = Whitening(scatter.sizes, known)
    while count < most:
        breathe()
        try:
            system = Linearised(problem, *here, scatter, blocks, white)
        except np.linalg.LinAlgError:
            raise FitError("the derivatives in what is an event's own are too large for a likelihood") from None
        now = system.objective(*here)
        if count == 0:
            first = cost = now
        change, events, expected = system.step(damping)
        if not above and now - expected < SETTLED:
            break
        trial = moved(here[0], change, events)
        there = problem.evaluate(trial)
        count += 1
        held = there.finite and trial.weights.sum() > 0.0
        then = system.objective(trial, there) if held else np.inf
        if then < cost:
            poor = poor + 1 if cost - then < SETTLED else 0
            if not above:
                share = (now - then) / (now - expected)
                damping = max(damping * (EASED if share > GOOD else STIFFENED if share < POOR else 1.0), LEAST)
            here, point, slopes, cost, above, failed = (trial, there), trial, there, then, False, 0
        elif np.isfinite(then) and not above:
            here, above = (trial, there), True
        else:
            here, above, failed, damping = (point, slopes), False, failed + 1, RAISED * damping
        if failed == FAILED or poor == 2:
            break
    return point, slopes, first - cost, count, damping
