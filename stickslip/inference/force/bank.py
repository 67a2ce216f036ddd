"""Where the elements of the free bank stand: close together where the contact's strength is.

A bank of Jenkins elements is a chord of the backbone between one yield displacement and the next. Spaced evenly in the
logarithm over all that a contact might do, a dozen of forty carry nearly everything, and the chord is off by some
thousandths of the strength, the same in every first loading. A chord's error falls with the third root of the curvature
as the density of its nodes (de Boor 1973), and the curvature of a backbone is its distribution of strength.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import nnls

from .point import Point
from .problem import Problem

Array = NDArray[np.float64]
EVEN = 0.15  # of the elements stay spread over the whole range
FINE = 2000  # places at which the density is told
SMOOTHED = 1.5  # spacings of the old elements over which it is smoothed
CHORDS = 400  # displacements at which the new elements are to carry what the old ones did


def spacing(reach: Array) -> Array:
    """Distance of each element to its neighbours in the logarithm of the yield displacement, over the mean of all."""
    step = np.gradient(np.log(reach))
    return step / step.mean()


def placed(problem: Problem, point: Point) -> tuple[Problem, Point]:
    """The same bank with its elements where the strength is.

    Args:
        problem, point: a fit of the base, weights included; it need not have ended.

    Returns:
        The problem with other yield displacements, and the point with weights that give the same backbone.
    """
    old = problem.composition.reach
    at, step = np.log(old), np.gradient(np.log(old))
    place = np.linspace(at[0], at[-1], FINE)
    density = np.interp(place, at, point.weights / point.weights.sum() / step)
    width = SMOOTHED * step.mean() / (place[1] - place[0])
    wanted = np.cbrt(np.maximum(gaussian_filter1d(density, width, mode="nearest"), 0.0))
    share = (1.0 - EVEN) * np.cumsum(wanted) / wanted.sum() + EVEN * np.arange(1, FINE + 1) / FINE
    share = (share - share[0]) / (share[-1] - share[0])
    new = np.exp(np.interp(np.linspace(0.0, 1.0, old.size), share, place))
    u = np.geomspace(old[0], old[-1], CHORDS)
    curve = np.minimum(u[:, None] / old, 1.0) @ point.weights
    # the full strength above all, and no heap in one element where two share as well
    basis = np.vstack([np.minimum(u[:, None] / new, 1.0), 30.0 * np.ones(new.size), 1e-3 * np.diag(1.0 / spacing(new))])
    total = point.weights.sum()
    weights, _ = nnls(basis, np.concatenate([curve, [30.0 * total], np.zeros(new.size)]), maxiter=50 * new.size)
    composition = replace(problem.composition, reach=new)
    return problem.with_composition(composition), replace(point, weights=weights * total / weights.sum())
