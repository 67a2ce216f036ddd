"""Periodic error of the drive: lead screw, gear, motor step."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..params import parameter, phase
from .base import Drive
from .catalogue import register


@register
class DriveRipple(Drive):
    """The load point runs ahead and behind once a pitch; it starts where the drive says it starts."""

    tag = "drive-ripple"
    summary = "periodic error of the drive along its travel"
    equation = r"x_0 \to x_0 + \varepsilon\,[\sin(2\pi s/\ell + \varphi) - \sin(\varphi)]"
    symbols = {"s": "way the drive was told to go (m)"}
    signature = "recurrence and slip times scatter in step with the absolute position of the drive, at every velocity"
    confused_with = {
        "load-modulation": "change the drive velocity: a ripple is fixed to the travel, a modulation to the clock",
        "base-vibration": "change the drive velocity: a ripple is fixed to the travel, a vibration to the clock",
        "position-dependent-friction": "start the drive elsewhere with the block at the same place",
        "nonlinear-spring": "go on for several pitches: a ripple repeats",
    }
    source = "ISO 3408-3: travel deviation of ball screws"
    periodic = ("pitch", "load point")
    family = "drive"

    ripple: Array = parameter(
        null=0.0, unit="m", lower=-5e-6, upper=5e-6, symbol=r"\varepsilon", doc="amplitude of the position error"
    )
    pitch: Array = parameter(
        1e-3, unit="m", lower=1e-6, upper=1e-2, log=True, grid=(0.5e-3, 1e-3, 2e-3), symbol=r"\ell",
        doc="travel of one period"
    )  # fmt: skip
    phase: Array = phase("phase at travel 0")

    def lead(self, t: Array, load_point: Array) -> Array:
        turn = 2.0 * np.pi * load_point / self.pitch
        return self.ripple * (jnp.sin(turn + self.phase) - jnp.sin(self.phase))
