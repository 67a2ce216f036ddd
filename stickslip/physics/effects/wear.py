"""Friction or the contacts' shape that drifts with the distance travelled."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter, variant
from .base import Contact, Memory, Motion, Stiffness, Threshold
from .catalogue import register

LEAST = 0.01  # of what drifts, that always remains


@register
class Wear(Memory, Threshold, Stiffness):
    """Caps, or thresholds at constant caps, change by a factor 1 + eps g with the path s (never below a hundredth).

    g = s/s_1, ln(1 + s/s_1) or 1 - exp(-s/s_1).
    """

    tag = "wear"
    summary = "run-in: friction or thresholds drift with the accumulated slip"
    equation = (
        r"\mu \to \mu\,w \;\mathrm{or}\; u_i \to u_i\,w,\; k_i \to k_i/w,"
        r"\quad w = \max(1 + \varepsilon g,\, 0.01),"
        r"\quad g = s/s_1 \;\mathrm{or}\; \ln(1 + s/s_1) \;\mathrm{or}\; 1 - e^{-s/s_1},"
        r"\quad \dot s = |\dot x|,\quad s(0) = 0"
    )
    symbols = {
        "s": "path of the block (m)",
        "g": "course of the change with the path",
        "w": "factor on what drifts",
    }
    signature = "monotone drift of slip size and recurrence (or of creep) with accumulated slip, not with time"
    confused_with = {
        "position-dependent-friction": "go back over the same track",
        "roll-off": "profilometry before and after",
        "contact-ageing": "equal slip with and without holds",
    }
    source = "Archard, J. Appl. Phys. 24 (1953) 981; Blau, Wear 71 (1981) 29 (running-in)"
    family = "friction"

    drift: Array = parameter(
        null=0.0, unit="1", lower=-0.5, upper=0.5, symbol=r"\varepsilon",
        doc="relative change over the path s_1 (logarithmic: per e-fold beyond it)"
    )  # fmt: skip
    path: Array = parameter(
        1e-3, unit="m", lower=1e-5, upper=1.0, log=True, grid=(1e-4, 1e-3, 1e-2), symbol="s_1",
        doc="path over which it changes"
    )  # fmt: skip
    changes: str = variant("friction", ("friction", "thresholds"), "what drifts: the caps, or u_max at constant caps")
    course: str = variant("linear", ("linear", "logarithmic", "saturating"), "how it goes on with the path")

    def formula(self) -> str:
        drifts = {"friction": r"\mu \to \mu\,w", "thresholds": r"u_i \to u_i\,w,\quad k_i \to k_i/w"}
        courses = {"linear": "s/s_1", "logarithmic": r"\ln(1 + s/s_1)", "saturating": "1 - e^{-s/s_1}"}
        return (
            rf"{drifts[self.changes]},\quad w = \max(1 + \varepsilon g,\, {LEAST:g}),\quad g = {courses[self.course]},"
            r"\quad \dot s = |\dot x|,\quad s(0) = 0"
        )

    def start(self, bank: Bank) -> Array:
        return jnp.zeros(())

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return state + motion.path

    def strength(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return self._factor(state) if self.changes == "friction" else jnp.ones(())

    def stiffness(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return 1.0 / self._factor(state) if self.changes == "thresholds" else jnp.ones(())

    def _factor(self, state: Array) -> Array:
        s = state / self.path
        grown = {"linear": lambda: s, "logarithmic": lambda: jnp.log1p(s), "saturating": lambda: -jnp.expm1(-s)}
        return jnp.maximum(1.0 + self.drift * grown[self.course](), LEAST)
