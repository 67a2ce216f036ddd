"""The posterior density of a fit along the motion in its nonlinear parameters: what a sampler walks through.

Likelihood and priors are those of :mod:`.fit`, with the covariance (noise, scatter of events, misfit) as the fit found
it; every event is marginalised. In what is linear (strengths of the elements, what cycles share, phases) the density is
taken at its best (variable projection: Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413), so that no element comes
to pull the other way. Parameters are counted from the optimum in units of their covariance there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from .fit import Fit
from .linearised import Array, moved, prior_rows, reach
from .point import Point
from .whitening import WithEvents


@dataclass(frozen=True)
class PosteriorDensity:
    """Where a sampler may go.

    Attributes:
        fit: the optimum.
        root: from whitened coordinates to changes of the shared parameters, shape (a, a).
        white: the residuals' covariance, events marginalised.
    """

    fit: Fit
    root: Array
    white: WithEvents

    @property
    def size(self) -> int:
        """Number of whitened coordinates."""
        return self.root.shape[0]

    def at(self, x: Array) -> tuple[Point, float, Array]:
        """The best parameters at whitened coordinates, the logarithm of the density (up to a constant), its gradient.

        Beyond a bound of a parameter the density is that at the bound, less a steep parabola.
        """
        found, a = self.fit, self.size
        bounds = np.array([f.bounds for f in found.free]).reshape(-1, 2).T
        free = found.point.z + self.root @ x
        z = np.clip(free, *bounds)
        beyond = np.linalg.solve(self.root, free - z)
        start = moved(found.point, np.concatenate([z - found.point.z, np.zeros(self._linear)]), found.point.events)
        slopes = found.problem.evaluate(start)
        if not np.isfinite(slopes.residual).all():
            raise FloatingPointError("the model gives no finite force here")
        rest = found.blocks(slopes.residual) - np.einsum("eia,ea->ei", found.known.local, start.events)
        together = np.concatenate([found.blocks(slopes.shared), rest[..., None]], axis=2)
        white = self.white(together).reshape(-1, together.shape[2])
        prior, target = prior_rows(found.problem, start)
        rows, rest = np.vstack([white[:, :-1], prior]), np.concatenate([white[:, -1], target])
        change = self._best(rows[:, a:], rest, start)
        rest = rest + rows[:, a:] @ change
        value = -0.5 * float((rest**2).sum()) - 0.5e4 * float((beyond**2).sum())
        slope = -rows[:, :a].T @ rest
        inside = free == z
        gradient = self.root.T @ (slope * inside)
        if not inside.all():
            gradient = gradient - 1e4 * self.root.T @ (np.linalg.solve(self.root.T, beyond) * ~inside)
        point = moved(start, np.concatenate([np.zeros(a), change]), start.events)
        return point, value, gradient

    def best(self, z: Array) -> Point:
        """The point with given shared parameters (search scale), all else at its best."""
        return self.at(np.asarray(np.linalg.solve(self.root, z - self.fit.point.z), float))[0]

    @property
    def _linear(self) -> int:
        return self.fit.covariance.shape[0] - self.size

    def _best(self, rows: Array, rest: Array, start: Point) -> Array:
        """Changes of what is linear that make the residuals least, within its bounds."""
        low, high = (bound[self.size :] for bound in reach(self.fit.problem, start))
        high = np.where(high - low > 1e-12, high, low + 1e-12)
        normal, right = rows.T @ rows, rows.T @ rest
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
        root = np.linalg.cholesky(normal * scale[:, None] * scale + 1e-11 * np.eye(len(normal)))
        found = lsq_linear(root.T, -np.linalg.solve(root, right * scale), (low / scale, high / scale), method="bvls")
        return np.asarray(found.x * scale)


def posterior_density(fit: Fit) -> PosteriorDensity:
    """The posterior around an optimum; a parameter that stands at a bound may leave it by what its prior allows."""
    a = len(fit.free)
    part = fit.covariance[:a, :a].copy()
    for i, f in enumerate(fit.free):
        if part[i, i] <= 0.0:
            low, high = f.bounds
            part[i, i] = min(f.width, 0.1 * (high - low)) ** 2
    return PosteriorDensity(fit, np.asarray(np.linalg.cholesky(part)), fit.white)
