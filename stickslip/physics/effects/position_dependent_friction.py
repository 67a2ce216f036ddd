"""Friction that varies along the track."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..params import parameter, phase, variant
from .base import Contact, Motion, Threshold
from .catalogue import register


@register
class PositionDependentFriction(Threshold):
    """A wave of friction along the track, or a trend."""

    tag = "position-dependent-friction"
    summary = "friction varies along the track"
    equation = (
        r"\mu \to \mu\,[1 + \varepsilon \sin(2\pi x/\lambda + \varphi)] \;\mathrm{or}\; \mu\,e^{\varepsilon x/\lambda}"
    )
    signature = "slip size and recurrence repeat with position: the same on the way back and in every pass"
    confused_with = {
        "wear": "go back over the same track",
        "drive-ripple": "start the same track from another position of the drive",
        "nonlinear-spring": "calibrate the spring with weights",
    }
    source = "Armstrong-Helouvry, Control of Machines with Friction (1991), ch. 4"
    periodic = ("wavelength", "displacement")
    family = "friction"

    depth: Array = parameter(
        null=0.0, unit="1", lower=-0.3, upper=0.3, symbol=r"\varepsilon",
        doc="relative change of friction: amplitude of the wave, or change over one wavelength"
    )  # fmt: skip
    wavelength: Array = parameter(
        3e-4, unit="m", lower=1e-5, upper=1e-2, log=True, grid=(1e-4, 3e-4, 1e-3), symbol=r"\lambda",
        doc="wavelength, or length of the trend"
    )  # fmt: skip
    phase: Array = phase("phase at x = 0")
    form: str = variant("wave", ("wave", "trend"), "periodic, or growing along the track")

    def formula(self) -> str:
        if self.form == "trend":
            return r"\mu \to \mu\,e^{\varepsilon x/\lambda}"
        return r"\mu \to \mu\,[1 + \varepsilon \sin(2\pi x/\lambda + \varphi)]"

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        place = motion.x / self.wavelength
        if self.form == "trend":
            return jnp.exp(self.depth * place)
        return 1.0 + self.depth * jnp.sin(2.0 * np.pi * place + self.phase)
