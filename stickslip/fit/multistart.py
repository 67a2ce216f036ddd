"""The base model from several starts: one optimum may be a local one, most often in how weakening and healing share."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..errors import FitError
from .inertial import STAGES, Fit, certain, errors, fit, robust
from .parameters import vector
from .problem import Problem

STARTS = 4
SEED = 0  # of the starts after those of PAIRS
ENOUGH = 1.4  # floors; a fit with no phase above it needs no other start
ALIKE = 2.0  # standard deviations; nor has one whose events have no more than this in common
# factors on the distance of weakening and on the time of healing
PAIRS = ((1.0, 1.0), (1.5, 3.0), (0.4, 1.0), (2.5, 0.5))
FURTHER = ((5.0, 8), (1.0, 16))  # stages of a best fit that is begun again
AGAIN, SETTLED = 2, 0.95  # so often at most, until that takes less than 5 % off its cost
SEARCHED, CERTAIN = 0.7, 0.9  # shares of the work up to the best start taken again, and up to its deviations
AWAY = 2  # stages at wide floors after which a start that does worse than the best so far is left


def best_of(
    problem: Problem,
    floor: np.ndarray,
    use: np.ndarray,
    *,
    starts: int = STARTS,
    progress: Callable[[str, float], None] | None = None,
) -> Fit:
    """The best fit from several starts; later ones are taken only while no fit describes every phase.

    Args:
        problem, floor, use: as for :func:`stickslip.fit.inertial.fit`.
        starts: most starts: the first from the data, then other shares of weakening and healing, then spread over half
            the priors' widths.
        progress: told what goes on and the share of the work done.

    Raises:
        FitError: the model could not be evaluated at any start.
    """
    tell = progress or (lambda text, share: None)
    most = sum(n for _, n in STAGES)
    best: Fit | None = None
    failure: FitError | None = None
    for i, z in enumerate(_starts(problem, starts)):
        done = 0

        def count(text: str, i: int = i) -> None:
            nonlocal done
            done += 1
            tell(f"start {i + 1}/{starts}, {text}", SEARCHED * (i + min(done / most, 1.0)) / starts)

        try:
            found = fit(problem, floor, z=z, use=use, stages=STAGES[:AWAY], progress=count)
            wide = STAGES[AWAY - 1][0]
            if best is not None and _cost(found, problem, floor, wide) > 1.1 * _cost(best, problem, floor, wide):
                continue
            found = fit(problem, floor, z=found.z, events=found.events, use=use, stages=STAGES[AWAY:], progress=count)
        except FitError as error:
            failure = error
            continue
        if best is None or found.cost < best.cost:
            best = found
        left = errors(problem.measurement, best, floor)
        if max(left.by_phase.values(), default=0.0) <= ENOUGH and max(left.alike.values(), default=0.0) <= ALIKE:
            break
    if best is None:
        raise failure or FitError("the fit was given no start")
    once = sum(n for _, n in FURTHER)
    for again in range(AGAIN):
        done = 0

        def last(text: str, again: int = again) -> None:
            nonlocal done
            done += 1
            share = (again + min(done / once, 1.0)) / AGAIN
            tell(f"the best start again ({again + 1}), {text}", SEARCHED + (CERTAIN - SEARCHED) * share)

        more = fit(problem, floor, z=best.z, events=best.events, use=use, stages=FURTHER, progress=last)
        arrived = more.cost > SETTLED * best.cost
        best = more if more.cost < best.cost else best
        if arrived:
            break
    tell("standard deviations", CERTAIN)
    return certain(problem, floor, best)


def _cost(found: Fit, problem: Problem, floor: np.ndarray, factor: float) -> float:
    """Robust chi-square of the data with all floors times ``factor``."""
    m = problem.measurement
    common = problem.common(floor, found.use, factor)
    off = np.nan_to_num((found.features - found.offsets - m.values) / floor, nan=1e4) * floor
    return robust(common(off[common.valid]))


def _starts(problem: Problem, most: int) -> Iterator[np.ndarray]:
    free = problem.composition.free
    first = vector(free)
    bounds = np.array([f.bounds for f in free])
    names = [f.name for f in free]
    widths = np.array([min(f.width, 1.0) for f in free])
    rng = np.random.default_rng(SEED)
    for i in range(most):
        z = first.copy()
        if i < len(PAIRS) and "weakening.slip_distance" in names:
            z[names.index("weakening.slip_distance")] += np.log(PAIRS[i][0])
            z[names.index("weakening.healing_time")] += np.log(PAIRS[i][1])
        elif i:
            z = first + 0.5 * widths * rng.standard_normal(first.size)
        yield np.clip(z, *bounds.T)
