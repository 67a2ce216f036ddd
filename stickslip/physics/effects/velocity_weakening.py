"""Stribeck's law: strength that falls with the momentary velocity."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from ..params import parameter, variant
from .base import Contact, Motion, Threshold
from .catalogue import register
from .quantiles import powered

ROUNDING = 1e-6  # (v/v_s)^2 below which the law is quadratic, so that its derivative stays finite at rest


@register
class VelocityWeakening(Threshold):
    """All caps fall at once with velocity; implicit in the end velocity."""

    tag = "velocity-weakening"
    summary = "friction falls with the momentary velocity (Stribeck)"
    equation = (
        r"\mu \to \mu\,[1 - \varepsilon\,(1 - e^{-s})] \;\mathrm{or}\; \mu\,[1 - \varepsilon\,s/(1 + s)],"
        r"\quad s = (\dot x^2/v_s^2 + 10^{-6})^{q/2} - 10^{-3q}"
    )
    symbols = {"s": "power of the velocity, rounded at rest"}
    signature = "slip size, recurrence, how abruptly a slip begins; creep only near v_s and above"
    confused_with = {
        "residual-load": "lift the block off before an event",
        "sensor-low-pass": "tap the block: the sensor's bandwidth is known",
        "contact-ageing": "holds of 1 s and 25 s",
        "viscous-drag": "velocities far above the slip's own",
    }
    source = "Stribeck (1902); Bo & Pavelescu, Wear 82 (1982) 277; Armstrong-Helouvry et al., Automatica 30 (1994) 1083"
    exponents = ("exponent",)
    family = "friction"

    drop: Array = parameter(
        null=0.0, unit="1", lower=-0.3, upper=0.5, usual=(0.0, 0.4), symbol=r"\varepsilon",
        doc="share of the strength that velocity takes"
    )  # fmt: skip
    velocity: Array = parameter(
        1e-3, unit="m/s", lower=1e-6, upper=1e-1, usual=(1e-6, 1e-2), log=True, grid=(1e-4, 1e-3, 1e-2), symbol="v_s",
        doc="velocity over which strength falls"
    )  # fmt: skip
    exponent: Array = parameter(
        1.0, unit="1", lower=0.3, upper=3.0, grid=(0.5, 1.0, 2.0), symbol="q", doc="power of the velocity"
    )
    form: str = variant("exponential", ("exponential", "hyperbolic"), "1 - exp(-s) or s/(1 + s) with s = (v/v_s)^q")

    def formula(self) -> str:
        fall = "(1 - e^{-s})" if self.form == "exponential" else "s/(1 + s)"
        return rf"\mu \to \mu\,[1 - \varepsilon\,{fall}],\quad s = (\dot x^2/v_s^2 + 10^{{-6}})^{{q/2}} - 10^{{-3q}}"

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        squared = (motion.v / self.velocity) ** 2 + ROUNDING
        s = powered(squared, 0.5 * self.exponent) - ROUNDING ** (0.5 * self.exponent)
        return 1.0 - self.drop * (-jnp.expm1(-s) if self.form == "exponential" else s / (1.0 + s))
