"""Residuals to independent ones of unit variance, what is random being of given sizes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .linked_events import WALK
from .scatter import OWN, Known, caps, covariance_alone, inverse

Array = NDArray[np.float64]
LEVELLED = 2  # of an event's own: strength and yield displacements go with the level


class Whitening:
    """Residuals to independent ones of unit variance, given the sizes; derivatives in the events' own may change.

    The covariance without random effects is inverted once, what the events' own add is of low rank.
    """

    def __init__(self, sizes: Array, known: Known) -> None:
        self.sizes, self.known = sizes, known
        root = np.asarray(np.linalg.cholesky(covariance_alone(sizes, known)), float)
        self.back = inverse(root)
        self.logs = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
        self.loads = self.back @ known.loads
        loads = self.loads
        if known.chain is not None:
            # given strength and yield displacements, an event tells of its levels by their difference, and by how they
            # stand to both
            own, least = self.back @ known.caps[..., None], np.exp(-sizes[:LEVELLED, None])
            mean = np.pad(known.chain.mean, ((0, 0), (WALK, 0)))[:, None]
            loads = np.concatenate([loads - own * mean, least * mean], axis=1)
        self.linked = known.linked(sizes, loads)

    def squares(self, values: Array, events: Array) -> float:
        """Of residuals (E, n) with what is the events' own, (E, 4), under the covariance of both."""
        white, own = self.back @ values[..., None], events / np.exp(self.sizes[:OWN])
        if self.known.chain is not None:
            white, own = np.concatenate([white, -own[:, :LEVELLED, None]], axis=1), own[:, LEVELLED:]
        return float((self.linked.apart(white) ** 2).sum() + (own**2).sum())

    def with_events(self, local: Array) -> WithEvents:
        """The same with events that differ; ``local`` are derivatives in what is their own, shape (E, n, 4)."""
        return WithEvents(self, local)


class WithEvents:
    """Residuals to independent ones of unit variance, random effects included."""

    def __init__(self, plain: Whitening, local: Array) -> None:
        self.back = plain.back
        aside = self.back @ (local * np.exp(plain.sizes[:OWN]))
        values, turn = np.linalg.eigh(np.swapaxes(aside, 1, 2) @ aside)
        values = np.maximum(values, 0.0)
        self.aside = aside @ turn
        self.share = 1.0 / (1.0 + values + np.sqrt(1.0 + values))  # of (1 + U U')^(-1/2) = 1 - U share U'
        self.known = known = plain.known
        loads = plain.loads
        if known.chain is not None:
            loads = np.concatenate([loads[..., :WALK], self.back @ known.chain.loads(caps(local))], axis=2)
        self.linked = known.linked(plain.sizes, self._apart(loads))
        self.logs = plain.logs + np.log1p(values).sum(axis=1) + self.linked.logs

    def _apart(self, white: Array) -> Array:
        along = np.swapaxes(self.aside, 1, 2) @ white
        return np.asarray(white - self.aside @ (self.share[..., None] * along))

    def __call__(self, values: Array) -> Array:
        """Whitened: shape (E, n, m) to (E, n + 1, m), the last row by the steps of the sensor's walk.

        With a level that wanders there are four rows more, by its steps.
        """
        return self.linked.apart(self._apart(self.back @ values))

    def weighted(self, values: Array) -> Array:
        """Times the inverse covariance, shape (E, n)."""
        white = self._apart(self(values[..., None])[:, : values.shape[1]])
        return np.asarray((np.swapaxes(self.back, 1, 2) @ white)[..., 0])

    def level(self, values: Array) -> Array:
        """Mean level (share of the caps) of each event for residuals (E, n), shape (E,); zero where none is."""
        if self.known.chain is None:
            return np.zeros(values.shape[0])
        return np.asarray((self.known.chain.mean * self.stands(values)[:, WALK:]).sum(axis=1))

    def stands(self, values: Array) -> Array:
        """Most likely nodes of each event for residuals (E, n), shape (E, 2), with levels (E, 6)."""
        return np.asarray(self.linked.found(self._apart(self.back @ values[..., None]))[..., 0])
