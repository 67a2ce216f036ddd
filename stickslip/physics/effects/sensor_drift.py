"""Drift of the displacement sensor."""

from __future__ import annotations

from typing import Any

from jax import Array

from ..params import parameter
from .base import Motion, Sensor
from .catalogue import register


@register
class SensorDrift(Sensor):
    """The reading moves although nothing does: warming of the mount or of the air path."""

    tag = "sensor-drift"
    summary = "reading drifts at a constant rate"
    equation = r"y \to y + \varepsilon t"
    signature = "linear addition to every creep curve and hold, the same at every load, also where nothing is loaded"
    confused_with = {
        "thermal-creep": "holds at several loads: the rate of creep depends on the load, that of drift does not",
        "sensor-high-pass": "long hold after a slip: a high-pass decays, a drift goes on",
        "curvature": "change the drive velocity: drift is fixed to the clock",
        "machine-compliance": "change the drive velocity: drift is fixed to the clock",
    }
    source = "thermal expansion of the mount, 12 ppm/K of its length in steel"
    family = "sensor"
    place = Sensor.OFFSET

    rate: Array = parameter(
        null=0.0, unit="m/s", lower=-5e-8, upper=5e-8, symbol=r"\varepsilon", doc="rate of the drift"
    )

    def read(self, state: Any, reading: Array, motion: Motion, contact_force: Array) -> Array:
        return reading + self.rate * motion.t
