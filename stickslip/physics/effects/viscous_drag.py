"""A force that opposes the velocity: lubricant film, air, eddy currents."""

from __future__ import annotations

from typing import Any

from jax import Array

from ..params import parameter
from .base import BodyForce, Contact, Motion
from .catalogue import register

SPEED = 1e-3  # m/s; the speed at which the amplitude is the force itself, whatever the exponent
SLOW = 1e-7  # m/s; below it the drag is linear, so that its derivative stays finite at rest


@register
class ViscousDrag(BodyForce):
    """A power of the speed, linear below 0.1 um/s: 1 for a thick film, below 1 for a thinning one, 2 for inertia."""

    tag = "viscous-drag"
    summary = "a force against the motion that grows with a power of velocity"
    equation = (
        r"F = -F_1\,(\dot x/v_1)\,\left[(\dot x^2 + v_r^2)/v_1^2\right]^{(q-1)/2},"
        r"\quad v_1 = 1\,\mathrm{mm/s},\quad v_r = 10^{-4}\,v_1"
    )
    symbols = {
        "F": "force on the block (N)",
        "v_1": "a velocity of reference (m/s)",
        "v_r": "velocity below which the drag is linear (m/s)",
    }
    signature = "late part of the slip, peak velocity, slip size, decay of the ringing"
    confused_with = {
        "contact-damping": "free vibration of the block on its spring without contact",
        "tilt": "change the drive velocity: drag follows velocity, tilt follows force",
        "nonlinear-spring": "calibrate the spring with weights",
        "velocity-weakening": "velocities far above the slip's own",
    }
    source = "Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994) 1083"
    exponents = ("exponent",)
    family = "block"

    drag: Array = parameter(null=0.0, unit="N", lower=0.0, upper=0.05, symbol="F_1", doc="force at a speed of 1 mm/s")
    exponent: Array = parameter(
        1.0, unit="1", lower=0.3, upper=2.5, grid=(0.5, 1.0, 2.0), symbol="q",
        doc="power of the speed; at 1 it is the damping of the base model",
    )  # fmt: skip

    def force(self, state: Any, motion: Motion, contact: Contact) -> Array:
        squared = (motion.v**2 + SLOW**2) / SPEED**2
        return -self.drag * (motion.v / SPEED) * squared ** (0.5 * (self.exponent - 1.0))
