"""The damped oscillation of the block on all that holds it, and how much of it a step follows.

``xi'' + c xi' + k xi = f(t)``; its responses to forces that grow with a power of time are what exponential integrators
are made of (Hochbruck & Ostermann, Acta Numerica 19 (2010) 209).
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ...physics.contact import Bank
from ...physics.effects.base import Contact, Memory, Motion, Sensor
from ...physics.model import Model, State

TERMS = 12  # of a power series: what is left out is below 1e-11 of the sum within one radian
FADES = (1.2, 2.0)  # rad, angles of a step between which the oscillation is followed less and less
WIDEST, FILTERED = 1.0, 0.5  # rad, angle of a step that follows it; where a sensor filters what happens within the step
HELD = (0.25, 0.5)  # share of the contact's stiffness that does not slide, from which on the block rings on it
STEEP = (1.0, 4.0)  # change of velocity within a step, over itself, by forces that follow it: from there on too stiff
BLUR = 0.01  # of the way within a step


class Responses(NamedTuple):
    """What follows after a time from rest without displacement; each is the rate of the next.

    Attributes:
        turn, push: velocity (1) and displacement (s) for a unit of initial velocity.
        constant, linear, quadratic: displacement (s^2, s^3, s^4) for a force over mass of 1, t, t^2/2.
    """

    turn: Array
    push: Array
    constant: Array
    linear: Array
    quadratic: Array


class Oscillation(eqx.Module):
    """Stiffness k (1/s^2) and damping c (1/s), both over mass."""

    stiffness: Array
    damping: Array

    def angle(self, t: Array) -> Array:
        """By how much it turns, or fades where damping is strong, within the time ``t`` (s), in rad."""
        return t * jnp.sqrt(self.stiffness + self.damping**2)

    def responses(self, t: Array) -> Responses:
        """After the time ``t`` (s), as power series: no digit is lost where the angle is small."""
        k, c = self.stiffness * t * t, self.damping * t
        quadratic, linear = jnp.zeros(()), jnp.zeros(())
        before, now, factorial = jnp.zeros(()), jnp.ones(()), 6.0
        for j in range(TERMS):
            linear = linear + now / factorial
            factorial *= j + 4
            quadratic = quadratic + now / factorial
            before, now = now, -c * now - k * before
        # integrals of the equation of motion lead back to the others
        constant = 0.5 - c * linear - k * quadratic
        push = 1.0 - c * constant - k * linear
        turn = 1.0 - c * push - k * constant
        return Responses(turn, t * push, t**2 * constant, t**3 * linear, t**4 * quadratic)


def followed(model: Model, bank: Bank, y: State, contact: Contact, a: Array, t: Array, h: Array) -> tuple:
    """The oscillation of the block at the start of a step, and the share of it that the step follows, 0 ... 1.

    None of it in slips, where little holds the block; in creep, whose steps are too long; and where friction follows
    the velocity so steeply that only an L-stable step can follow it. Both change with the state without a jump, or a
    step would be no differentiable function of the parameters.

    Args:
        model, bank, y, contact: at the start of the step.
        a: acceleration there (m/s^2).
        t: time there (s).
        h: length of the step (s).
    """
    zero, mass = jnp.zeros(()), model.mass()
    driving, damping = model.block.spring_stiffness / mass, model.block.damping / mass
    whole = jnp.sum(y.stiffness) / mass
    square = (whole + driving) * h * h
    # an element holds the block as far as it does not slide on the way ahead, here that of the block if all held
    parts = y.v * h / (1.0 + square / 6.0), 0.5 * a * h * h / (1.0 + square / 12.0)
    way = parts[0] + parts[1]
    blur = BLUR * (abs(parts[0]) + abs(parts[1])) + 1e-30
    room = y.cap - jnp.where(way < 0.0, -1.0, 1.0) * y.force
    reach = 1.0 / (abs(way) + blur)
    held = jnp.sum(jnp.minimum(y.stiffness, (room + blur * y.stiffness) * reach)) / mass
    oscillation = Oscillation(driving + held, damping)
    still = Motion(t + zero, zero + 1e-12, y.x, zero + 1e-12, zero, zero, model.lead(t))
    steep = h / mass * model.velocity_slope(y, bank, contact, still)
    share = (
        _rises(held / jnp.where(whole > 0.0, whole, 1.0), *HELD)
        * (1.0 - _rises(oscillation.angle(h), *FADES))
        * (1.0 - _rises(steep, *STEEP))
    )
    return jax.tree.map(lambda part: jnp.where(share > 0.0, part, 0.0), oscillation), share


def _rises(value: Array, low: float, high: float) -> Array:
    """From 0 at ``low`` to 1 at ``high`` without an edge."""
    s = jnp.clip((value - low) / (high - low), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def widest(model: Model) -> float:
    """Angle (rad) of a step that follows the oscillation. A filter takes the motion within the step for a parabola."""
    return FILTERED if any(isinstance(e, Sensor) and isinstance(e, Memory) for e in model.effects) else WIDEST
