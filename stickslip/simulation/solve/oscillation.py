"""The damped oscillation of the block on all that holds it, in closed form, and the stages of a step that follow it.

``xi'' + c xi' + k xi = f(t)``; the responses to forces that grow with a power of time are the functions of exponential
integrators (Hochbruck & Ostermann, Acta Numerica 19 (2010) 209) for an oscillator. They are summed as power series:
a step follows the oscillation by little more than one radian.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax import Array

FARTHEST = 2.0  # rad, up to which the series are exact
TERMS = 20  # of a series: the first one that is left out is below 1e-16 of the sum


class Responses(NamedTuple):
    """Displacement after a time from rest; each is the rate of the next.

    Attributes:
        turn: velocity after a unit of velocity (1).
        push: to a unit of velocity (s).
        constant, linear, quadratic: to a force over mass of 1, t, t^2/2 (s^2, s^3, s^4).
    """

    turn: Array
    push: Array
    constant: Array
    linear: Array
    quadratic: Array


class Oscillation(eqx.Module):
    """Stiffness and damping over mass.

    Attributes:
        stiffness: k (1/s^2).
        damping: c (1/s).
    """

    stiffness: Array
    damping: Array

    def angle(self, t: Array) -> Array:
        """By how much the oscillation turns, or fades where it is over-damped, within ``t`` (rad)."""
        return jnp.abs(t) * jnp.sqrt(self.stiffness + self.damping**2)

    def responses(self, t: Array) -> Responses:
        """After a time ``t`` (s) within which it turns by no more than :data:`FARTHEST`."""
        k, c = self.stiffness * t * t, self.damping * t
        quadratic, linear = jnp.zeros(()), jnp.zeros(())
        before, now, factorial = jnp.zeros(()), jnp.ones(()), 6.0
        for j in range(TERMS):
            linear = linear + now / factorial
            factorial *= j + 4
            quadratic = quadratic + now / factorial
            before, now = now, -c * now - k * before
        # the equation of motion, integrated, leads back without loss of digits
        constant = 0.5 - c * linear - k * quadratic
        push = 1.0 - c * constant - k * linear
        turn = 1.0 - c * push - k * constant
        return Responses(turn, t * push, t**2 * constant, t**3 * linear, t**4 * quadratic)
