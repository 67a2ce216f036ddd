"""What a slip event leaves behind: residual forces of the elements, the rebound, and the creep still available.

At the end of a slip all elements stand at their kinetic cap; the spring, which overshot, then pulls less than that, and
the bank draws the block back until both agree. Stiffly held elements keep most of their force: the contact is not
virgin when the next creep begins.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from ._ranges import check_within
from .bank import Bank


class Arrest(NamedTuple):
    """A contact at rest after a slip event.

    Fields:
        element_force: (n,) N.
        force: their sum, N.
        rebound: by how much the block was drawn back, m.
    """

    element_force: Array
    force: Array
    rebound: Array


def arrest_force(strength: ArrayLike, ratio: ArrayLike) -> Array:
    """Spring force in N after an undamped slip, 2 F_k - F_s: as far below kinetic friction as it began above it."""
    return jnp.asarray(strength) * (2.0 * ratio - 1.0)


def arrest(bank: Bank, ratio: ArrayLike, force: ArrayLike | None = None, kept: ArrayLike = 1.0) -> Arrest:
    """State of the bank after a slip event and the settling that follows.

    Args:
        bank: with its rested (static) strengths.
        ratio: kinetic over static friction, mu_k/mu_s, above 0 and at most 1.
        force: tangential force in N at which the block settles, from -F_k to F_k; default `arrest_force`.
        kept: share of the residual forces that survives, 1 full memory, 0 a virgin contact.

    Raises:
        InputError: a ratio or share out of its range, or a force beyond kinetic friction.
    """
    check_within("the ratio of kinetic to static friction", ratio, above=0.0, to=1.0, key="ratio")
    check_within("the share of residual force that is kept", kept, least=0.0, to=1.0, key="kept")
    kinetic = bank.strength * ratio
    settled = arrest_force(bank.total_strength, ratio) if force is None else jnp.asarray(force)
    check_within(
        "the force at arrest over kinetic friction", settled / jnp.sum(kinetic), least=-1.0, to=1.0, key="force"
    )
    rebound = loading_displacement(bank.stiffness, 2.0 * kinetic, jnp.sum(kinetic) - settled)
    element = jnp.maximum(kinetic - bank.stiffness * rebound, -kinetic) * kept
    return Arrest(element, jnp.sum(element), rebound)


def reload_displacement(bank: Bank, element_force: ArrayLike, load: ArrayLike) -> Array:
    """Displacement (m) from a state of the bank to a tangential force ``load`` (N), caps rested.

    The static creep curve of an event that starts from residual forces; ``load`` may have any shape, from the present
    force up to the total strength.
    """
    held = jnp.asarray(element_force)
    return loading_displacement(bank.stiffness, bank.strength - held, jnp.asarray(load) - jnp.sum(held))


@jax.jit
def loading_displacement(stiffness: Array, room: Array, target: ArrayLike) -> Array:
    """Displacement x (m) at which sum(min(stiffness x, room)) reaches ``target`` (N, any shape); exact, by one sort.

    Zero for a target at or below zero, the last threshold for one at or above sum(room).
    """
    empty = stiffness <= 0.0
    threshold = jnp.where(empty, 0.0, room / jnp.where(empty, 1.0, stiffness))
    order = jnp.argsort(threshold)
    ends = threshold[order]
    # stiffness left, and force reached, where each element begins to slide
    before = jnp.cumsum(stiffness[order][::-1])[::-1]
    reached = jnp.cumsum(before * jnp.diff(ends, prepend=0.0))
    wanted = jnp.maximum(jnp.asarray(target), 0.0)
    i = jnp.minimum(jnp.searchsorted(reached, wanted), ends.size - 1)
    slope = jnp.where(before[i] > 0.0, before[i], 1.0)
    return jnp.minimum(ends[i] + jnp.minimum(wanted - reached[i], 0.0) / slope, ends[-1])
