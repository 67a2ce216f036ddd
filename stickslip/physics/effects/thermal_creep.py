"""Stuck elements that give way by thermally activated jumps."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from ..params import parameter
from .base import Contact, Flow, Motion
from .catalogue import register
from .sliding import filled


@register
class ThermalCreep(Flow):
    """Eyring's flow under the force of each element, solved in closed form over the increment.

    With ``y = f/(alpha cap)`` the force obeys ``y' = -R sinh(y)``, whose solution is a shift of ``ln coth(y/2)``. It is
    written as a difference that is exact for ``R = 0`` and holds its digits where the activation factor is 1e-44.
    Loading at constant velocity within the increment is included (exactly where ``y`` is large).
    """

    tag = "thermal-creep"
    summary = "stuck contacts creep by thermally activated jumps"
    equation = r"\dot f_i \to \dot f_i - 2\,k_i\,v_1\,e^{-1/\alpha}\,\sinh\left(f_i/(\alpha\,C_i)\right)"
    signature = "creep goes on with the drive stopped, as the logarithm of time"
    confused_with = {
        "sensor-drift": "holds at several loads: creep depends on load, drift does not; a reference beam",
        "viscoelastic-contact": "long holds: logarithmic against exponential relaxation",
        "sensor-high-pass": "a step of known size on the sensor",
        "base-vibration": "spectrum with the drive off",
    }
    source = "Eyring, J. Chem. Phys. 4 (1936) 283; Yang, Zhang & Marder, PNAS 105 (2008) 13264"
    family = "contact"

    velocity: Array = parameter(
        null=0.0, unit="m/s", lower=0.0, upper=1e-6, usual=(0.0, 1e-7), symbol="v_1",
        doc="slip velocity of an element that is just below its cap"
    )  # fmt: skip
    activation: Array = parameter(
        0.03, unit="1", lower=0.01, upper=0.1, log=True, grid=(0.02, 0.05), symbol=r"\alpha",
        doc="thermal energy over the work of the cap in one jump"
    )  # fmt: skip

    def flow(self, state: Any, motion: Motion, force: Array, contact: Contact) -> Array:
        scale = self.activation * filled(contact.cap)
        per = 1.0 / scale
        y = jnp.clip(force * per, -1.0 / self.activation, 1.0 / self.activation)
        rate = 2.0 * self.velocity * jnp.exp(-1.0 / self.activation) * contact.stiffness * per
        gone = -jnp.expm1(-rate * motion.dt * _loading(contact.stiffness * motion.dx * per * jnp.tanh(y)))
        grown, kept = jnp.exp(y), 2.0 - gone
        return force - scale * jnp.log(grown * (kept + gone * grown) / (gone + kept * grown))


def _loading(rise: Array) -> Array:
    """Mean over the increment of e^y over its value at the end, when y rises linearly by ``rise``."""
    z = jnp.clip(rise, -30.0, 30.0)
    small = abs(z) < 1e-4
    safe = jnp.where(small, 1.0, z)
    return jnp.where(small, 1.0 - 0.5 * z, -jnp.expm1(-safe) / safe)
