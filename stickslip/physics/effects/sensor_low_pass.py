"""Limited bandwidth of the displacement sensor."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Contact, Memory, Motion, Sensor
from .catalogue import register
from .lag import SHORTEST, trail


@register
class SensorLowPass(Memory, Sensor):
    """First-order low-pass; its state is how far the reading stays behind the block."""

    tag = "sensor-low-pass"
    summary = "fast motion is smoothed: first-order low-pass of the sensor"
    equation = r"y \to y - \delta,\quad \dot\delta = \dot x - \delta/\tau,\quad \delta(0) = 0"
    symbols = {r"\delta": "how far the reading stays behind (m)"}
    signature = "late and softened edges of the slip, smaller ring-down; nothing in creep"
    confused_with = {
        "residual-load": "the bandwidth of the decoder, or a hammer tap recorded with the same sensor",
        "velocity-weakening": "the bandwidth of the decoder, or a hammer tap recorded with the same sensor",
        "contact-damping": "frequency and phase of the ring-down stay, its first rebound is small",
    }
    source = "first-order RC filter; Oppenheim & Willsky, Signals and Systems (1997), ch. 6"
    family = "sensor"
    place = Sensor.LOW_PASS

    time_constant: Array = parameter(
        null=0.0, unit="s", lower=0.0, upper=2e-3, usual=(0.0, 1e-3), symbol=r"\tau",
        doc="time constant of the sensor"
    )  # fmt: skip

    def start(self, bank: Bank) -> Array:
        return jnp.zeros(())

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return trail(state, self.time_constant, motion)

    def rising(self, state: Array, rate: Array) -> Array:
        return jnp.where(self.time_constant > SHORTEST, state, rate)

    def read(self, state: Array, reading: Array, motion: Motion, contact_force: Array) -> Array:
        return reading - state

    def undo(self, t: Array, shown: Array, rate: Array) -> Array:
        return shown + self.time_constant * rate
