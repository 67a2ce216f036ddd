"""Vibration of the base along the drive."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..params import parameter, phase
from .base import BodyForce, Contact, Motion
from .catalogue import register


@register
class BaseVibration(BodyForce):
    """A sinusoidal acceleration of the base: a force on the block in the frame of the base."""

    tag = "base-vibration"
    summary = "the base shakes at a fixed frequency"
    equation = r"F = -m\,a_b \sin(2\pi f t + \varphi)"
    symbols = {"F": "force on the block in the frame of the base (N)"}
    signature = "a line at a fixed frequency also in holds; slips set off early, ratcheting creep"
    confused_with = {
        "load-modulation": "spectrum with the drive off: the base still shakes the block",
        "thermal-creep": "a second sensor on the base: ratcheting follows its amplitude",
        "drive-ripple": "change the drive velocity: a vibration keeps its frequency",
    }
    source = "Newton's law in the frame of an accelerated base; levels: Gordon, Proc. SPIE 1619 (1992) 71"
    periodic = ("frequency", "time")
    family = "drive"

    acceleration: Array = parameter(
        null=0.0, unit="m/s^2", lower=-0.1, upper=0.1, usual=(-0.01, 0.01), symbol="a_b",
        doc="amplitude of the base's acceleration"
    )  # fmt: skip
    frequency: Array = parameter(
        20.0, unit="Hz", lower=1.0, upper=500.0, usual=(5.0, 50.0), log=True, grid=(7.0, 20.0, 50.0), symbol="f",
        doc="frequency"
    )  # fmt: skip
    phase: Array = phase("phase at t = 0")

    def force(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return -contact.mass * self.acceleration * jnp.sin(2.0 * np.pi * self.frequency * motion.t + self.phase)
