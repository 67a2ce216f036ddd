"""Mass that moves with the block: the share of the driving spring that swings."""

from __future__ import annotations

from jax import Array

from ..params import parameter
from .base import Inertia
from .catalogue import register


@register
class AddedMass(Inertia):
    """The block's mass plus what moves with it; together with the block it turns the static model into the inertial."""

    tag = "inertia"
    summary = "inertia of the block, and of what moves with it (a third of a uniform spring's mass)"
    equation = r"m \to m\,(1 + \alpha)"
    signature = (
        "last milliseconds before a slip, slip duration (as the root of the mass) and frequency of the ring-down; "
        "nothing in creep"
    )
    confused_with = {
        "machine-compliance": "add a known mass: the ring-down frequency falls as its inverse root, the creep stays",
        "viscous-drag": "compare slip duration and overshoot: drag lowers the overshoot, mass does not",
    }
    source = "Rayleigh, The Theory of Sound 1 (1877): a uniform spring adds a third of its mass"
    family = "block"

    share: Array = parameter(
        null=0.0, unit="1", lower=0.0, upper=0.2, symbol=r"\alpha", doc="added mass as a share of the block's"
    )

    def mass(self, mass: Array) -> Array:
        return mass * (1.0 + self.share)
