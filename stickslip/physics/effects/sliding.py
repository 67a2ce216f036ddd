"""What an effect may want to know of the elements within an increment: their caps, their forces, who slides how far."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from .base import Contact, Motion


def filled(value: Array) -> Array:
    """``value`` with ones where it is zero: a divisor for elements that hold no spring."""
    return jnp.where(value > 0.0, value, 1.0)


def element_forces(contact: Contact, motion: Motion, cap: Array) -> Array:
    """Force of every element (N) at the end of the increment if its cap stayed as it is, shape (n,)."""
    force = jnp.clip(contact.force + contact.stiffness * motion.turn, -cap, cap)
    return jnp.clip(force + contact.stiffness * (motion.dx - motion.turn), -cap, cap)


def slid(contact: Contact, motion: Motion, cap: Array) -> Array:
    """Way (m) that the block makes within the increment while the element is at its cap, shape (n,), 0 ... path."""
    stiffness = filled(contact.stiffness)
    reach = cap / stiffness
    out = contact.force / stiffness + motion.turn
    back = jnp.clip(out, -reach, reach) + (motion.dx - motion.turn)
    way = jnp.maximum(abs(out) - reach, 0.0) + jnp.maximum(abs(back) - reach, 0.0)
    return jnp.where(contact.stiffness > 0.0, jnp.minimum(way, motion.path), 0.0)
