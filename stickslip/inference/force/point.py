"""A point in the space of parameters, and the residual force there with its derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LOCAL = ("strength", "stretch", "shape", "offset")  # of each event: two logarithms, a power, and a length (m)
OWN = len(LOCAL)


@dataclass(frozen=True)
class Point:
    """Where in the space of parameters.

    Attributes:
        z: shared parameters on the search scale, shape (a,).
        phases: shape (b, R).
        weights: strength of every element (N), not negative, shape (k,).
        events: :data:`LOCAL` of each event, shape (E, 4).
        common: error of the position that all cycles share, as a function of the place in the cycle (m), and what is
            left of the hum in each run, over what is expected of it, shape (c,).
    """

    z: Array
    phases: Array
    weights: Array
    events: Array
    common: Array


@dataclass(frozen=True)
class Forces:
    """Residual force at a point.

    What is measured is a motion, and the likelihood is that of the motion: a model that makes forces smaller makes what
    an error of the motion does to them smaller too, and must not gain by it. Residuals, derivatives and stiffnesses are
    therefore taken over what a reading counts for in the model, times what it counts for as the rig is stated: the
    mass that moves where the block is fast, the stiffness of the spring where it creeps (what the contact holds there
    grows as the spring's force does), and everywhere the displacement over what the sensor shows of it: less where the
    block is fast and the sensor late.

    Attributes:
        residual: measured force less the model's (N), shape (p,).
        local: derivatives in the event's own, shape (p, 4).
        spring: stiffness of the spring (N/m), shape (p,).
        tangent: stiffness of what sticks (N/m), shape (p,).
        sticking: the same at the knots of every run, shape (n,) each.
        slides: whether an element slides there, shape (n, k) each.
        sliding: force of those that slide (N), shape (n,) each.
        psi: state of the weakening, shape (n,) each.
        rested: share of static friction in the caps, shape (n,) each.
        held: force that the model holds (N), shape (p,).
        share: what a reading counts for as the rig is stated, over what it counts for in the model, shape (p,).
    """

    residual: Array
    local: Array
    spring: Array
    tangent: Array
    sticking: tuple[Array, ...]
    slides: tuple[NDArray[np.bool_], ...]
    sliding: tuple[Array, ...]
    psi: tuple[Array, ...]
    rested: tuple[Array, ...]
    held: Array
    share: Array

    @property
    def measured(self) -> Array:
        """Force that the motion says (N), shape (p,)."""
        return np.asarray(self.held + self.residual / self.share)


@dataclass(frozen=True)
class Slopes(Forces):
    """Residual force and all its derivatives.

    Attributes:
        shared: derivatives in z, phases of all runs, weights and errors of the position, shape (p, a + b R + k + c).
    """

    shared: Array

    @property
    def finite(self) -> bool:
        """Whether a search can go on from here."""
        return all(np.isfinite(a).all() for a in (self.residual, self.local, self.shared))
