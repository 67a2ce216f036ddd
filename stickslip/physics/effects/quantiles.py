"""The distribution of stiffness over thresholds, for effects that reshape the bank.

The share ``Q(u)`` of the stiffness whose elements still stick at displacement ``u`` is the slope of the backbone over
its slope at the origin. A backbone is its quantile function ``u(Q)``; to go from one shape towards another is to move
every element from its own quantile function towards that of the other.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..params import parameter
from .sliding import filled


def sticking_shares(bank: Bank) -> tuple[Array, Array]:
    """Share of the stiffness that sticks just before and just after each element slides, both of shape (n,)."""
    order = jnp.argsort(bank.threshold)
    sorted_stiffness = bank.stiffness[order]
    after_sorted = jnp.cumsum(sorted_stiffness[::-1])[::-1] - sorted_stiffness
    after = jnp.zeros_like(after_sorted).at[order].set(after_sorted) / bank.total_stiffness
    after = jnp.maximum(after, 0.0)
    return after + bank.stiffness / bank.total_stiffness, after


def scaled(bank: Bank, factor: Array) -> Bank:
    """Thresholds times ``factor`` (n,), then all of them by one more number that keeps the total strength.

    Exactly the same bank where all factors are one.
    """
    strength = bank.strength * factor
    return Bank(bank.stiffness, strength * (bank.total_strength / jnp.sum(strength)))


def share(doc: str) -> Any:
    """The parameter of effects that lead a bank towards another one."""
    return parameter(null=0.0, unit="1", lower=0.0, upper=1.0, symbol=r"\varepsilon", doc=doc, ends=(1.0,))


def towards(bank: Bank, threshold: Array, share: Array) -> Bank:
    """A bank that lies the ``share`` of the way from ``bank`` (0) to the one with these thresholds (m) (1)."""
    own = filled(bank.threshold)
    return scaled(bank, 1.0 + share * (threshold / own - 1.0))


def powered(x: Array, exponent: Array | float) -> Array:
    """``x**exponent`` for ``x >= 0`` and ``exponent > 0``, with finite derivatives in both at zero."""
    positive = x > 0.0
    return jnp.where(positive, jnp.exp(exponent * jnp.log(jnp.where(positive, x, 1.0))), 0.0)
