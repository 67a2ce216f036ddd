"""Banks of Jenkins elements from rough lines or any other profile, each contact with a line and a load of its own."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from .bank import Bank, bank_from_backbone, default_edges
from .creep import rough_table, static_contact
from .elastic import Moduli
from .tangential import StaticContact


def bank_from_contact(contact: StaticContact, n: int = 128) -> Bank:
    """Bank of n elements on the backbone of contacts in parallel (all leading axes of ``contact`` are summed)."""
    lead = contact.indentation.gaps.shape[:-1]
    contacts = tuple(range(-len(lead), 0))

    def backbone(u: Array) -> Array:
        return jnp.sum(contact.force(jnp.reshape(u, (-1,) + (1,) * len(lead))), axis=contacts)

    return bank_from_backbone(backbone, jnp.max(contact.u_max), default_edges(n))


def rough_bank(
    H: ArrayLike = 0.3,
    h_rms: ArrayLike = 2.46e-6,
    normal_force: ArrayLike = 0.31,
    friction: ArrayLike = 0.21,
    *,
    contacts: int = 4,
    moduli: Moduli | None = None,
    length: float = 20e-6,
    n_springs: int = 4096,
    seed: int = 0,
    roll_off: ArrayLike | None = None,
    cut_off: ArrayLike | None = None,
    n: int = 128,
) -> Bank:
    """Bank of n elements for a block on rough contacts, each with its own random line. Defaults: the paper's rig.

    Args: as of `creep_curve`; ``h_rms`` and ``normal_force`` may be (contacts,) to make the contacts unequal.
    Differentiable in H, h_rms, normal_force and friction. Saturation is not checked.

    Raises:
        InputError: a value out of its range.
    """
    waves = {k: None if w is None else w / length for k, w in (("roll_off", roll_off), ("cut_off", cut_off))}
    table = rough_table(H, length, n_springs, contacts, seed, **waves).scaled(h_rms)
    return bank_from_contact(static_contact(table, normal_force, friction, moduli), n)
