"""A bank under a prescribed motion: what a law does, without a block that answers."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from stickslip.physics.contact import Bank
from stickslip.physics.effects.base import Motion
from stickslip.physics.model import Block, LoadPoint, Model, Weakening


def bank_of(stiffness, strength):
    """A bank from lists."""
    return Bank(jnp.atleast_1d(jnp.asarray(stiffness, float)), jnp.atleast_1d(jnp.asarray(strength, float)))


def still_model(bank, *effects, velocity=0.0, damping=0.0, spring=1000.0):
    """Constant friction, so that only the effects act; a drive at constant velocity (m/s)."""
    block = Block(mass=0.0894, spring_stiffness=spring, damping=damping)
    drive = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, velocity]))
    return Model(block, bank, Weakening(ratio=1.0), drive, tuple(effects))


@eqx.filter_jit
def _march(model, motions, state):
    bank = model.shaped()

    def increment(state, motion):
        state, forces = model.advance(state, bank, model.contact(state, bank, motion.t - motion.dt), motion)
        return state, (state.force, forces.body, forces.dissipated)

    return jax.lax.scan(increment, state, motions)


def march(bank, effects, dt, v, state=None, t0=0.0, x0=0.0):
    """Increments of durations ``dt`` at constant velocities ``v``.

    Returns:
        Element forces (increments, elements), forces of effects on the block (increments,), and the final state.
    """
    model = still_model(bank, *effects)
    dt, v = np.broadcast_arrays(np.atleast_1d(np.asarray(dt, float)), np.atleast_1d(np.asarray(v, float)))
    dx, zero = v * dt, 0.0 * dt
    motions = Motion(
        *(jnp.asarray(f) for f in (t0 + np.cumsum(dt), dt, x0 + np.cumsum(dx), v, zero, dx, zero, zero, 1.0 + zero))
    )
    state, (force, body, _) = _march(model, motions, model.rest() if state is None else state)
    return np.asarray(force), np.asarray(body), state


def spread_out(parts):
    """dt and v from (duration, velocity, number of increments) triples."""
    dt = np.concatenate([np.full(n, t / n) for t, _, n in parts])
    v = np.concatenate([np.full(n, speed) for _, speed, n in parts])
    return dt, v
