"""Frictional heat that softens the contacts."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Contact, Memory, Motion, Threshold
from .catalogue import register


@register
class FlashHeating(Memory, Threshold):
    """The rise in temperature is the frictional power, averaged over a thermal time; strength falls with it.

    The thermal resistance of four contacts of 10 um is some 250 K/W, steel loses about 0.1 % of its shear strength per
    kelvin: 0.25/W. A softening above 1/W is not plausible; a slip at 5 mm/s heats with 1 mW, so nothing is expected.
    """

    tag = "flash-heating"
    summary = "frictional heat softens the contacts"
    equation = r"\mu \to \mu\,e^{-\chi P},\quad \tau\,\dot P = F_s|\dot x| - P,\quad P(0) = 0"
    symbols = {"P": "frictional power, averaged over the thermal time (W)"}
    signature = "none expected at these speeds; else kinetic friction falls with the power of the slip"
    confused_with = {
        "velocity-weakening": "another ambient temperature; another load at the same velocity",
        "viscous-drag": "another ambient temperature",
    }
    source = "Archard, Wear 2 (1959) 438; Rice, J. Geophys. Res. 111 (2006) B05311"
    family = "friction"

    softening: Array = parameter(
        null=0.0, unit="1/W", lower=-1.0, upper=1.0, symbol=r"\chi",
        doc="relative loss of strength per watt: softening per kelvin times thermal resistance"
    )  # fmt: skip
    time: Array = parameter(
        1e-3, unit="s", lower=1e-6, upper=10.0, log=True, grid=(1e-5, 1e-3, 0.1), symbol=r"\tau",
        doc="thermal time of the contacts"
    )  # fmt: skip

    def start(self, bank: Bank) -> Array:
        return jnp.zeros(())

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        ratio = motion.dt / self.time
        power = jnp.sum(contact.strength) * motion.path / motion.dt
        return state * jnp.exp(-ratio) - power * jnp.expm1(-ratio)

    def strength(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return jnp.exp(-self.softening * state)
