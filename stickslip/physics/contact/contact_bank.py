"""Banks of Jenkins elements from contacts with a line and a load of their own."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from .bank import Bank, bank_from_backbone, default_edges
from .tangential import StaticContact, checked_contact


def bank_from_contact(contact: StaticContact, n: int = 128) -> Bank:
    """Bank of n elements on the backbone of contacts in parallel: ``bank_from_contact(RoughLines(lines=4).contact())``.

    Args:
        contact: every line of it is a contact of its own, and all are summed (`creep_curve` takes their mean).
        n: elements.

    Raises:
        InputError: no contact.
    """
    lead = checked_contact(contact).indentation.gaps.shape[:-1]
    contacts = tuple(range(-len(lead), 0))

    def backbone(u: Array) -> Array:
        return jnp.sum(contact.force(jnp.reshape(u, (-1,) + (1,) * len(lead))), axis=contacts)

    return bank_from_backbone(backbone, jnp.max(contact.u_max), default_edges(n))
