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

NODES = 24  # places of birth within the mean yield displacement
SLOTS = 144  # places that are kept, half of them on either side of the block
FAR = 1e3  # m, beyond any record


class Junctions(NamedTuple):
    """The junctions that have been replaced, and which of them have not slid since.

    Junctions of all elements are born at the same places, and the same share of them is left; how far back they have
    slid differs.

    Attributes:
        gap: between two places on a grid along the path (m), shape ().
        born: path along which those left were born, of all born up to a place (m): times the rate it is a share of an
            element's junctions; at the places around the block in their order, shape (SLOTS,).
        since: the same times the way of the block since (m^2), shape (SLOTS,).
        low, high: places (m) between which those of an element were born that have not slid since, shape (n,).
        kept: what of ``born`` lies between the two (m), shape (n,).
        spread: force (N) of all others, as that of a whole element, less that of the element, shape (n,).
        change: force (N) that renewal takes from the element within the increment (negative: gives), shape (n,).
        deficit: share of the cap that the element cannot reach because its junctions are not all at their cap, (n,).
    """

    gap: Array
    born: Array
    since: Array
    low: Array
    high: Array
    kept: Array
    spread: Array
    change: Array
    deficit: Array


@register
class ContactRenewal(Memory, Threshold, Flow):
    """Each element stands for many junctions with exponentially distributed lives in slip.

    A junction that is born carries no force; from then on it is a Jenkins element like any other, whose force is zero
    where it was born. Where those were born that are left is kept as a distribution along the path: the same for all
    elements, of which each has a part that has not slid since. What has reached its cap joins the junctions that slide,
    which stick and slide as one. So a rebound and the ringing after it, on whose path many junctions are replaced,
    leave each with the force of its own birth. Steady sliding carries (l/u_y)(1 - exp(-u_y/l)) of the cap. A reversal
    by more than the yield displacement mixes forces.
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
    family = "contact"

    rate: Array = parameter(
        null=0.0, unit="1/m", lower=0.0, upper=2e6, usual=(0.0, 1e6), symbol=r"1/\ell",
        doc="share of the junctions that break per metre of slip"
    )  # fmt: skip

    def start(self, bank: Bank) -> Junctions:
        zero = jnp.zeros_like(bank.stiffness)
        reach = bank.strength / filled(bank.stiffness)
        mean = jnp.sum(bank.strength * reach) / filled(jnp.sum(bank.strength))
        none, far = jnp.zeros(SLOTS), zero + FAR
        return Junctions(filled(mean) / NODES, none, none, -far, far, zero, zero, zero, zero)

    def advance(self, state: Junctions, motion: Motion, contact: Contact) -> Junctions:
        cap = filled(contact.cap / filled(1.0 - state.deficit))
        stiffness = filled(contact.stiffness)
        step = contact.stiffness * motion.dx
        capped = jnp.clip(contact.force + step, -cap, cap)
        left = jnp.exp(-self.rate * motion.path)
        born, since, first = _born(state, motion, self.rate, left)
        reach = cap / stiffness
        near = jnp.minimum(reach, state.gap)  # between two places births have a constant density
        low = jnp.clip(state.low, motion.x - reach, motion.x - near)
        high = jnp.clip(state.high, motion.x + near, motion.x + reach)
        kept, way = _between(born, since, motion.x, first, state.gap, low, high)
        old, others = left * (1.0 - self.rate * state.kept), 1.0 - self.rate * kept
        slid = jnp.clip(contact.force + state.spread + step, -cap, cap)
        # what joins them has slid as well, but those that a long reversal takes back
        sign = jnp.where(motion.dx == 0.0, jnp.sign(slid), jnp.sign(motion.dx))
        carried = old * slid + (others - old) * jnp.where(others > old, sign * cap, slid)
        change = carried + self.rate * contact.stiffness * way - capped
        spread = carried / others - capped - change
        return Junctions(state.gap, born, since, low, high, kept, spread, -change, -change * capped / cap**2)

    def strength(self, state: Junctions, motion: Motion, contact: Contact) -> Array:
        return 1.0 - state.deficit

    def flow(self, state: Junctions, motion: Motion, force: Array, contact: Contact) -> Array:
        return force - state.change


def _born(state: Junctions, motion: Motion, rate: Array, left: Array) -> tuple[Array, Array, Array]:
    """``born`` and ``since`` at the end of an increment, around its end, and the first of those places (gaps)."""
    gap, x, dx = state.gap, motion.x, motion.dx
    first, before = (jnp.floor(place / gap) - (SLOTS // 2 - 1) for place in (x, x - dx))
    moved = jnp.clip(first - before, -SLOTS, SLOTS).astype(int)

    def there(values: Array) -> Array:
        ends = jnp.full(SLOTS, values[0]), values, jnp.full(SLOTS, values[-1])
        return jax.lax.dynamic_slice(jnp.concatenate(ends), (SLOTS + moved,), (SLOTS,))

    born, since = there(state.born), there(state.since)
    behind = x - gap * (first + jnp.arange(SLOTS))  # of the block, the places
    # of the way of this increment, what lies before each place, and the block's way since then
    low, high = jnp.maximum(dx, 0.0), jnp.minimum(dx, 0.0)
    nearest = jnp.clip(behind, high, low)
    own = low - nearest
    share, mean = _lasting(rate * own)
    lasting = own * share * jnp.exp(-rate * jnp.minimum(jnp.abs(nearest), low))
    middle = jnp.where(dx < 0.0, -own * mean, nearest + own * mean)
    # what is longer than the straight way is spent near its end
    turned = (motion.path - jnp.abs(dx)) * jnp.clip(0.5 - behind / gap, 0.0, 1.0)
    return left * born + lasting + turned, left * (since + born * dx) + lasting * middle, first


def _between(
    born: Array, since: Array, x: Array, first: Array, gap: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """What of ``born`` (m) and ``since`` (m^2) lies between two places (m), shape (n,) each."""
    at = jnp.clip(jnp.concatenate([low, high]) / gap - first, 0.0, SLOTS - 1.0)
    cell = jnp.minimum(jnp.floor(at), SLOTS - 2.0)
    part, index = at - cell, cell.astype(int)
    rows = jnp.stack([born, since])
    (here, way), (there, there_way) = rows[:, index], rows[:, index + 1]
    # linear, and the parabola of births of a constant density
    total = here + part * (there - here)
    way = way + part * (there_way - way) + 0.5 * gap * part * (1.0 - part) * (there - here)
    n = low.size
    return total[n:] - total[:n], way[n:] - way[:n]


def _lasting(z: Array) -> tuple[Array, Array]:
    """Of what is born at a constant rate over a time z of its mean life: the share left, and its mean age over z."""
    small = z < 0.1
    safe = jnp.where(small, 1.0, z)
    share = jnp.where(small, 1.0 - z / 2.0 + z**2 / 6.0 - z**3 / 24.0 + z**4 / 120.0, -jnp.expm1(-safe) / safe)
    return share, jnp.where(small, 0.5 - z / 12.0 + z**3 / 720.0, 1.0 / safe - 1.0 / jnp.expm1(safe))
