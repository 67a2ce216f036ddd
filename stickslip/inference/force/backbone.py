"""The contact's backbone as it was measured, and the law of a rough contact fitted to that curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ...physics.contact import power_law_bank
from .composition import BESIDE
from .fit import Fit
from .linearised import Array

LEAST = 2e-3  # of the strength: what no law of a rough contact describes better
BINS = 96


@dataclass(frozen=True)
class Backbone:
    """Force on first loading from the force-free state.

    Attributes:
        displacement: yield displacements of the bank's elements (m), shape (n,); between them the curve is straight.
        force, std: (N), shape (n,).
        covariance: of the force (N^2), shape (n, n).
    """

    displacement: Array
    force: Array
    std: Array
    covariance: Array


@dataclass(frozen=True)
class PowerLaw:
    """1 - (1 - u/u_max)^p of contacts whose u_max are spread, as fitted to a backbone.

    Attributes:
        u_max, p, spread: displacement at which the last element slides (m), exponent, rms of ln(u_max) over contacts.
        covariance: of ln(u_max), ln(p - 1) and ln(spread), shape (3, 3).
        misfit: rms of the residual over the backbone's standard deviation.
        force: of the law at the backbone's displacements (N), shape (n,).
    """

    u_max: float
    p: float
    spread: float
    covariance: Array
    misfit: float
    force: Array

    @property
    def u_max_std(self) -> float:
        """Standard deviation of ``u_max`` (m)."""
        return self.u_max * float(np.sqrt(self.covariance[0, 0]))

    @property
    def p_std(self) -> float:
        """Standard deviation of ``p``."""
        return (self.p - 1.0) * float(np.sqrt(self.covariance[1, 1]))


def backbone(found: Fit) -> Backbone:
    """The measured backbone with its band."""
    composition = found.problem.composition
    u = composition.reach
    first = len(composition.shared) + found.point.phases.size
    own, basis, force = [*range(first, first + u.size)], np.minimum(u[:, None] / u, 1.0), found.point.weights
    names = [f.name for f in composition.shared]
    if BESIDE in names:
        own.append(names.index(BESIDE))
        free = composition.shared[own[-1]]
        basis = np.column_stack([basis, u * free.slope(1.0)])
        force = np.append(force, found.point.z[own[-1]])
    covariance = basis @ found.covariance[np.ix_(own, own)] @ basis.T
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return Backbone(u, basis @ force, std, covariance)


def power_law(curve: Backbone, contacts: int) -> PowerLaw:
    """The law of a self-affine contact that describes a backbone best (P1.5), its band and 0.2 % of the strength."""
    strength = float(curve.force[-1])
    sigma = np.hypot(curve.std, LEAST * strength)
    half = float(np.interp(0.5 * strength, curve.force, curve.displacement))

    def law(z: Array) -> Array:
        bank = power_law_bank(strength, np.exp(z[0]), 1.0 + np.exp(z[1]), np.exp(z[2]), contacts=contacts, n=BINS)
        return np.asarray(bank.backbone(curve.displacement))

    prior = np.array([np.log(5.0 * half), np.log(2.3), np.log(0.15)])
    widths = np.array([2.0, 0.7, 0.7])

    def residual(z: Array) -> Array:
        return np.concatenate([(law(z) - curve.force) / sigma, (z - prior) / widths])

    found = least_squares(residual, prior, bounds=(prior - 4.0 * widths, prior + 4.0 * widths), diff_step=1e-4)
    covariance = np.linalg.pinv(found.jac.T @ found.jac, hermitian=True)
    misfit = float(np.sqrt(np.mean(found.fun[: curve.force.size] ** 2)))
    u_max, above, spread = np.exp(found.x)
    return PowerLaw(float(u_max), 1.0 + float(above), float(spread), covariance, misfit, law(found.x))
