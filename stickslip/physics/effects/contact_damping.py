"""Damping inside the contact: a dashpot beside the spring of every stuck element."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from ..params import parameter
from .base import BodyForce, Contact, Motion
from .catalogue import register
from .sliding import element_forces, filled


@register
class ContactDamping(BodyForce):
    """A Kelvin element in every contact that sticks; one that slides does not drag."""

    tag = "contact-damping"
    summary = "stuck contacts damp motion like dashpots"
    equation = r"F = -\eta\,\dot x \sum_{|f_i| < C_i} k_i"
    symbols = {"F": "force on the block (N)"}
    signature = "ringing decays exponentially instead of hyperbolically; nothing in creep"
    confused_with = {
        "viscous-drag": "free vibration of the block on its spring without contact; slip against ring-down",
        "plasticity": "decay of the ringing at several amplitudes",
        "viscoelastic-contact": "ring-down with an added mass: another frequency",
        "curvature": "decay of the ringing at several amplitudes",
    }
    source = "Kelvin-Voigt contact: Johnson, Contact Mechanics (1985), sec. 6.5"
    family = "contact"

    time: Array = parameter(
        null=0.0, unit="s", lower=0.0, upper=1e-3, usual=(0.0, 3e-5), symbol=r"\eta",
        doc="damping of a stuck element over its stiffness"
    )  # fmt: skip

    def force(self, state: Any, motion: Motion, contact: Contact) -> Array:
        cap = filled(contact.cap)
        sticks = jnp.abs(element_forces(contact, motion, cap)) < (1.0 - 1e-9) * cap
        return -self.time * motion.v * jnp.sum(jnp.where(sticks, contact.stiffness, 0.0))
