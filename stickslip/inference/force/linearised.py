"""The likelihood about a point, and the damped step from there: normal equations, priors, bounds."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from .bank import spacing
from .composition import PULL
from .point import Forces, Point, Slopes
from .problem import Problem
from .scatter import EVENTS, Scatter
from .whitening import LEVELLED, Whitening

Array = NDArray[np.float64]
BEND = 1.0  # standard deviation of the second difference of neighbouring weights, over their mean
FARTHEST = 1.5  # step of a parameter on the search scale
NONE = 1e-12  # share of the strength that the rounding of a step leaves in an element at its bound


class Linearised:
    """The likelihood about a point: linear in what is shared, events marginalised.

    Args:
        problem, point, slopes: where, and the residuals and derivatives there.
        scatter, white: sizes of what is random, and the covariance.
    """

    def __init__(self, problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, white: Whitening):
        self.problem, self.point, self.slopes = problem, point, slopes
        blocks = problem.blocks
        self.random = np.exp(2.0 * scatter.sizes[: len(EVENTS)])
        self.prior, self.target = prior_rows(problem, point)
        self.local = local = blocks(slopes.local)
        self.plain, self.white = white, white.with_events(local)
        self.shared = blocks(slopes.shared)
        self.marginal = blocks(slopes.residual) - np.einsum("eia,ea->ei", local, point.events)
        whitened = self.white(np.concatenate([self.shared, self.marginal[..., None]], axis=2))
        self.rows, self.rest = whitened[..., :-1], whitened[..., -1]

    def alone(self, forces: Array) -> Linearised:
        """The same with forces (N), shape (p,), in place of the residual, and priors that are met."""
        other = copy(self)
        other.marginal = self.problem.blocks(forces)
        other.rest = self.white(other.marginal[..., None])[..., 0]
        other.target = np.zeros_like(self.target)
        return other

    def objective(self, point: Point, slopes: Forces) -> float:
        """Of residual, random effects and priors, with this covariance."""
        _, target = prior_rows(self.problem, point)
        return self.plain.squares(self.problem.blocks(slopes.residual), point.events) + float((target**2).sum())

    def step(self, damping: float = 0.0, farthest: float = FARTHEST) -> tuple[Array, Array, float]:
        """Changes of what is shared, the events' own values after them, and the cost expected.

        Args:
            damping: over the curvature of the cost in each parameter (Marquardt 1963).
            farthest: change of a parameter on the search scale.
        """
        rows = self.rows.reshape(-1, self.rows.shape[-1])
        normal = rows.T @ rows + self.prior.T @ self.prior
        right = rows.T @ self.rest.ravel() + self.prior.T @ self.target
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
        root = np.linalg.cholesky(normal * scale[:, None] * scale + (damping + 1e-11) * np.eye(len(normal)))
        low, high = reach(self.problem, self.point, farthest)
        high = np.where(high - low > 1e-12, high, low + 1e-12)
        found = lsq_linear(root.T, -np.linalg.solve(root, right * scale), (low / scale, high / scale), method="bvls")
        change = found.x * scale
        events = self.events_after(change)
        rest, prior = self.rest.ravel() + rows @ change, self.target + self.prior @ change
        return change, events, float(rest @ rest + prior @ prior)

    def events_after(self, change: Array) -> Array:
        """The events' own values where what is shared is changed, shape (E, 4)."""
        rest = self.marginal + self.shared @ change
        events = -self.random * np.einsum("eia,ei->ea", self.local, self.white.weighted(rest))
        events[:, :LEVELLED] -= self.white.level(rest)[:, None]
        return np.asarray(events)

    def covariance(self) -> Array:
        """Of the shared parameters; what stands at a bound does not move."""
        rows = self.rows.reshape(-1, self.rows.shape[-1])
        normal = rows.T @ rows + self.prior.T @ self.prior
        low, high = reach(self.problem, self.point)
        free = np.flatnonzero((low < 0.0) & (high > 0.0))
        out = np.zeros_like(normal)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal)[free], 1e-300))
        part = normal[np.ix_(free, free)] * scale[:, None] * scale
        out[np.ix_(free, free)] = np.linalg.pinv(part, hermitian=True) * scale[:, None] * scale
        return out

    def effective_parameters(self, covariance: Array) -> float:
        """Trace of the matrix that makes fitted residuals of measured ones (Hastie & Tibshirani 1990, sec. 3.5)."""
        rows = self.rows.reshape(-1, self.rows.shape[-1])
        return float((covariance * (rows.T @ rows)).sum())

    def likelihood(self) -> Array:
        """Twice the negative logarithm of the marginal likelihood of each event, shape (E,)."""
        return np.asarray((self.rest**2).sum(axis=1) + self.white.logs)


def prior_rows(problem: Problem, point: Point) -> tuple[Array, Array]:
    """Rows of the priors over their standard deviations, and where the parameters stand in them."""
    shared = problem.composition.shared
    a, k = len(shared), point.weights.size
    b, c = point.phases.size, point.common.size
    size = a + b + k + c
    rows, target = [], []
    for i, f in enumerate(shared):
        if np.isfinite(f.width):
            row = np.zeros(size)
            row[i] = 1.0 / f.width
            rows.append(row)
            target.append((point.z[i] - f.inward(f.prior)) / f.width)
    for j, f in enumerate(problem.composition.phases):
        if f.name == PULL:
            for r, run in enumerate(problem.runs):
                row = np.zeros(size)
                row[a + j * len(problem.runs) + r] = 1e6 if run.virgin else 0.1
                rows.append(row)
                target.append(row.max() * point.phases[j, r] if run.virgin else 0.0)
    level, deviation = problem.composition.nominal
    if np.isfinite(deviation):
        row = np.zeros(size)
        row[a + b : a + b + k] = 1.0 / point.weights.sum() / deviation
        rows.append(row)
        target.append((np.log(point.weights.sum()) - np.log(level)) / deviation)
    # in shares of the mean weight as it is: else a contact as a whole weaker would look smoother
    whole, second = point.weights.sum(), np.diff(np.eye(k), 2, axis=0) / spacing(problem.composition.reach)
    bent = k / (BEND * whole) * (second @ point.weights)
    bend = np.zeros((k - 2, size))
    bend[:, a + b : a + b + k] = k / (BEND * whole) * second - bent[:, None] / whole
    common = np.zeros((c, size))
    common[:, a + b + k :] = np.diag(1.0 / problem.usual)
    return (
        np.vstack([*rows, bend, common]),
        np.concatenate([target, bent, point.common / problem.usual]),
    )


def moved(point: Point, change: Array, events: Array) -> Point:
    """The point after a step, within the bounds."""
    a, b = point.z.size, point.phases.size
    phases = point.phases + change[a : a + b].reshape(point.phases.shape)
    k = point.weights.size
    weights = point.weights + change[a + b : a + b + k]
    weights = np.where(weights > NONE * point.weights.sum(), weights, 0.0)
    return Point(point.z + change[:a], phases, weights, events, point.common + change[a + b + k :])


def reach(problem: Problem, point: Point, farthest: float = FARTHEST) -> tuple[Array, Array]:
    """The least and the largest change of everything shared; ``farthest`` on the search scale.

    The force is linear in the weights, which need no such bound.
    """
    shared = problem.composition.shared
    b = np.full(point.phases.size, np.inf)
    bounds = np.array([f.bounds for f in shared]).reshape(-1, 2).T
    low, high = np.maximum(bounds[0] - point.z, -farthest), np.minimum(bounds[1] - point.z, farthest)
    more, c = np.full(point.weights.size, np.inf), np.full(point.common.size, np.inf)
    return np.concatenate([low, -b, -point.weights, -c]), np.concatenate([high, b, more, c])
