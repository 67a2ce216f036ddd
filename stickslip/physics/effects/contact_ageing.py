"""Strength that grows with the logarithm of the contacts' age."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import first_age, parameter
from .base import Contact, Memory, Motion, Threshold
from .catalogue import register


@register
class ContactAgeing(Memory, Threshold):
    """The age grows with time and is lost over a slip distance; its logarithm strengthens all caps equally."""

    tag = "contact-ageing"
    summary = "contacts at rest grow stronger with the logarithm of time"
    equation = (
        r"\mu \to \mu\,[1 + \beta \ln(1 + \theta/t_0)],\quad \dot\theta = 1 - |\dot x|\,\theta/D,"
        r"\quad \theta(0) = \theta_1"
    )
    symbols = {r"\theta": "age of the contact (s)"}
    signature = "recurrence and slip size grow with hold time and with 1/v; the shape of creep stays"
    confused_with = {
        "rate-and-state": "velocity steps in steady sliding: ageing alone has no jump at the step",
        "velocity-weakening": "holds of 1 s and 25 s: only ageing remembers them",
        "nonlinear-spring": "holds at one elongation of the spring",
        "wear": "go back over the same track after a hold",
    }
    source = "Dieterich, J. Geophys. Res. 77 (1972) 3690; Baumberger & Caroli, Adv. Phys. 55 (2006) 279"
    family = "friction"

    rate: Array = parameter(
        null=0.0, unit="1", lower=-0.02, upper=0.05, usual=(0.0, 0.02), symbol=r"\beta",
        doc="relative growth of strength per e-fold of age"
    )  # fmt: skip
    onset_time: Array = parameter(
        0.03, unit="s", lower=1e-4, upper=10.0, usual=(1e-3, 1.0), log=True, grid=(3e-3, 0.03, 0.3), symbol="t_0",
        doc="age from which strength grows"
    )  # fmt: skip
    slip_distance: Array = parameter(
        1e-6, unit="m", lower=1e-8, upper=1e-4, log=True, grid=(3e-7, 3e-6), symbol="D",
        doc="slip over which the age is lost"
    )  # fmt: skip
    first_age: Array = first_age(10.0)

    def start(self, bank: Bank) -> Array:
        return self.first_age + jnp.zeros(())

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return motion.relax(state, 1.0, 0.0, 1.0 / self.slip_distance)

    def strength(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return 1.0 + self.rate * jnp.log1p(state / self.onset_time)
