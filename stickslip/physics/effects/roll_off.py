"""Roughness without long waves: gaps with an exponential tail."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from .base import Geometry
from .catalogue import register
from .quantiles import share, sticking_shares, towards


@register
class RollOff(Geometry):
    """The backbone is led towards 1 - exp(-u/u_c), u_c = F_s/k, that of exponentially distributed gaps.

    A line much longer than its longest wave has many independent summits, whose load grows as exp(depth/length).
    """

    tag = "roll-off"
    summary = "no roughness beyond a longest wave: exponentially distributed gaps"
    equation = (
        r"u_i \to (1-\varepsilon)\,u_i - \varepsilon\,\frac{F_s}{k}\,\ln Q_i,\quad k = \sum_i k_i,"
        r"\quad Q_i = \sum_{u_j > u_i} k_j/k"
    )
    symbols = {
        "k": "stiffness of all elements together (N/m)",
        "Q_i": "share of the stiffness that still sticks when the element slides (ln Q_i: its mean over the element)",
    }
    signature = "the backbone becomes exponential: creep velocity as 1/(time to slip), longer tail"
    confused_with = {
        "slip-weakening": "profilometry; the slowest drive",
        "unequal-contacts": "turn the block in its guide",
        "wear": "profilometry before and after",
        "rate-and-state": "velocity steps in steady sliding",
    }
    source = "Greenwood & Williamson, Proc. R. Soc. A 295 (1966) 300; Persson, Phys. Rev. Lett. 99 (2007) 125502"
    family = "geometry"

    share: Array = share("how far the distribution of thresholds is exponential")

    def reshape(self, bank: Bank) -> Bank:
        before, after = sticking_shares(bank)
        width = before - after
        # mean of -ln Q over the element
        mean = 1.0 - (_x_log_x(before) - _x_log_x(after)) / jnp.where(width > 0.0, width, 1.0)
        return towards(bank, bank.total_strength / bank.total_stiffness * mean, self.share)


def _x_log_x(x: Array) -> Array:
    positive = x > 0.0
    return jnp.where(positive, x * jnp.log(jnp.where(positive, x, 1.0)), 0.0)
