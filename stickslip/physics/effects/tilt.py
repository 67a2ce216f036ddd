"""Normal load changed by a tangential force whose line of action lies off the contact plane."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from ..params import parameter, variant
from .base import Contact, Motion, Threshold
from .catalogue import register


@register
class Tilt(Threshold):
    """The load changes in proportion to a force: a pull that is inclined, or off the plane of the contacts.

    The contact's own force at the end of an increment would make the caps implicit in themselves. It is taken as its
    start plus the change of the spring's force: second order while the block creeps, where the two are equal up to the
    inertia, and one (short) step behind in a slip.
    """

    tag = "tilt"
    summary = "normal load changes in proportion to the tangential force (pull line off the contact plane)"
    equation = r"C_i \to C_i\,[1 + \kappa\,F_{\mathrm{spring}}/F_s] \;\mathrm{or}\; C_i\,[1 + \kappa\sum_j f_j/F_s]"
    signature = "strength depends on the load at the time of slip: slip size and the recurrence of the first event"
    confused_with = {
        "nonlinear-spring": "move the height at which the spring is attached: tilt changes sign with it",
        "viscous-drag": "change the drive velocity: drag follows velocity, tilt follows force",
        "machine-compliance": "hold at half load: tilt leaves the creep's shape alone",
    }
    source = "Oden & Martins, Comput. Methods Appl. Mech. Eng. 52 (1985) 527: coupling of normal and tangential motion"
    family = "contact"

    coupling: Array = parameter(
        null=0.0, unit="1", lower=-0.3, upper=0.3, usual=(-0.1, 0.1), symbol=r"\kappa",
        doc="relative change of the normal load at the full friction force"
    )  # fmt: skip
    by: str = variant("spring", ("spring", "contact"), "the force that tilts: of the driving spring, or of the contact")

    def formula(self) -> str:
        force = r"F_{\mathrm{spring}}" if self.by == "spring" else r"\sum_j f_j"
        return rf"C_i \to C_i\,[1 + \kappa\,{force}/F_s]"

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        if self.by == "spring":
            force = motion.pull
        else:
            force = jnp.sum(contact.force) + (motion.pull - contact.spring_force)
        return 1.0 + self.coupling * force / jnp.sum(contact.strength)
