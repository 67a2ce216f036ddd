"""Several contacts with different loads or different roughness."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..contact import Bank, normal_scores
from ..params import parameter
from .base import Geometry
from .catalogue import register

CONTACTS = 4


@register
class UnequalContacts(Geometry):
    """The elements are dealt in turn to four equally loaded contacts, whose thresholds are stretched by exp(spread z).

    The z are normal scores of mean zero. The curve is even in the spread: no effect of first order at zero. They are
    four whatever the rig has; where it has one, a diagnosis does not try it.
    """

    tag = "unequal-contacts"
    summary = "the contacts differ in the displacement at which they slide"
    equation = r"u_i \to u_i\,e^{\sigma z_{j(i)}},\quad k_i \to k_i\,e^{-\sigma z_{j(i)}}"
    symbols = {"z_{j(i)}": "normal score of the one of four contacts that the element belongs to"}
    signature = "longer tail at the end of creep, like a smaller Hurst exponent"
    confused_with = {
        "direct-effect": "drive velocities that differ by a factor of ten",
        "plasticity": "load one contact more than the others",
        "roll-off": "turn the block in its guide",
    }
    source = "Grzemba, Phys. Mesomech. 17 (2014) 39: four contacts, one fitted"
    family = "geometry"

    spread: Array = parameter(
        null=0.0, unit="1", lower=0.0, upper=0.6, symbol=r"\sigma",
        doc="rms over the contacts of the logarithm of their largest threshold"
    )  # fmt: skip

    def reshape(self, bank: Bank) -> Bank:
        score = np.resize(normal_scores(CONTACTS), bank.stiffness.size)
        return Bank(bank.stiffness * jnp.exp(-self.spread * score), bank.strength)
