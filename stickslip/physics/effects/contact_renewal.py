"""Junctions that break and are replaced by force-free ones while the block slides."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter
from .base import Contact, Flow, Memory, Motion, Threshold
from .catalogue import register
from .sliding import filled

YOUNG = 7  # classes of age below that at which a junction reaches its cap; one more holds all older ones


class Renewal(NamedTuple):
    """Share of a class that is replaced within an increment, and the mean share over the increment; shape (n,) each."""

    gone: Array
    fresh: Array


class Junctions(NamedTuple):
    """The classes of age of every element, youngest first.

    Attributes:
        spread: force (N) of each class less that of the element, shape (YOUNG + 1, n).
        change: force (N) that renewal takes from the element within the increment (negative: gives), shape (n,).
        deficit: share of the cap that the element cannot reach because its junctions are not all at their cap, (n,).
    """

    spread: Array
    change: Array
    deficit: Array


@register
class ContactRenewal(Memory, Threshold, Flow):
    """Each element stands for many junctions with exponentially distributed lives in slip, sorted by age into classes.

    While the block moves on, a class takes over the force of the next younger one, at a rate that gives it the mean age
    of its junctions; before the youngest stands a force-free newborn (McKendrick's equation in quantiles of age, solved
    class by class with exponentials). Every class has the element's cap. Steady sliding is exact: an element with
    threshold u_y carries (l/u_y)(1 - exp(-u_y/l)) of its cap. Junctions older than u_y are one class: a reversal
    by more than the threshold, longer than any rebound, mixes their forces.
    """

    tag = "contact-renewal"
    summary = "sliding junctions break and are replaced by force-free ones"
    equation = (
        r"f_i = \int_0^\infty g_i(a)\,e^{-a/\ell}\,da/\ell,"
        r"\quad \partial_t g_i + |\dot x|\,\partial_a g_i = k_i \dot x,\quad |g_i| \le C_i,\quad g_i(0) = 0"
    )
    symbols = {
        "g_i": "what the force of an element would be if all its junctions were of one age (N)",
        "a": "age of a junction, counted in slip (m)",
    }
    signature = "kinetic friction below static without weakening of the material, most for the deepest contacts"
    confused_with = {
        "velocity-weakening": "load series: the slip over which strength is lost scales with u_max",
        "residual-load": "lift the block off before an event",
        "slip-weakening": "load series: the slip over which strength is lost scales with u_max",
    }
    source = "Farkas, Dahmen & Wolf, J. Stat. Mech. (2005) P06015; Braun & Peyrard, Phys. Rev. Lett. 100 (2008) 125501"
    amplitude = "rate"
    family = "contact"

    rate: Array = parameter(
        0.0,
        unit="1/m",
        lower=0.0,
        upper=2e6,
        usual=(0.0, 1e6),
        null=0.0,
        symbol=r"1/\ell",
        doc="share of the junctions that break per metre of slip",
    )

    def start(self, bank: Bank) -> Junctions:
        zero = jnp.zeros_like(bank.stiffness)
        return Junctions(jnp.zeros((YOUNG + 1, bank.stiffness.size)), zero, zero)

    def advance(self, state: Junctions, motion: Motion, contact: Contact) -> Junctions:
        own = 1.0 - state.deficit
        cap = filled(contact.cap / filled(own))
        width = filled(contact.strength / filled(contact.stiffness)) / YOUNG  # of a young class, in age (m)
        dies, rates = _ages(width, self.rate)
        plain = contact.force + contact.stiffness * motion.dx  # with no renewal
        capped = jnp.clip(plain, -cap, cap)
        force = contact.force + state.spread
        youngest, young, oldest = (_renewal(rate * motion.path) for rate in rates)
        step = contact.stiffness * motion.dx

        # written as differences, so that they vanish exactly where the rate does
        def driven(renewal: Renewal, spread: Array, force: Array, younger: Array | float) -> Array:
            return plain + (spread - renewal.gone * (force - younger) - renewal.fresh * (step + younger))

        def aged(younger: Array, own: Array) -> tuple[Array, Array]:
            ended = jnp.clip(own + young.fresh * younger, -cap, cap)
            return ended, ended

        first = jnp.clip(driven(youngest, state.spread[0], force[0], 0.0), -cap, cap)
        last, middle = jax.lax.scan(aged, first, driven(young, state.spread[1:-1], force[1:-1], force[:-2]))
        last = jnp.clip(driven(oldest, state.spread[-1], force[-1], force[-2]) + oldest.fresh * last, -cap, cap)
        offs = jnp.concatenate([first[None], middle, last[None]]) - capped

        def joined(older: Array, off: Array) -> tuple[Array, None]:
            return older + dies * (off - older), None

        change, _ = jax.lax.scan(joined, offs[-1], offs[:-1], reverse=True)
        return Junctions(offs - change, -change, -change * capped / cap**2)

    def strength(self, state: Junctions, motion: Motion, contact: Contact) -> Array:
        return 1.0 - state.deficit

    def flow(self, state: Junctions, motion: Motion, force: Array, contact: Contact) -> Array:
        return force - state.change


def _ages(width: Array, rate: Array) -> tuple[Array, tuple[Array, ...]]:
    """Share of the junctions that die within a class (n,), and 1/(gap to the next younger class's mean age) (1/m).

    The rates are those of the youngest, of the other young ones, and of the oldest class.
    """
    x = width * rate
    small = x < 1e-2
    safe = jnp.where(small, 1.0, x)
    # mean age of a class after its youngest, in widths
    centre = jnp.where(small, 0.5 - x / 12.0 + x**3 / 720.0, 1.0 / safe - 1.0 / jnp.expm1(safe))
    oldest = rate / (1.0 + x * (1.0 - centre))
    return -jnp.expm1(-x), (1.0 / (width * centre), 1.0 / width, oldest)


def _renewal(z: Array) -> Renewal:
    """What an increment makes of a class whose junctions leave it at the rate z per increment."""
    gone = -jnp.expm1(-z)
    small = z < 1e-4
    return Renewal(gone, jnp.where(small, 0.5 * z - z**2 / 6.0, 1.0 - gone / jnp.where(small, 1.0, z)))
