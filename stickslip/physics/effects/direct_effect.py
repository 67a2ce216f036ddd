"""Strength that rises with the logarithm of the momentary slip velocity."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from ..params import parameter, variant
from .base import Contact, Motion, Threshold
from .catalogue import register


@register
class DirectEffect(Threshold):
    """Thermally activated shear of the junctions: an instantaneous function of the velocity, static far below v*.

    All sliding elements move with the block, so one factor holds for all; it is implicit in the end velocity.
    """

    tag = "direct-effect"
    summary = "friction of sliding contacts rises with the logarithm of velocity"
    equation = (
        r"\mu \to \mu\,[1 + a\,\Lambda],"
        r"\quad \Lambda = \ln(1 + |\dot x|/v^*) \;\mathrm{or}\; \mathrm{asinh}\left(|\dot x|/(2 v^*)\right)"
    )
    symbols = {r"\Lambda": "logarithm of the velocity, zero at rest"}
    signature = "creep slows where velocity rises; creep and recurrence shift with the logarithm of the drive velocity"
    confused_with = {
        "unequal-contacts": "drive velocities that differ by a factor of ten",
        "slip-weakening": "the slowest drive: rate effects vanish, slip effects stay",
        "rate-and-state": "velocity steps: the jump decays over a slip distance",
        "viscoelastic-contact": "a hold at half load: only the viscoelastic contact relaxes",
    }
    source = "Dieterich, J. Geophys. Res. 84 (1979) 2161; Baumberger, Berthoud & Caroli, Phys. Rev. B 60 (1999) 3928"
    family = "friction"

    strengthening: Array = parameter(
        null=0.0, unit="1", lower=-0.01, upper=0.1, symbol="a",
        doc="relative growth of friction per e-fold of velocity"
    )  # fmt: skip
    cutoff_velocity: Array = parameter(
        1e-8, unit="m/s", lower=1e-10, upper=1e-4, usual=(1e-9, 1e-7), log=True, grid=(1e-9, 1e-8, 1e-7), symbol="v^*",
        doc="velocity below which friction is static"
    )  # fmt: skip
    form: str = variant("shifted", ("shifted", "asinh"), "ln(1 + v/v*), or asinh(v/(2 v*)) of forward and back jumps")

    def formula(self) -> str:
        rise = r"\ln(1 + |\dot x|/v^*)" if self.form == "shifted" else r"\mathrm{asinh}\left(|\dot x|/(2 v^*)\right)"
        return rf"\mu \to \mu\,[1 + a\,{rise}]"

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        ratio = abs(motion.v) / self.cutoff_velocity
        rise = jnp.log1p(ratio) if self.form == "shifted" else jnp.arcsinh(0.5 * ratio)
        return 1.0 + self.strengthening * rise
