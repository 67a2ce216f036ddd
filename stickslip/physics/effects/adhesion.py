"""Adhesion or a capillary meniscus: a load on every spring in contact, besides the elastic one."""

from __future__ import annotations

from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Geometry
from .catalogue import register


@register
class Adhesion(Geometry):
    """Every length in contact gets the same extra load, so the caps grow in proportion to the stiffness.

    The only geometric effect that changes the total strength: it adds the share ``attraction`` of it.
    """

    tag = "adhesion"
    summary = "attraction loads all contacting asperities equally"
    equation = r"c_i \to c_i + \varepsilon\,F_s\,k_i/\sum_j k_j,\quad F_s \to (1 + \varepsilon)\,F_s"
    signature = "friction at light load; nothing slides at first: stiffer, more sudden"
    confused_with = {
        "curvature": "load series including light loads; humidity",
        "plasticity": "load series including light loads; humidity",
    }
    source = "Derjaguin, Muller & Toporov, J. Colloid Interface Sci. 53 (1975) 314"
    family = "geometry"

    attraction: Array = parameter(
        null=0.0, unit="1", lower=0.0, upper=0.3, usual=(0.0, 0.01), symbol=r"\varepsilon",
        doc="adhesive over applied load (steel in air: below 0.01)"
    )  # fmt: skip

    def reshape(self, bank: Bank) -> Bank:
        extra = self.attraction * bank.total_strength / bank.total_stiffness
        return Bank(bank.stiffness, bank.strength + extra * bank.stiffness)
