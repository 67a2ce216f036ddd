"""What is random: noise of the sensor, events that differ, and misfit that is alike from point to point.

Residuals of one event belong together, those of two events do not. The covariance of an event's residuals is

    S = N + diag(numeric) + Z D Z' + L K L',    K_ij = exp(-|s_i - s_j|)

with the noise N of the sensor's samples carried to a force by stiffness and inertia together, random effects D
(strength, yield displacements, position at the arrest), and misfit whose size L depends on the phase of the cycle and,
for errors of the position, on the stiffness, and a random walk of the reading since the arrest. All sizes are estimated
from the campaign itself by maximum likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from .knots import PHASES

Array = NDArray[np.float64]
NAMES = ("strength", "stretch", "offset", *PHASES, "position", "walk", "white")
# centre of what is expected of each size, and how many e-folds around it: shares, and metres
CENTRES = np.log(np.array([1e-3, 2e-2, 2e-9, 1e-3, 1e-3, 1e-3, 1e-3, 1e-9, 1e-9, 1.0]))
WIDTHS = np.array([2.0, 2.0, 1.0, 2.0, 2.0, 2.0, 2.0, 1.0, 1.5, 0.1])
NUMERIC = 1e-4  # share of the strength below which nothing is claimed
REACH = 1.0  # correlation length along the place
FARTHEST = 1.5  # step of a size, in e-folds
DAMPINGS = 6  # of a step that does not lower the cost
SETTLED = 0.05  # fall of the cost at which the search ends


@dataclass(frozen=True)
class Scatter:
    """Logarithms of the sizes, in the order of NAMES."""

    sizes: Array

    @classmethod
    def wide(cls) -> Scatter:
        """What a fit begins with, so that no single kink of the model holds it."""
        return cls(np.log(np.array([1e-2, 0.1, 5e-9, 0.02, 0.02, 0.02, 0.02, 2e-9, 1e-9, 1.0])))

    def named(self) -> dict[str, float]:
        """Name -> size: shares of strength and of yield displacement, metres of position."""
        return dict(zip(NAMES, np.exp(self.sizes).tolist(), strict=True))


@dataclass(frozen=True)
class Blocks:
    """Residuals side by side by event, shape (E, n), with padding.

    Attributes:
        index: point of each place, shape (E, n).
        there: false for padding.
    """

    index: NDArray[np.intp]
    there: NDArray[np.bool_]

    @classmethod
    def of(cls, event: NDArray[np.intp], events: int) -> Blocks:
        count = np.bincount(event, minlength=events)
        index = np.zeros((events, max(int(count.max(initial=0)), 1)), np.intp)
        there = np.zeros(index.shape, bool)
        for e in range(events):
            own = np.flatnonzero(event == e)
            index[e, : own.size], there[e, : own.size] = own, True
        return cls(index, there)

    def __call__(self, values: Array, fill: float = 0.0) -> Array:
        """Side by side, shape (E, n, ...)."""
        out = values[self.index]
        out[~self.there] = fill
        return out


@dataclass(frozen=True)
class Known:
    """What the covariance is made of, at the points of every event, shape (E, n).

    ``noise`` is the covariance (N^2) by the noise of samples, shape (E, n, n); ``dropped`` a variance (N^2) that takes
    a point's weight.
    """

    noise: Array
    dropped: Array
    local: Array
    phase: Array
    tangent: Array
    place: Array
    elapsed: Array
    there: NDArray[np.bool_]
    strength: float

    def with_local(self, local: Array) -> Known:
        """The same with other derivatives in the events' own."""
        other = replace(self, local=local)
        other.__dict__.update(near=self.near, shifts=self.shifts)  # which do not depend on them
        return other

    @cached_property
    def near(self) -> Array:
        """Correlation of misfit at two points, shape (E, n, n)."""
        return np.exp(-np.abs(self.place[:, :, None] - self.place[:, None, :]) / REACH)

    @cached_property
    def shifts(self) -> tuple[Array, Array]:
        """Covariance (N^2) by errors of the position of 1 m, alike where near, and by a walk of 1 m/s^0.5."""
        moved = np.where(self.there, self.tangent, 0.0)
        pairs = moved[:, :, None] * moved[:, None, :]
        return pairs * self.near, pairs * np.minimum(self.elapsed[:, :, None], self.elapsed[:, None, :])


def covariance(sizes: Array, k: Known) -> tuple[Array, Array]:
    """The covariance without and with the random effects (N^2), shape (E, n, n)."""
    s = np.exp(sizes)
    misfit, position, walk = _alike(s, k)
    plain = misfit + position + walk + s[9] ** 2 * k.noise
    at = np.arange(plain.shape[1])
    plain[:, at, at] += np.where(k.there, k.dropped + (NUMERIC * k.strength) ** 2, 1.0)
    scaled = k.local * s[:3]
    return plain, plain + scaled @ np.swapaxes(scaled, 1, 2)


def _alike(s: Array, k: Known) -> tuple[Array, Array, Array]:
    """Misfit by phase, errors of the position, and the walk (N^2), shape (E, n, n) each."""
    own = np.where(k.there, s[3 + k.phase] * k.strength, 0.0)
    placed, walked = k.shifts
    return own[:, :, None] * own[:, None, :] * k.near, s[7] ** 2 * placed, s[8] ** 2 * walked


def misfit(sizes: Array, residual: Array, k: Known) -> float:
    """Twice the negative logarithm of the likelihood of residuals (E, n), and of what is expected of the sizes."""
    try:
        root = np.linalg.cholesky(covariance(sizes, k)[1])
    except np.linalg.LinAlgError:
        return np.inf
    white = solve_triangular(root, residual[..., None], lower=True)
    logs = np.log(np.diagonal(root, axis1=1, axis2=2)).sum()
    return float((white**2).sum() + 2.0 * logs + (((sizes - CENTRES) / WIDTHS) ** 2).sum())


def _slopes(sizes: Array, residual: Array, k: Known) -> tuple[Array, Array]:
    """Gradient of the cost and its average information, shapes (10,) and (10, 10)."""
    s = np.exp(sizes)
    misfit, position, walk = _alike(s, k)
    inverse = np.linalg.inv(covariance(sizes, k)[1])
    a = np.einsum("eij,ej->ei", inverse, residual)
    inverse = np.where(k.there[:, :, None], inverse, 0.0)
    gradient, moved = np.zeros(sizes.size), np.zeros((*residual.shape, sizes.size))
    for r in range(3):
        z = s[r] * k.local[..., r]
        along = np.einsum("ei,ei->e", z, a)
        gradient[r] = 2.0 * (np.einsum("ei,eij,ej->", z, inverse, z, optimize=True) - (along**2).sum())
        moved[..., r] = 2.0 * z * along[:, None]
    traces = np.einsum("eij,eij->ei", inverse, misfit)
    pulled = np.einsum("eij,ej->ei", misfit, a)
    for p in range(len(PHASES)):
        own = (k.phase == p) & k.there
        gradient[3 + p] = 2.0 * (traces - a * pulled)[own].sum()
        moved[..., 3 + p] = own * pulled + np.einsum("eij,ej->ei", misfit, own * a)
    for i, part in ((7, position), (8, walk), (9, s[9] ** 2 * k.noise)):
        pulled = np.einsum("eij,ej->ei", part, a)
        gradient[i] = 2.0 * (np.einsum("eij,eij->", inverse, part) - (a * pulled).sum())
        moved[..., i] = 2.0 * pulled
    information = np.einsum("eia,eij,ejb->ab", moved, inverse, moved, optimize=True)
    gradient += 2.0 * (sizes - CENTRES) / WIDTHS**2
    return gradient, information + np.diag(2.0 / WIDTHS**2)


def estimate(start: Scatter, residual: Array, known: Known, steps: int = 30) -> Scatter:
    """The sizes under which residuals (E, n), random effects at zero, are most likely.

    Newton's method with the average information (Gilmour, Thompson & Cullis 1995) in place of the second derivative,
    damped, within bounds around what is expected.
    """
    low = np.append(CENTRES[:-1] - 5.0 * WIDTHS[:-1], -0.05)
    high = np.append(CENTRES[:-1] + 4.0 * WIDTHS[:-1], 1.0)
    sizes, damping = np.clip(start.sizes, low, high), 1e-2
    cost = misfit(sizes, residual, known)
    for _ in range(steps):
        gradient, information = _slopes(sizes, residual, known)
        free = ~(((sizes <= low) & (gradient > 0.0)) | ((sizes >= high) & (gradient < 0.0)))
        fallen = 0.0
        for _ in range(DAMPINGS):
            matrix = (information + damping * np.diag(np.diag(information)))[np.ix_(free, free)]
            step = np.zeros(sizes.size)
            step[free] = -np.linalg.solve(matrix, gradient[free])
            trial = np.clip(sizes + np.clip(step, -FARTHEST, FARTHEST), low, high)
            there = misfit(trial, residual, known)
            if there < cost:
                fallen, cost, sizes, damping = cost - there, there, trial, max(0.1 * damping, 1e-6)
                break
            damping *= 10.0
        if fallen < SETTLED:
            break
    return Scatter(sizes)
