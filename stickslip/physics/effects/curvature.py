"""A contact that is curved as a whole, besides its roughness."""

from __future__ import annotations

from jax import Array

from ..contact import Bank
from .base import Geometry
from .catalogue import register
from .quantiles import share, sticking_shares, towards


@register
class Curvature(Geometry):
    """The backbone is led towards Cattaneo and Mindlin's 1 - (1 - u/u_max)^1.5 of the same stiffness and strength.

    There a share Q = sqrt(1 - u/u_max) of the stiffness sticks at u, so u/u_max = 1 - Q^2, with u_max = 1.5 F_s/k.
    """

    tag = "curvature"
    summary = "macroscopic curvature of the contact"
    equation = (
        r"u_i \to (1-\varepsilon)\,u_i + \varepsilon\,\frac{3 F_s}{2 k}\,(1 - Q_i^2),\quad k = \sum_i k_i,"
        r"\quad Q_i = \sum_{u_j > u_i} k_j/k"
    )
    symbols = {
        "k": "stiffness of all elements together (N/m)",
        "Q_i": "share of the stiffness that still sticks when the element slides (Q_i^2: its mean over the element)",
    }
    signature = "the exponent of the backbone falls towards 1.5: softer start, earlier end of creep"
    confused_with = {
        "machine-compliance": "load series: the exponent of a curved contact changes with load",
        "sensor-drift": "change the drive velocity: curvature follows force, drift the clock",
        "roll-off": "load series",
        "contact-damping": "decay of the ringing at several amplitudes",
    }
    source = "Cattaneo (1938); Mindlin, J. Appl. Mech. 16 (1949) 259"
    family = "geometry"

    share: Array = share("how far the distribution of thresholds is that of a smooth sphere")

    def reshape(self, bank: Bank) -> Bank:
        before, after = sticking_shares(bank)
        squared = (before**2 + before * after + after**2) / 3.0  # mean of Q^2 over the element
        return towards(bank, 1.5 * bank.total_strength / bank.total_stiffness * (1.0 - squared), self.share)
