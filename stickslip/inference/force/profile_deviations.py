"""Where a fit is less certain than its derivatives say.

Every element that begins to slide is a kink of the force, so that the cost along a valley is rough, and at an optimum
its curvature is that of a small dent. What holds a parameter is told by its profile: everything else refitted, with the
parameter held further and further out, and a parabola through the costs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...errors import FitError
from .fit import Fit, refit
from .linearised import Array
from .problem import Problem

LEVEL = "weakening.drop"  # with the contact's strength known by its product alone, where no contact is virgin
PIN = 0.03  # width of the prior that holds a parameter, over its deviation
LEAST = 1e-8  # deviation on the search scale that is assumed at least
SIDES = 4  # steps to either side, each twice the one before it
RISE = 6.0  # of the cost over its dispersion, at which a side ends


def pinned(found: Fit, values: Mapping[str, float], width: float) -> Problem:
    """The problem with parameters held at values, by priors of this width (on their search scale)."""
    composition = found.problem.composition
    free = tuple(
        replace(f, prior=f.outward(values[f.name]), width=width) if f.name in values else f for f in composition.free
    )
    return found.problem.with_composition(replace(composition, free=free))


def held(found: Fit, name: str, value: float, start: Fit | None = None) -> tuple[Fit, float]:
    """The best fit with a parameter held at a value (on its search scale), and its cost with the parameter's own prior.

    Args:
        found: an optimum. name: of one of its shared parameters. value: of it.
        start: from where its prior draws it, default there.
    """
    k = [f.name for f in found.free].index(name)
    f, point = found.free[k], (start or found).point
    width = PIN * max(float(np.sqrt(max(found.covariance[k, k], 0.0))), LEAST)
    again = refit(pinned(found, {name: value}, width), point, found)
    at = float(again.point.z[k])
    own = 0.0 if not np.isfinite(f.width) else ((at - f.inward(f.prior)) / f.width) ** 2
    return again, again.cost - ((at - value) / width) ** 2 + own


def widened(found: Fit, names: Sequence[str], dispersion: float) -> Fit:
    """The fit with a covariance that is no smaller than the profiles of these parameters want.

    Args:
        found: an optimum.
        names: of shared parameters.
        dispersion: of costs over those of perfectly known noise.
    """
    known = [f.name for f in found.free]
    for name in (n for n in names if n in known):
        k = known.index(name)
        own = float(found.covariance[k, k])
        if not own > 0.0:
            continue  # at its bound
        points = _profile(found, name, np.sqrt(dispersion * own), dispersion)
        offset, rise = np.array([(p[k], r) for p, r in points]).T
        if np.ptp(offset) == 0.0:
            continue
        variance = _variance(offset, rise)
        if variance > own:
            # the valley is bent: its direction at the optimum is that of a parabola along its likely part
            scale, likely = float(np.abs(offset).max()), np.exp(-0.25 * np.maximum(rise, 0.0))[:, None]
            bent = np.stack([offset / scale, (offset / scale) ** 2], axis=1)
            apart = np.array([p for p, _ in points])
            along = np.linalg.lstsq(likely * bent, likely * apart, rcond=None)[0][0] / scale
            along[np.diag(found.covariance) == 0.0] = 0.0  # what stands at a bound does not move to either side
            found = replace(found, valleys=(*found.valleys, along * np.sqrt(variance - own)))
    return found


def _profile(found: Fit, name: str, step: float, dispersion: float) -> list[tuple[Array, float]]:
    """Changes of all that is shared, and rises of the cost over its dispersion, out to either side."""
    k = [f.name for f in found.free].index(name)
    low, high = found.free[k].bounds
    begin = float(found.point.z[k])
    points = [(np.zeros(found.covariance.shape[0]), 0.0)]
    for side in (-1.0, 1.0):
        there, value, far = found, begin, step
        for _ in range(SIDES):
            value = float(np.clip(value + side * far, low, high))
            if value == float(there.point.z[k]):
                break
            try:
                there, cost = held(found, name, value, there)
            except FitError:
                break
            points.append((_apart(there, found), (cost - found.cost) / dispersion))
            if points[-1][1] > RISE or value in (low, high):
                break
            far *= 2.0
    return points


def _apart(one: Fit, other: Fit) -> Array:
    a, b = one.point, other.point
    return np.concatenate([a.z - b.z, (a.phases - b.phases).ravel(), a.weights - b.weights, a.common - b.common])


def _variance(offset: Array, rise: Array) -> float:
    """Of the parabola through a profile, the nearest in squares; where it does not rise, of the width looked at.

    Where it has risen by more than is looked for, an error counts by the rise: a wall says nothing of the floor.
    """
    widest = float(np.abs(offset).max())
    size = offset / widest
    counts = 1.0 / np.maximum(rise, RISE)
    bend = float(np.polynomial.polynomial.polyfit(size, rise, 2, w=counts)[2]) if offset.size > 2 else float(rise[-1])
    return widest**2 / max(bend, 1.0)
