"""The power-law backbone F = F_s [1 - (1 - u/u_max)^p] and banks made from it, one contact or a mixture."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import InputError
from ._ranges import check_within
from .bank import Backbone, Bank, bank_from_backbone, default_edges


def power_law_backbone(u: ArrayLike, u_max: ArrayLike, strength: ArrayLike, p: ArrayLike) -> Array:
    """Force (N) on first loading to displacement ``u >= 0`` (m): strength * (1 - (1 - u/u_max)^p), then constant.

    It is exact where the normal force grows as (depth)^p (Ciavarella-Jaeger theorem): p = 1.5 is Cattaneo-Mindlin,
    2 a cone, (H + 1)/H a self-affine line. Differentiable in every argument, also at and beyond ``u_max``, for
    p > 1. Arguments broadcast.
    """
    left = 1.0 - jnp.asarray(u) / u_max
    sliding = left <= 0.0
    share = 1.0 - jnp.where(sliding, 0.0, jnp.where(sliding, 1.0, left) ** p)
    return jnp.asarray(strength * share)


def normal_scores(contacts: int) -> np.ndarray:
    """(contacts,) quantiles of the normal distribution at (j - 1/2)/contacts, scaled to unit rms; mean zero."""
    if contacts < 1:
        raise InputError("no contact", key="contacts", value=contacts, allowed="1 or more")
    if contacts == 1:
        return np.zeros(1)
    from scipy.special import ndtri  # a tenth of a second that a single contact does not need

    scores = ndtri((np.arange(contacts) + 0.5) / contacts)
    scores = (scores - scores[::-1]) / 2.0  # exactly antisymmetric, hence exactly zero mean
    return scores / np.sqrt(np.mean(scores**2))


def mixture(backbone: Backbone, spread: ArrayLike, contacts: int) -> tuple[Backbone, Array]:
    """Backbone of equally loaded contacts whose u_max differ: the j-th is stretched by exp(spread * z_j).

    Args:
        backbone: force (N) of all contacts together if they were equal.
        spread: rms of ln(u_max) over the contacts. The curve is even in it: no first-order effect at zero.
        contacts: how many.

    Returns:
        The backbone of the mixture, and by which factor its u_max exceeds that of the equal contacts.
    """
    stretch = jnp.exp(spread * jnp.asarray(normal_scores(contacts)))

    def mixed(u: Array) -> Array:
        return jnp.mean(backbone(jnp.asarray(u)[..., None] / stretch), axis=-1)

    return mixed, jnp.max(stretch)


def power_law_bank(
    strength: ArrayLike | str, u_max: ArrayLike | str, p: ArrayLike, spread: ArrayLike = 0.0, contacts: int = 4,
    n: int = 128,
) -> Bank:  # fmt: skip
    """Bank of n elements on the power-law backbone, of one contact or of a mixture of unequal ones.

    Args:
        strength: full friction force of all contacts together, N or text with a unit.
        u_max: displacement at which the last element of the typical contact slides, m or text with a unit.
        p: exponent of the backbone, above 1.
        spread: rms of ln(u_max) over the contacts (see `mixture`).
        contacts: number of contacts the spread is over; without effect while ``spread`` is zero.
        n: number of elements, whatever the number of contacts.

    Raises:
        InputError: strength or u_max is not above zero, or no number of contacts or elements.
    """
    full = check_within("the strength", strength, above=0.0, key="strength", unit="N")
    end = check_within("u_max", u_max, above=0.0, key="u_max", unit="m")
    mixed, stretch = mixture(lambda u: power_law_backbone(u, end, full, p), spread, contacts)
    return bank_from_backbone(mixed, end * stretch, default_edges(n))
