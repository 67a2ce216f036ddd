"""A fixture that gives way more under force of one sign than under that of the other."""

from __future__ import annotations

from typing import Any

from jax import Array

from ..params import parameter
from .base import Motion, Sensor
from .catalogue import register


@register
class UnevenCompliance(Sensor):
    """Part of the reading is deflection of the fixture, whose stiffness changes in proportion to the force.

    That of a leaf spring that is bent already, a joint with play on one side, a mount off the line of force.
    The linear part of the deflection is :class:`~.machine_compliance.MachineCompliance`.
    """

    tag = "uneven-compliance"
    summary = "the fixture is more compliant in one direction"
    equation = r"y \to y + \beta\,\left(\sum_i f_i\right)^2"
    signature = "loops of force against displacement that are no longer the same when turned by half a turn"
    confused_with = {
        "tilt": "turn the sample round: what belongs to the track turns with it",
        "position-dependent-friction": "a longer stroke: what belongs to the track does not follow the turning point",
        "machine-compliance": "loops about zero force: a linear fixture leaves them symmetric",
    }
    source = "Nayfeh & Mook, Nonlinear Oscillations (1979), ch. 4 (quadratic stiffness)"
    family = "sensor"
    both_ways = True

    bend: Array = parameter(
        null=0.0, unit="m/N^2", lower=-1e-4, upper=1e-4, symbol=r"\beta", doc="deflection over force squared"
    )

    def read(self, state: Any, reading: Array, motion: Motion, contact_force: Array) -> Array:
        return reading + self.bend * contact_force**2
