"""Elements that relax: a standard linear solid in place of each spring."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter, variant
from .base import Contact, Flow, Memory, Motion
from .catalogue import register
from .sliding import filled


class Branch(NamedTuple):
    """Maxwell branches at the start of the last increment, and what that increment does to them.

    Attributes:
        force: of every branch (N), shape (n,).
        deflection: of every element (m), shape (n,).
        kept: share of a branch force that survives the increment.
        taken: share of a branch's elastic increment that survives it.
        moved: displacement of the block (m).
    """

    force: Array
    deflection: Array
    kept: Array
    taken: Array
    moved: Array


@register
class ViscoelasticContact(Memory, Flow):
    """Spring and Maxwell branch side by side, their sum limited by the cap.

    ``share`` of the instantaneous stiffness lies in the branch. An element at its cap keeps its deflection, so its
    branch relaxes while it slides (``kept``); where sliding replaces the contacts, the fresh ones are loaded quickly
    and their branch carries its ``share`` again (``renewed``, over a slip distance). Deflection and branch are found
    from the force that the cap has left, so no order of relaxing and sliding has to be assumed.
    """

    tag = "viscoelastic-contact"
    summary = "the contact's stiffness relaxes with time"
    equation = (
        r"f_i = (1-g)\,k_i\,\delta_i + h_i,"
        r"\quad \dot h_i = g\,k_i\,\dot\delta_i - h_i/\tau"
        r" \;\left[+\,(g f_i - h_i)\,|\dot x - \dot\delta_i|/\ell\ \mathrm{where\ renewed}\right]"
    )
    symbols = {
        r"\delta_i": "deflection of an element: its rate is that of the block while the element sticks (m)",
        "h_i": "force of its Maxwell branch (N)",
    }
    signature = "exponential relaxation after arrest and in holds; creep too large for the ring frequency"
    confused_with = {
        "thermal-creep": "long holds: exponential against logarithmic relaxation",
        "machine-compliance": "a hold: the fixture has settled, the contact relaxes on",
        "sensor-drift": "a hold at no load",
        "contact-damping": "amplitude and frequency of ringing with an added mass",
        "direct-effect": "a hold at half load",
    }
    source = "Popov, Contact Mechanics and Friction (2010), ch. 15: standard linear solid"
    family = "contact"

    share: Array = parameter(
        null=0.0, unit="1", lower=0.0, upper=0.5, usual=(0.0, 0.1), symbol="g",
        doc="share of the stiffness that relaxes"
    )  # fmt: skip
    time: Array = parameter(
        0.1, unit="s", lower=2e-3, upper=100.0, log=True, grid=(0.01, 0.1, 1.0), symbol=r"\tau", doc="relaxation time"
    )
    renewal_distance: Array = parameter(
        1e-6, unit="m", lower=1e-8, upper=1e-4, log=True, symbol=r"\ell", doc="slip over which contacts are replaced"
    )
    sliding: str = variant("renewed", ("renewed", "kept"), "whether sliding brings fresh, not yet relaxed contacts")

    def formula(self) -> str:
        fresh = r" + (g f_i - h_i)\,|\dot x - \dot\delta_i|/\ell" if self.sliding == "renewed" else ""
        return rf"f_i = (1-g)\,k_i\,\delta_i + h_i,\quad \dot h_i = g\,k_i\,\dot\delta_i - h_i/\tau{fresh}"

    def start(self, bank: Bank) -> Branch:
        zero = jnp.zeros_like(bank.stiffness)
        one = jnp.ones(())
        return Branch(zero, zero, one, one, jnp.zeros(()))

    def advance(self, state: Branch, motion: Motion, contact: Contact) -> Branch:
        force, deflection = self._resolve(state, contact)
        ratio = motion.dt / self.time
        return Branch(force, deflection, jnp.exp(-ratio), -jnp.expm1(-ratio) / ratio, motion.dx)

    def flow(self, state: Branch, motion: Motion, force: Array, contact: Contact) -> Array:
        branch_step = self.share * contact.stiffness * motion.dx
        return force - state.force * (1.0 - state.kept) - branch_step * (1.0 - state.taken)

    def _resolve(self, state: Branch, contact: Contact) -> tuple[Array, Array]:
        """Branch force (N) and deflection (m) now, from those one increment ago and the force that the cap has left."""
        stiffness = filled(contact.stiffness)
        share, before = self.share, state.deflection
        total = stiffness * (1.0 - share + share * state.taken)
        deflection = (contact.force - state.force * state.kept + share * stiffness * state.taken * before) / total
        force = state.force * state.kept + share * stiffness * state.taken * (deflection - before)
        if self.sliding == "renewed":
            slip = abs(state.moved - (deflection - before))
            force = force - (share * contact.force - force) * jnp.expm1(-slip / self.renewal_distance)
        holds = contact.stiffness > 0.0
        deflection = (contact.force - force) / (stiffness * (1.0 - share))
        return jnp.where(holds, force, 0.0), jnp.where(holds, deflection, 0.0)
