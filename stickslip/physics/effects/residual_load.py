"""Contacts that lose part of their tangential load when a slip comes to rest."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Contact, Flow, Memory, Motion
from .catalogue import register


class Mobility(NamedTuple):
    """Share of the contacts that a slip has set in motion, and how much of it came to rest in the last increment."""

    moving: Array
    settled: Array


@register
class ResidualLoad(Memory, Flow):
    """A slip sets the contacts in motion (over a slip length); as they stick again they settle and shed load.

    The forces fall by exp(-lambda) per unit of mobility lost, with exp(-lambda) = 1 - eps: after a slip much longer
    than the length all elements keep the share 1 - eps. Creep to a slip and sliding shed nothing.
    """

    tag = "residual-load"
    summary = "contacts keep only part of their tangential load when a slip comes to rest"
    equation = (
        r"\dot f_i \to \dot f_i + f_i\,\ln(1-\varepsilon)\,\max(-\dot q, 0),"
        r"\quad \dot q = |\dot x|\,(1-q)/\ell - s\,q/\tau_a,\quad q(0) = 0"
    )
    symbols = {"q": "mobility of the contacts, 0 at rest and 1 in a slip", "s": "share of the strength that sticks"}
    signature = "creep of all events after the first grows towards that of a virgin contact; rebound and ringing change"
    confused_with = {
        "sensor-low-pass": "lift the block off before an event: the virgin creep is known then",
        "velocity-weakening": "lift the block off before an event",
        "contact-renewal": "slip size against slip distance: only renewal weakens sliding contacts",
    }
    source = "Mindlin & Deresiewicz, J. Appl. Mech. 20 (1953) 327: the load history of a contact at rest"
    family = "contact"

    lost: Array = parameter(
        null=0.0, unit="1", lower=0.0, upper=0.98, symbol=r"\varepsilon",
        doc="share of every force that is lost as a slip comes to rest (1: virgin again)", ends=(0.98,)
    )  # fmt: skip
    slip_length: Array = parameter(
        1e-6, unit="m", lower=1e-8, upper=1e-4, log=True, symbol=r"\ell", doc="slip that sets the contacts in motion"
    )
    settling_time: Array = parameter(
        1e-3, unit="s", lower=1e-5, upper=0.1, log=True, grid=(2e-5, 2e-4, 2e-3), symbol=r"\tau_a",
        doc="time in which they come to rest", ends=(1e-5,)
    )  # fmt: skip

    def start(self, bank: Bank) -> Mobility:
        return Mobility(jnp.zeros(()), jnp.zeros(()))

    def advance(self, state: Mobility, motion: Motion, contact: Contact) -> Mobility:
        # the part at rest, 1 - q, is what relaxes with slip and grows with time
        trial = jnp.abs(contact.force + contact.stiffness * motion.dx)
        sticks = trial <= contact.cap * (1.0 + 1e-12)
        rate = jnp.sum(jnp.where(sticks, contact.strength, 0.0)) / jnp.sum(contact.strength) / self.settling_time
        moving = 1.0 - motion.relax(1.0 - state.moving, rate, rate, 1.0 / self.slip_length)
        return Mobility(moving, jnp.maximum(state.moving - moving, 0.0))

    def flow(self, state: Mobility, motion: Motion, force: Array, contact: Contact) -> Array:
        return force * jnp.exp(jnp.log1p(-self.lost) * state.settled)
