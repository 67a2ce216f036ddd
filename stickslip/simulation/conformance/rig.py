"""A small rig on which effects are tried: compiled once for any number of effects, whatever their parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...physics.contact import power_law_bank
from ...physics.effects.base import Effect, Motion
from ...physics.model import Block, LoadPoint, Model, State, Weakening
from ...physics.params import specs
from ..solve import Steps, Tolerance
from ..solve.by_diffrax import observe, step_control
from ..solve.stepper import ContactStepper, Increments

ELEMENTS = 24
DRIVE_TIMES = np.array([0.0, 0.13, 0.3, 1.0])  # s; load to half, hold, load on to the slip
DRIVE = np.array([0.0, 0.13e-3, 0.13e-3, 0.83e-3])  # m
STOPPED = np.full(4, 0.35e-3)  # m; the spring is stretched over the limit and the drive stands
CREEP = np.array([0.05, 0.12, 0.29, 0.38])  # s
END = 0.55  # s; after the first slip
SLIP = 5e-6  # m; a displacement reached only in the slip
MOST_STEPS = 8192
LOOSE, TIGHT = 1e-2, 4e-3  # relative tolerances of a step
LONGEST = 4e-3  # s; a step must resolve an oscillation that is absent where its derivative is taken
AT_ONCE = 6  # derivatives taken together

_TERM = Increments()


class Outcome(NamedTuple):
    """A run as the solver made it.

    Attributes:
        steps: everything at every step; the unused rest of the buffer holds infinities.
        accepted: number of accepted steps.
    """

    steps: Steps
    accepted: Array


def feature_scales() -> np.ndarray:
    """Sizes of the features of an :class:`Outcome`: creep and slip in m, time in s."""
    return np.array([*[1e-7] * CREEP.size, 5e-5, 0.05])


def base_model(effects: tuple[Effect, ...] = ()) -> Model:
    """The rig with effects: 0.26 N of friction over 0.95 um on a spring of 1 kN/m; the ring-down dies fast."""
    bank = power_law_bank(0.2604, 0.95e-6, 3.6, n=ELEMENTS)
    block = Block(mass=jnp.asarray(0.0894), spring_stiffness=jnp.asarray(1000.0), damping=jnp.asarray(20.0))
    return Model(block, bank, Weakening(), LoadPoint(jnp.asarray(DRIVE_TIMES), jnp.asarray(DRIVE)), effects)


class Rig:
    """Runs of the base model with ``effects`` as functions of one vector that holds all their parameters.

    Attributes:
        names: (index of the effect, name of the parameter) for every entry of the vector.
        defaults: the vector with every parameter at its default, all effects absent.
        traces: how often Python went through the model to compile the run.
    """

    def __init__(self, effects: tuple[Effect, ...]) -> None:
        self.effects = effects
        self.names = [(i, name) for i, effect in enumerate(effects) for name in specs(effect)]
        self.defaults = np.array([float(getattr(effects[i], name)) for i, name in self.names])
        self.traces = 0
        self._model = base_model(effects)
        self.run = jax.jit(self._run)
        self.replay = jax.jit(jax.vmap(self._replay, in_axes=(0, None, None, None)))
        self.replay_derivatives = _derivatives(self._replay)
        self.march = jax.jit(self._march)
        self.march_derivatives = _derivatives(self._march)

    def at(self, index: int) -> dict[str, int]:
        """Name -> place in the vector of the parameters of one effect."""
        return {name: place for place, (i, name) in enumerate(self.names) if i == index}

    def model(self, p: Array) -> Model:
        """The model with the parameters in it."""
        if not self.names:
            return self._model
        places = [p[k] for k in range(len(p))]
        return eqx.tree_at(lambda m: [getattr(m.effects[i], name) for i, name in self.names], self._model, places)

    def with_values(self, index: int, values: Mapping[str, float]) -> np.ndarray:
        """The vector with parameters of one effect set."""
        p, places = self.defaults.copy(), self.at(index)
        for name, value in values.items():
            p[places[name]] = value
        return p

    def _run(self, p: Array, drive: Array, tolerance: Array) -> Outcome:
        self.traces += 1
        model = eqx.tree_at(lambda m: m.load_point.positions, self.model(p), drive)
        solution = diffrax.diffeqsolve(
            _TERM,
            ContactStepper(tolerance=Tolerance(tolerance, 1e-9 * tolerance, 1e-5 * tolerance)),
            0.0,
            END,
            1e-5,
            model.rest(),
            args=(model, model.shaped()),
            saveat=diffrax.SaveAt(steps=True, fn=observe),
            stepsize_controller=step_control(LONGEST),
            adjoint=diffrax.ForwardMode(),
            max_steps=MOST_STEPS,
            throw=False,
        )
        return Outcome(solution.ys, solution.stats["num_accepted_steps"])

    def _replay(self, p: Array, times: Array, count: Array, tolerance: Array) -> tuple[Array, Array]:
        """Features of a run over given ``times`` (s), of which the first ``count`` + 1 are used.

        Readings at the steps nearest to the CREEP times and at the last (m), and the time at which the reading first
        passes SLIP (s). With the steps held, the features are as smooth in the parameters as the laws are; the
        derivative is the one that diffrax gives, which takes no derivative of the step sizes.

        Also the number of steps whose Newton iteration did not end (a law with a kink at rest can do that); the
        derivative of such a step is not that of what it computes.
        """
        model = self.model(p)
        args = model, model.shaped()
        # the velocity tolerance only ends Newton's iteration here; so low, because a derivative taken off the root is
        # wrong by the distance over the law's own scale of velocity
        solver = ContactStepper(tolerance=Tolerance(tolerance, 1e-9 * tolerance, 1e-9 * tolerance))
        start = model.rest()

        def body(k: Array, carry: Any) -> Any:
            y, solver_state, seen, failed = carry
            y, _, _, solver_state, _ = solver.step(_TERM, times[k], times[k + 1], y, args, solver_state, False)
            seen = seen.at[:, k].set(jnp.stack(_seen(model, times[k + 1], y)))
            return y, solver_state, seen, failed + solver_state.failed

        blank = jnp.full((2, times.size - 1), jnp.inf)
        carry = start, solver.init(_TERM, times[0], times[1], start, args), blank, jnp.zeros(())
        _, _, (reading, v), failed = jax.lax.fori_loop(0, count, body, carry)
        at = jnp.searchsorted(times[1:], CREEP)
        features = jnp.append(reading[jnp.append(at, count - 1)], _passes(times[1:], reading, v, SLIP))
        return features, jax.lax.stop_gradient(failed)

    def _march(self, p: Array, motions: Motion) -> list[Array]:
        model = self.model(p)
        bank = model.shaped()

        def increment(state: Any, motion: Motion) -> tuple[Any, Any]:
            return march_step(model, bank, state, motion)

        state, seen = jax.lax.scan(increment, model.rest(), motions)
        return jax.tree.leaves((state, seen))


def march_step(model: Model, bank: Any, state: Any, motion: Motion) -> tuple[Any, Any]:
    """One prescribed increment: the state after it, and the acceleration and the reading there."""
    motion = motion._replace(load_point=model.lead(motion.t))
    contact = model.contact(state, bank, motion.t - motion.dt)
    state, forces = model.advance(state, bank, contact, motion)
    return state, (forces.net / model.mass(), model.read(state, motion, forces.contact), state.force, state.psi)


def prescribed() -> Motion:
    """A motion, independent of forces, that visits what a law must survive; fields of shape (n,).

    Steps of 0.1 ns without any way, creep, holds of up to 100 s, a slip, reversals in the step, rest.
    """
    creep = [(1e-2, v) for v in np.linspace(2e-8, 2e-7, 8)]
    hold = [(1e-3, 0.0), (1e-10, 0.0), (1.0, 0.0), (100.0, 0.0), (1e-10, 0.0)]
    slip = [(2e-4, v) for v in (1e-5, 1e-3, 3e-3, 5e-3, 5e-3, 2e-3)]
    ring = [(3e-4, v) for v in (-2e-4, 1e-4, -4e-5, 1e-5)]
    parts = [(1e-10, 0.0), (1e-10, 1e-9), *creep, *hold, *creep, *slip, *ring, (1e-10, 0.0), *hold, *creep]
    dt, v = np.array(parts).T
    before = np.append(0.0, v[:-1])
    dx = 0.5 * dt * (before + v)
    load = 1.0 + 0.05 * np.sin(np.arange(dt.size))
    fields = (np.cumsum(dt), dt, np.cumsum(dx), v, 0.5 * dt * (before - v), dx, 0.0 * dt, 0.0 * dt, load)
    return Motion(*(jnp.asarray(f) for f in fields))


def _seen(model: Model, t: Array, y: State) -> tuple[Array, Array]:
    """Reading (m) and velocity (m/s)."""
    zero = jnp.zeros(())
    motion = Motion(t, zero + 1e-12, y.x, y.v, zero, zero, model.lead(t))
    return model.read(y, motion, jnp.sum(y.force)), y.v


def _passes(t: Array, reading: Array, v: Array, level: float) -> Array:
    """Time (s) at which the reading first passes a level, by inverse cubic interpolation; not finite if never."""
    after = jnp.argmax(reading > level)
    before = jnp.maximum(after - 1, 0)
    way, dt = reading[after] - reading[before], t[after] - t[before]
    s = (level - reading[before]) / way
    slow0, slow1 = way / v[before], way / v[after]
    return t[before] + s * s * (3 - 2 * s) * dt + s * (1 - s) * ((1 - s) * slow0 - s * slow1)


def directions(places: Sequence[int], size: int) -> np.ndarray:
    """One derivative along each of the places of a vector, at most AT_ONCE, shape (AT_ONCE, size)."""
    out = np.zeros((AT_ONCE, size))
    out[np.arange(len(places)), list(places)] = 1.0
    return out


def _derivatives(function: Callable) -> Callable:
    """(parameters, directions (AT_ONCE, n), rest) -> value and its derivatives along the directions."""

    @jax.jit
    def both(p: Array, directions: Array, *rest: Any) -> Any:
        return jax.vmap(lambda d: jax.jvp(lambda q: function(q, *rest), (p,), (d,)), out_axes=(None, 0))(directions)

    return both
