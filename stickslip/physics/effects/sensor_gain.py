"""Wrong scale of the displacement sensor."""

from __future__ import annotations

from typing import Any

from jax import Array

from ..params import parameter
from .base import Motion, Sensor
from .catalogue import register


@register
class SensorGain(Sensor):
    """The reading is a fixed share too large: wrong calibration, or a beam that is not parallel to the motion."""

    tag = "sensor-gain"
    summary = "reading is too large or too small by a fixed share"
    equation = r"y \to (1 + \gamma)\,y"
    signature = "slip size against recurrence times drive velocity; every displacement by the same share"
    confused_with = {
        "nonlinear-spring": "steady sliding at the drive's velocity: only a gain shows there",
        "machine-compliance": "steady sliding at the drive's velocity: only a gain shows there",
    }
    source = "Polytec OFV-3001 manual: amplitude error of the displacement decoder; cosine error of a tilted beam"
    family = "sensor"
    place = Sensor.GAIN

    gain: Array = parameter(
        null=0.0, unit="1", lower=-0.05, upper=0.05, symbol=r"\gamma", doc="relative error of the scale"
    )

    def read(self, state: Any, reading: Array, motion: Motion, contact_force: Array) -> Array:
        return reading * (1.0 + self.gain)
