"""Normal load that oscillates at a fixed frequency: vibration of the table, mains, a motor."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..params import parameter, phase
from .base import Contact, Motion, Threshold
from .catalogue import register


@register
class LoadModulation(Threshold):
    """All caps follow a sinusoidal normal load."""

    tag = "load-modulation"
    summary = "normal load oscillates at a fixed frequency"
    equation = r"C_i \to C_i\,[1 + \varepsilon \sin(2\pi f t + \varphi)]"
    signature = "a line at a fixed frequency in the creep velocity, scatter of the recurrence with the phase in time"
    confused_with = {
        "base-vibration": "a second sensor on the base; with the drive stopped far below the limit the base still "
        "shakes the block, the load does not",
        "drive-ripple": "change the drive velocity: the line of a ripple moves with it, that of the load stays",
    }
    source = "Tolstoi, Wear 10 (1967) 199: normal degree of freedom in friction"
    periodic = ("frequency", "time")
    family = "contact"

    depth: Array = parameter(
        null=0.0, unit="1", lower=-0.05, upper=0.05, usual=(-0.01, 0.01), symbol=r"\varepsilon",
        doc="amplitude of the load as a share of the load"
    )  # fmt: skip
    frequency: Array = parameter(
        10.0, unit="Hz", lower=0.1, upper=500.0, log=True, grid=(5.0, 10.0, 25.0, 50.0), symbol="f", doc="frequency"
    )
    phase: Array = phase("phase at t = 0")

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return 1.0 + self.depth * jnp.sin(2.0 * np.pi * self.frequency * motion.t + self.phase)
