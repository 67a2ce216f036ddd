"""Asperities that yield: the strongest elements carry no more than hardness allows."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Geometry
from .catalogue import register
from .quantiles import powered, scaled


@register
class Plasticity(Geometry):
    """Thresholds level off as they near the hardness limit; the load they lose is shared equally by all.

    ``hardness_ratio`` is what the deepest element would carry elastically over what hardness allows. The bank is that
    of a run-in contact: it has yielded in loading and is elastic from then on.
    """

    tag = "plasticity"
    summary = "asperities yield: a hardness limit blunts the distribution of thresholds"
    equation = r"c_i \to \nu\,c_i\,[1 + (h\,u_i/\max_j u_j)^n]^{-1/n},\quad \sum_i c_i = F_s"
    symbols = {r"\nu": "factor that keeps the full friction force"}
    signature = "blunted end of creep, many elements slide together: more sudden; changes with load"
    confused_with = {
        "unequal-contacts": "load series; first against repeated loading",
        "roll-off": "load series",
        "adhesion": "load series including light loads",
        "contact-damping": "decay of the ringing at several amplitudes",
    }
    source = "Bowden & Tabor, The Friction and Lubrication of Solids (1950); Kogut & Etsion, J. Tribol. 126 (2004) 34"
    family = "geometry"

    hardness_ratio: Array = parameter(
        null=0.0, unit="1", lower=0.0, upper=10.0, symbol="h",
        doc="elastic over plastic load of the deepest asperity"
    )  # fmt: skip
    sharpness: Array = parameter(
        1.0, unit="1", lower=1.0, upper=8.0, grid=(1.0, 4.0), symbol="n", doc="how abruptly asperities yield",
        ends=(1.0, 8.0)
    )  # fmt: skip

    def reshape(self, bank: Bank) -> Bank:
        load = self.hardness_ratio * bank.threshold / bank.threshold.max()
        # load**n with its slope at zero, which is not zero where n is one
        bend = jnp.where(load > 0.0, powered(load, self.sharpness - 1.0), jnp.where(self.sharpness > 1.0, 0.0, 1.0))
        return scaled(bank, powered(1.0 + load * bend, -1.0 / self.sharpness))
