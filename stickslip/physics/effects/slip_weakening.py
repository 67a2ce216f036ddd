"""Elements that lose strength with the distance they slide."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Contact, Memory, Motion, Threshold
from .catalogue import register
from .sliding import slid


@register
class SlipWeakening(Memory, Threshold):
    """Each element counts the block's way while it slides and forgets it over the way it makes stuck.

    Counting the block's way instead of the slider's keeps an element from snapping back within itself. There is no
    clock in the law: the static limit stays as the drive slows down. Sticking again (rebound, ringing, growing caps)
    restores the strength.
    """

    tag = "slip-weakening"
    summary = "each contact weakens with the distance it has slid since it last stuck"
    equation = (
        r"C_i \to C_i\,[1 - \varepsilon\,(1 - e^{-s_i/D_s})],"
        r"\quad \dot s_i = |\dot x|\ \mathrm{(sliding)}\;\mathrm{or}\; -|\dot x|\,s_i/\ell_h\ \mathrm{(stuck)},"
        r"\quad s_i(0) = 0"
    )
    symbols = {"s_i": "way an element has slid since it last stuck (m)"}
    signature = "creep accelerates earlier and slip begins below full strength, however slow the drive"
    confused_with = {
        "direct-effect": "the slowest drive: slip effects stay, rate effects vanish",
        "velocity-weakening": "the slowest drive: slip effects stay, rate effects vanish",
        "roll-off": "load series",
    }
    source = "Ida, J. Geophys. Res. 77 (1972) 3796; Palmer & Rice, Proc. R. Soc. A 332 (1973) 527"
    family = "friction"

    drop: Array = parameter(
        null=0.0, unit="1", lower=-0.2, upper=0.5, usual=(0.0, 0.4), symbol=r"\varepsilon",
        doc="share of the strength that sliding takes"
    )  # fmt: skip
    distance: Array = parameter(
        5e-7, unit="m", lower=2e-8, upper=2e-5, usual=(5e-8, 5e-6), log=True, grid=(1e-7, 5e-7, 2e-6), symbol="D_s",
        doc="slip over which strength is lost"
    )  # fmt: skip
    recovery_distance: Array = parameter(
        2e-8, unit="m", lower=1e-9, upper=1e-6, log=True, symbol=r"\ell_h",
        doc="way made stuck over which strength returns"
    )  # fmt: skip

    def start(self, bank: Bank) -> Array:
        return jnp.zeros_like(bank.stiffness)

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        way = slid(contact, motion, contact.cap)
        return state * jnp.exp(-(motion.path - way) / self.recovery_distance) + way

    def strength(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return self._factor(state)

    def _factor(self, slip: Array) -> Array:
        return 1.0 + self.drop * jnp.expm1(-slip / self.distance)
