"""AC coupling of the displacement sensor, or displacement integrated from velocity."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Contact, Memory, Motion, Sensor
from .catalogue import register
from .lag import follow


@register
class SensorHighPass(Memory, Sensor):
    """First-order high-pass; its state is the slow part of the displacement, which is not shown.

    The filter acts on the displacement. In the chain of sensor effects a gain comes after it and scales it as well; a
    drift comes last and is not filtered.
    """

    tag = "sensor-high-pass"
    summary = "slow motion is lost: first-order high-pass of the sensor"
    equation = r"y \to y - s,\quad \dot s = 2\pi f_c\,(x - s),\quad s(0) = 0"
    symbols = {"s": "slow part of the displacement, which is lost (m)"}
    signature = "after a slip the reading sags back exponentially; huge for slips of 100 um"
    confused_with = {
        "sensor-drift": "long hold after a slip: a high-pass decays and depends on the slip, a drift goes on",
        "thermal-creep": "step test of the sensor on a rigid stop",
    }
    source = "first-order RC coupling; Oppenheim & Willsky, Signals and Systems (1997), ch. 6"
    family = "sensor"
    place = Sensor.HIGH_PASS

    cutoff: Array = parameter(
        null=0.0, unit="Hz", lower=0.0, upper=5.0, symbol="f_c", doc="frequency below which motion is lost"
    )

    def start(self, bank: Bank) -> Array:
        return jnp.zeros(())

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return follow(state, 2.0 * np.pi * self.cutoff, motion)

    def read(self, state: Array, reading: Array, motion: Motion, contact_force: Array) -> Array:
        return reading - state

    def undo(self, t: Array, shown: Array, rate: Array) -> Array:
        dt = jnp.diff(t)
        lost = 0.5 * dt * (shown[1:] + shown[:-1]) - dt**2 * jnp.diff(rate) / 12.0  # of a cubic with these rates
        return shown + 2.0 * np.pi * self.cutoff * jnp.concatenate([jnp.zeros(1), jnp.cumsum(lost)])
