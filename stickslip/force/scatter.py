"""What is random: noise of the sensor, events that differ, and misfit that is alike from point to point.

Residuals of one event belong together, those of two events do not. The covariance of an event's residuals is

    S = diag(w^2 + numeric) + Z D Z' + L K L',    K_ij = exp(-|s_i - s_j|)

with the sensor's noise w carried to a force by the stiffness of what sticks, random effects D (strength, yield
displacements, position at the arrest), and misfit whose size L depends on the phase of the cycle and, for errors of the
position, on the stiffness, and a random walk of the reading since the arrest. All sizes are estimated from the campaign
itself by maximum likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from .. import jax_settings  # noqa: F401
from .knots import PHASES

Array = NDArray[np.float64]
NAMES = ("strength", "stretch", "offset", *PHASES, "position", "walk", "white")
# centre of what is expected of each size, and how many e-folds around it: shares, and metres
CENTRES = np.log(np.array([1e-3, 2e-2, 2e-9, 1e-3, 1e-3, 1e-3, 1e-3, 1e-9, 1e-9, 1.0]))
WIDTHS = np.array([2.0, 2.0, 1.0, 2.0, 2.0, 2.0, 2.0, 1.0, 1.5, 0.1])
NUMERIC = 1e-4  # share of the strength below which nothing is claimed
REACH = 1.0  # correlation length along the place


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
    """What the covariance is made of, at the points of every event, shape (E, n)."""

    white: Array
    local: Array
    phase: Array
    tangent: Array
    place: Array
    elapsed: Array
    there: NDArray[np.bool_]
    strength: float


def covariance(sizes: Any, k: Known) -> tuple[Any, Any]:
    """The covariance without and with the random effects (N^2), shape (E, n, n)."""
    s = jnp.exp(sizes)
    own = jnp.where(k.there, s[3 + k.phase] * k.strength, 0.0)
    by_place = jnp.where(k.there, s[7] * k.tangent, 0.0)
    near = jnp.exp(-jnp.abs(k.place[:, :, None] - k.place[:, None, :]) / REACH)
    since = jnp.minimum(k.elapsed[:, :, None], k.elapsed[:, None, :])
    walk = jnp.where(k.there, s[8] * k.tangent, 0.0)
    alike = (own[:, :, None] * own[:, None, :] + by_place[:, :, None] * by_place[:, None, :]) * near
    alike = alike + walk[:, :, None] * walk[:, None, :] * since
    diagonal = jnp.where(k.there, (s[9] * k.white) ** 2 + (NUMERIC * k.strength) ** 2, 1.0)
    plain = alike + jnp.eye(own.shape[1]) * diagonal[:, :, None]
    scaled = k.local * s[:3]
    return plain, plain + jnp.einsum("eia,eja->eij", scaled, scaled)


@lru_cache(maxsize=8)
def _objective() -> Any:
    def cost(sizes: Any, residual: Any, k: Any) -> Any:
        known = Known(*k)
        _, whole = covariance(sizes, known)
        root = jnp.linalg.cholesky(whole)
        white = jax.scipy.linalg.solve_triangular(root, residual[..., None], lower=True)[..., 0]
        logs = jnp.sum(jnp.where(known.there, jnp.log(jnp.diagonal(root, axis1=1, axis2=2)), 0.0), axis=1)
        prior = jnp.sum(((sizes - CENTRES) / WIDTHS) ** 2)
        each = jnp.sum(white**2, axis=1) + 2.0 * logs
        return jnp.sum(each) + prior

    return jax.jit(jax.value_and_grad(cost))


def estimate(start: Scatter, residual: Array, known: Known, evaluations: int = 25) -> Scatter:
    """The sizes under which residuals (E, n), random effects at zero, are most likely."""
    function = _objective()
    fields = tuple(getattr(known, f) for f in Known.__dataclass_fields__)

    def f(sizes: Array) -> tuple[float, Array]:
        value, slope = function(sizes, residual, fields)
        value = float(value)
        return (value, np.asarray(slope)) if np.isfinite(value) else (1e30, np.zeros_like(sizes))

    return Scatter(_least(f, start.sizes, evaluations).x)


def _least(f: Any, sizes: Array, evaluations: int) -> Any:
    return minimize(
        f, sizes, jac=True, method="L-BFGS-B", options={"maxfun": evaluations, "ftol": 1e-6},
        bounds=[*((c - 5.0 * w, c + 4.0 * w) for c, w in zip(CENTRES[:-1], WIDTHS[:-1], strict=True)), (-0.05, 1.0)],
    )  # fmt: skip
