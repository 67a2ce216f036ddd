"""First-order filters, exact over an increment for a displacement that is a parabola in time, and rates at knots."""

from __future__ import annotations

import math

import jax.numpy as jnp
from jax import Array

from .base import Motion

SHORTEST = 1e-12  # s: a time constant below it is none


def velocities(motion: Motion) -> tuple[Array, Array]:
    """Velocity (m/s) at the start and acceleration (m/s2) of the parabola with the increment's way and end velocity."""
    start = 2.0 * motion.dx / motion.dt - motion.v
    return start, (motion.v - start) / motion.dt


def follow(value: Array, rate: Array, motion: Motion) -> Array:
    """Low-passed displacement: solve ``y' = rate (x - y)`` over the increment from ``y = value`` (m).

    Exactly ``value`` at rate zero; ``rate`` (1/s) may be traced. Meant for rates that are slow against the motion.
    """
    start, acceleration = velocities(motion)
    z = rate * motion.dt
    one, two, three = _phi(z)
    way = start * motion.dt * two + acceleration * motion.dt**2 * three
    return value + z * ((motion.x - motion.dx - value) * one + way)


def trail(value: Array, time_constant: Array, motion: Motion) -> Array:
    """How far a low-passed displacement stays behind: solve ``y' = x' - y/time_constant`` from ``y = value`` (m).

    Exactly zero at time constant zero (s), with the derivative ``v`` there. Meant for time constants from zero up to
    those of the motion.
    """
    start, acceleration = velocities(motion)
    positive = time_constant > SHORTEST
    fade = jnp.where(positive, jnp.exp(-motion.dt / jnp.where(positive, time_constant, 1.0)), 0.0)
    ahead = time_constant * (start - time_constant * acceleration)
    behind = time_constant * (motion.v - time_constant * acceleration)
    return behind + (value - ahead) * fade


def slope(y: Array, t: Array) -> Array:
    """Rate of change at the knots, by chords from each one's neighbours: noise counts little where knots lie close."""
    behind, ahead = jnp.minimum(jnp.arange(y.size), 1), jnp.minimum(jnp.arange(y.size)[::-1], 1)
    i = jnp.arange(y.size)
    return (y[i + ahead] - y[i - behind]) / (t[i + ahead] - t[i - behind])


def _phi(z: Array) -> tuple[Array, Array, Array]:
    """phi_k(-z), k = 1, 2, 3: (1 - e^-z)/z and its followers phi_(k+1)(-z) = (1/k! - phi_k(-z))/z."""
    small = z < 1.0
    s = jnp.where(small, z, 0.0)
    three = sum((-s) ** k / math.factorial(k + 3) for k in range(15))
    two = 0.5 - s * three
    b = jnp.where(small, 1.0, z)
    one_b = -jnp.expm1(-b) / b
    two_b = (1.0 - one_b) / b
    return (
        jnp.where(small, 1.0 - s * two, one_b),
        jnp.where(small, two, two_b),
        jnp.where(small, three, (0.5 - two_b) / b),
    )
