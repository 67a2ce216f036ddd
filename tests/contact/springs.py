"""Contacts whose answer is known spring by spring."""

from __future__ import annotations

import jax.numpy as jnp

from stickslip.physics.contact import Bank, Profile, StaticContact


def exponential_gaps(decay_length: float, n_springs: int, dx: float) -> Profile:
    """The number of springs within a gap g grows as exp(g/decay_length): asperities as of Greenwood and Williamson.

    While contact is partial, F_t/(mu F_n) = 1 - exp(-u/u_c) with u_c = mu (E*/G*) decay_length.
    """
    return Profile(jnp.log(jnp.arange(1, n_springs + 1, dtype=float)) * decay_length, dx)


def spring_bank(contact: StaticContact) -> Bank:
    """Every spring of a contact as an element of its own (springs out of contact have none of either); not binned."""
    table = contact.indentation
    reach = contact.friction * contact.moduli.normal / contact.moduli.tangential
    depths = jnp.maximum(jnp.asarray(contact.depth)[..., None] - table.gaps * jnp.asarray(table.height)[..., None], 0.0)
    stiffness = jnp.where(depths > 0.0, contact.moduli.tangential * jnp.asarray(table.dx), 0.0)
    return Bank(stiffness.ravel(), (stiffness * depths * jnp.asarray(reach)[..., None]).ravel())
