"""Banks of Jenkins elements from contacts with a line and a load of their own."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from .bank import Bank, bank_from_backbone, default_edges
from .tangential import StaticContact


def bank_from_contact(contact: StaticContact, n: int = 128) -> Bank:
    """Bank of n elements on the backbone of contacts in parallel (all leading axes of ``contact`` are summed)."""
    lead = contact.indentation.gaps.shape[:-1]
    contacts = tuple(range(-len(lead), 0))

    def backbone(u: Array) -> Array:
        return jnp.sum(contact.force(jnp.reshape(u, (-1,) + (1,) * len(lead))), axis=contacts)

    return bank_from_backbone(backbone, jnp.max(contact.u_max), default_edges(n))
