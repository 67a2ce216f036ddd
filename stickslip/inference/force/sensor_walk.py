"""Where the sensor stands from event to event: a random walk of its reading that goes on over the arrests.

A reading that is off by w(t) changes the residual force by -c w(t) - k (w(t) - w(t0)): the spring (c) is read from it,
and what sticks (k) remembers where it was at the arrest t0. With w_0 and w_1 at the arrests before and after, a time T
apart, w(t) = (1 - s) w_0 + s w_1 and a Brownian bridge, s = (t - t0) / T. The bridge is an event's own. The nodes hang
together from event to event of a run, w_1 - w_0 ~ N(0, size^2 T), and begin at zero. Given them events are independent,
so that they are eliminated with a tridiagonal matrix (Rue & Held 2005, Gaussian Markov Random Fields, ch. 2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

Array = NDArray[np.float64]
BEFORE, AFTER = 0, 1


def nodes(spring: Array, tangent: Array, share: Array) -> Array:
    """What a shift of 1 m at the arrest before and at that after does to the force (N), shape (E, n, 2).

    Args:
        spring, tangent: stiffness of the spring and of what sticks (N/m), shape (E, n).
        share: of the time between the arrests that is over, shape (E, n).
    """
    return np.stack([tangent * share - spring * (1.0 - share), -(spring + tangent) * share], axis=2)


class SensorWalk:
    """The nodes under a likelihood in which events are independent otherwise.

    Args:
        white: what they do to residuals (:func:`nodes`), whitened, shape (E, n, 2).
        spread: standard deviation of the walk over each event (m), shape (E,).
        first: whether an event is the first of its run, which begins at zero, shape (E,).
    """

    def __init__(self, white: Array, spread: Array, first: NDArray[np.bool_]) -> None:
        self.white, self.spread, self.first = white, spread, first
        own = np.swapaxes(white, 1, 2) @ white
        diagonal = own[:, AFTER, AFTER] + spread**-2.0
        later = ~first[1:]
        diagonal[:-1] += np.where(later, own[1:, BEFORE, BEFORE] + spread[1:] ** -2.0, 0.0)
        beside = np.append(np.where(later, own[1:, BEFORE, AFTER] - spread[1:] ** -2.0, 0.0), 0.0)
        self.root = cholesky_banded(np.stack([diagonal, beside]), lower=True)

    def found(self, white: Array) -> tuple[Array, Array]:
        """Most likely nodes before and after each event for whitened residuals (E, n, m), shape (E, m) each."""
        along = np.swapaxes(self.white, 1, 2) @ white
        right = along[:, AFTER]
        right[:-1] += np.where(self.first[1:, None], 0.0, along[1:, BEFORE])
        after = cho_solve_banded((self.root, True), right)
        return self.before(after), after

    def before(self, after: Array) -> Array:
        """What is known of each node, for the node before it, shape (E, ...)."""
        out = np.zeros_like(after)
        out[1:] = after[:-1]
        out[self.first] = 0.0
        return out

    def apart(self, white: Array) -> Array:
        """Whitened residuals less what the nodes take of them, and their steps in a last row, shape (E, n + 1, m)."""
        before, after = self.found(white)
        rest = white - self.white @ np.stack([before, after], axis=1)
        return np.concatenate([rest, ((before - after) / self.spread[:, None])[:, None]], axis=1)

    @property
    def logs(self) -> Array:
        """What each event adds to the logarithm of the determinant of the covariance, shape (E,)."""
        return np.asarray(2.0 * (np.log(self.root[0]) + np.log(self.spread)))

    def covariance(self) -> Array:
        """Of the nodes before and after each event, given the residuals (m^2), shape (E, 2, 2)."""
        lower, beside = self.root
        size = len(lower)
        own, both = np.zeros(size), np.zeros(size)  # of a node, and with the one after it (Takahashi)
        own[-1] = lower[-1] ** -2.0
        for e in range(size - 2, -1, -1):
            both[e] = -beside[e] / lower[e] * own[e + 1]
            own[e] = lower[e] ** -2.0 - beside[e] / lower[e] * both[e]
        before, cross = self.before(own), self.before(both)
        return np.stack([np.stack([before, cross], axis=1), np.stack([cross, own], axis=1)], axis=1)


def grown(spread: Array, first: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Variance of the nodes before and after each event, nothing else known (m^2), shape (E,) each."""
    steps = np.cumsum(spread**2)
    begun = np.where(first, steps - spread**2, 0.0)
    after = steps - np.maximum.accumulate(begun)
    return after - spread**2, after
