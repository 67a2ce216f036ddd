"""Forward-mode derivatives through the solver against differences: what the tests assert and the documents draw."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from stickslip.physics.model import Block, LoadPoint, Model, State, Weakening
from stickslip.simulation.solve import Tolerance
from stickslip.simulation.solve.by_diffrax import step_control
from stickslip.simulation.solve.stepper import ContactStepper

from .rig import MASS, STRENGTH, U_MAX, P, bank

NAMES = (
    "mass", "spring_stiffness", "damping", "ratio", "slip_distance", "healing_time", "u_max", "p", "strength",
    "velocity",
)  # fmt: skip
BASE = np.array([MASS, 1000.0, 10.0, 0.85, 1e-6, 0.02, U_MAX, P, STRENGTH, 5e-5])
TERM = diffrax.ODETerm(lambda t, y, args: y)


def build(theta: Array) -> Model:
    """The rig with every parameter multiplied by ``exp(theta)``."""
    m, c_s, c, r, d_c, t_h, u_max, p, strength, v = jnp.asarray(BASE) * jnp.exp(theta)
    return Model(
        Block(m, c_s, c),
        bank(128, u_max, p, strength),
        Weakening(r, d_c, t_h),
        LoadPoint(jnp.array([0.0, 1.0]), jnp.stack([0.0 * v, v])),
    )


class Outcome(NamedTuple):
    """Displacement (m) before the event; time (s) of the event, its slip (m) and peak velocity (m/s)."""

    creep: Array
    onset: Array
    slip: Array
    peak: Array


def crossing(t: Array, v: Array, level: float, after: Array, rising: bool) -> tuple[Array, Array]:
    """Index and time of the first crossing of ``level`` after the index ``after``."""
    passed = (v > level) if rising else (v <= level)
    i = jnp.argmax(passed & (jnp.arange(t.size) > after))
    return i, t[i - 1] + (t[i] - t[i - 1]) * (level - v[i - 1]) / (v[i] - v[i - 1])


def outcome(t: Array, x: Array, v: Array, early: float) -> Outcome:
    i, onset = crossing(t, v, 5e-4, jnp.zeros((), int), True)
    j, arrest = crossing(t, v, 0.0, i, False)
    return Outcome(
        jnp.interp(early, t, x), onset, jnp.interp(arrest, t, x) - jnp.interp(onset, t, x),
        jnp.max(jnp.where(jnp.arange(t.size) < j, v, -1.0)),
    )  # fmt: skip


@functools.partial(jax.jit, static_argnames=("n", "adaptive"))
def trace(
    theta: Array, state: State | None, t0: float, t1: float, tolerance: Tolerance, n: int, adaptive: bool
) -> tuple[Array, Array, Array]:
    """Time, displacement and velocity at every step; ``n`` equal steps, or at most n adaptive ones."""
    model = build(theta)
    state = model.rest() if state is None else state
    step = (t1 - t0) / n
    solution = diffrax.diffeqsolve(
        TERM, ContactStepper(tolerance), t0, t1, 1e-5 if adaptive else step, state, args=(model, model.shaped()),
        saveat=diffrax.SaveAt(steps=True, fn=lambda t, y, args: (t, y.x, y.v)),
        stepsize_controller=step_control(0.02) if adaptive else diffrax.ConstantStepSize(),
        adjoint=diffrax.ForwardMode(), max_steps=n if adaptive else n + 2, throw=False,
    )  # fmt: skip
    count = solution.stats["num_accepted_steps"]
    done = jnp.arange(solution.ys[0].size) < count
    last = jnp.maximum(count - 1, 0)
    return tuple(jnp.where(done, a, a[last]) for a in solution.ys)


def differences(function: Callable, step: float, which: Sequence[int] | None = None) -> np.ndarray:
    """Central differences of ``function(theta)`` in some parameters (all), shape (parameters, outcomes)."""
    moves = step * np.eye(len(BASE))[range(len(BASE)) if which is None else which]
    return np.stack([(np.asarray(function(m)) - np.asarray(function(-m))) / (2.0 * step) for m in moves])


def creep_displacements(tolerance: Tolerance, times: tuple[float, ...], most: int = 1024) -> Callable:
    """Displacement (m) at ``times`` (s) of the first creep as a function of theta, by adaptive steps."""

    def displacement(theta: Array) -> Array:
        t, x, _ = trace(jnp.asarray(theta), None, 0.0, times[-1] + 0.1, tolerance, most, True)
        return jnp.interp(jnp.asarray(times), t, x)

    return displacement


def two_events(tolerance: Tolerance, end: float = 6.3, most: int = 8192, fixed: bool = False) -> Callable:
    """Onset of the first event and recurrence of the second (s) as a function of theta."""

    def times(theta: Array) -> Array:
        t, _, v = trace(jnp.asarray(theta), None, 0.0, end, tolerance, most, not fixed)
        i, first = crossing(t, v, 5e-4, jnp.zeros((), int), True)
        j, _ = crossing(t, v, 0.0, i, False)
        _, second = crossing(t, v, 5e-4, j, True)
        return jnp.stack([first, second - first])

    return times
