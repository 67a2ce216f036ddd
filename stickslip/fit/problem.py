"""Features of all runs for a vector of parameters, and their Jacobian.

The Jacobian is taken by differences over steps of about one per cent, all perturbed models being integrated side by
side in one compiled call. An exact forward-mode derivative of an adaptive integration is exact for the discrete
solution, which has a fine saw-tooth where kinks of the contact cross the borders of steps: its slope is not the slope of the
curve it follows. (Measured in docs/verification: the exact derivative of the second event's time is wrong in sign at
the tolerance used here, and right to four digits with small fixed steps.)
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..features.curve import StepCurve
from ..features.evaluate import Anchors, features
from ..features.layout import Layout
from ..features.measurement import Measurement
from ..forward import Cycles, run_cycles
from ..solve.stepper import Tolerance
from .composition import Composition

STEP = 0.01  # of a difference, on the search scale


class Problem:
    """One composition against one measurement.

    Args:
        composition: the family of models.
        measurement: the data.
        tolerance: of the solver.
    """

    def __init__(self, composition: Composition, measurement: Measurement, tolerance: Tolerance | None = None) -> None:
        self.composition, self.measurement = composition, measurement
        self.tolerance = Tolerance(5e-3, 1e-11, 1e-7) if tolerance is None else tolerance
        self.runs_done = 0

    def features(self, z: np.ndarray, events: np.ndarray) -> np.ndarray:
        """Features of the model, shape (R, n, F)."""
        return self._call(np.asarray(z)[None], np.asarray(events)[None])[0]

    def jacobian(self, z: np.ndarray, events: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Features (R, n, F), their derivatives in the free parameters (R, n, F, len(z)) and, each in its own cycle, in
        the two event-wise factors (R, n, F, 2)."""
        n, k = z.size, events.shape[-1]
        lanes_z = np.concatenate([z[None], z[None] + STEP * np.eye(n), np.repeat(z[None], k, 0)])
        lanes_e = np.repeat(events[None], 1 + n + k, 0)
        for i in range(k):
            lanes_e[1 + n + i, ..., i] += STEP
        out = self._call(lanes_z, lanes_e)
        change = (out[1:] - out[:1]) / STEP
        return out[0], np.moveaxis(change[:n], 0, -1), np.moveaxis(change[n:], 0, -1)

    def _call(self, z: np.ndarray, events: np.ndarray) -> np.ndarray:
        m = self.measurement
        run = _compiled(_Key(self.composition), m.layout)
        self.runs_done += z.shape[0] * m.runs
        return np.asarray(run(jnp.asarray(z), jnp.asarray(events), m.cycles, m.anchors, self.tolerance))


class _Key:
    """Compositions that compile to the same program are equal."""

    def __init__(self, composition: Composition) -> None:
        self.composition = composition
        self._key = composition.key() + (composition.mass, tuple(sorted(composition.fixed.items())))

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._key == other._key


@lru_cache(maxsize=64)
def _compiled(key: _Key, layout: Layout) -> Any:
    composition = key.composition

    def one_run(z: Array, events: Array, cycles: Cycles, anchors: Anchors, tolerance: Tolerance) -> Array:
        tracks = run_cycles(
            lambda event, nodes: composition.model(z, event, nodes, cycles.stiffness), events, cycles, tolerance
        )
        return jax.vmap(lambda track, a: features(StepCurve(track), a, layout))(tracks, anchors)

    runs = jax.vmap(one_run, in_axes=(None, 0, 0, 0, None))
    lanes = jax.vmap(runs, in_axes=(0, 0, None, None, None))
    return jax.jit(lanes)
