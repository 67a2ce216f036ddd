"""What the error of a step is measured against."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jax import Array, lax

STIFFER = 50.0  # times the driving spring: where the contact holds the block, and a slip is over
TINY = 1e-30


class Tolerance(eqx.Module):
    """What the error of a step is measured against: the scale of the contact, not of the travel.

    Creep moves picometres a step where the contact is stiff; a tolerance relative to the travel sees nothing.

    Attributes:
        relative: share of the step's own increment and of its velocity.
        displacement: absolute part (m).
        velocity: absolute part (m/s).
        ringing: share of the amplitude with which the block rings on a contact that holds it; zero asks of the ringing
            what is asked of a slip.
        inaudible: amplitude of the ringing's velocity (m/s) that need not be resolved; slower creep is all the same.
    """

    relative: Any = eqx.field(default=1e-4, converter=jnp.asarray)
    displacement: Any = eqx.field(default=3e-12, converter=jnp.asarray)
    velocity: Any = eqx.field(default=3e-8, converter=jnp.asarray)
    ringing: Any = eqx.field(default=0.0, converter=jnp.asarray)
    inaudible: Any = eqx.field(default=0.0, converter=jnp.asarray)

    def ring(self, v: Array, a0: Array, a1: Array, h: Array, stiffness: Array, driving: Array) -> tuple[Array, Array]:
        """What ringing adds to the tolerance of a step, for displacement (m) and velocity (m/s).

        Ringing is told from creep, however slow, by acceleration and jerk, and from a slip by the stiffness it rings
        on. It decays in thousands of steps, and no onset or creep depends on its last digits.

        Args:
            v: velocity at the end (m/s).
            a0, a1: accelerations at start and end (m/s^2).
            h: length of the step (s).
            stiffness: tangent of all that holds the block, over its mass (1/s^2).
            driving: that of the driving spring alone.
        """
        v, a0, a1, h, stiffness, driving = lax.stop_gradient((v, a0, a1, h, stiffness, driving))
        square = jnp.maximum(stiffness, driving)
        held = jnp.clip(1.0 - STIFFER * driving / square, 0.0, 1.0)
        amplitude = jnp.sqrt(jnp.maximum(a0 * a0, a1 * a1) / square + ((a1 - a0) / (h * square)) ** 2)
        share = amplitude / (amplitude + jnp.abs(v) + TINY)
        extra = held * (self.ringing * amplitude + self.inaudible * share)
        return extra / jnp.sqrt(square), extra
