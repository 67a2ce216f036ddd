"""A bank of parallel Jenkins elements (elastic spring and Coulomb slider in series) and its return map.

Also called a parallel-series Iwan model, a Maxwell-slip model or a Prandtl-Ishlinskii stop operator.
"""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import InputError
from ...system import jax_settings  # noqa: F401  (before the first array)
from ...system.object_repr import quantity
from ._ranges import concrete

Backbone = Callable[[Array], Array]


class Bank(eqx.Module):
    """Parallel Jenkins elements that all see the same displacement.

    Fields:
        stiffness: (n,) in N/m.
        strength: (n,) in N, the cap of each element at full friction (``mu_s`` times its normal force).

    Raises:
        InputError: stiffness and strength are not of one shape.
    """

    stiffness: Array
    strength: Array

    def __check_init__(self) -> None:
        given = jnp.shape(self.stiffness), jnp.shape(self.strength)
        if given[0] != given[1]:
            raise InputError("every element of a bank has a stiffness and a strength", key="bank", value=given)

    def __repr__(self) -> str:
        own = self.stiffness, self.strength
        if not all(isinstance(a, np.ndarray | Array) and concrete(a) and np.size(a) for a in own):
            return f"Bank(stiffness={eqx.tree_pformat(own[0])}, strength={eqx.tree_pformat(own[1])})"
        k, f = map(np.atleast_1d, map(np.asarray, own))
        told = {
            "total_stiffness": quantity(k.sum(axis=-1), "N/m"),
            "total_strength": quantity(f.sum(axis=-1), "N"),
            "threshold": quantity(f[k > 0.0] / k[k > 0.0], "m"),
        }
        return f"Bank({k.shape[-1]} elements, {', '.join(f'{name}={text}' for name, text in told.items())})"

    @property
    def threshold(self) -> Array:
        """(n,) displacement in m at which each element of a force-free bank starts to slide.

        Zero for an element without stiffness (a bin that holds no spring); such an element never carries force.
        """
        empty = self.stiffness <= 0.0
        return jnp.where(empty, 0.0, self.strength / jnp.where(empty, 1.0, self.stiffness))

    @property
    def total_strength(self) -> Array:
        """Largest tangential force in N."""
        return jnp.sum(self.strength)

    @property
    def total_stiffness(self) -> Array:
        """Stiffness of the force-free bank in N/m."""
        return jnp.sum(self.stiffness)

    def backbone(self, u: ArrayLike) -> Array:
        """Force in N on first loading from the force-free state to displacement ``u`` (m); odd in ``u``."""
        pull = self.stiffness * jnp.asarray(u)[..., None]
        return jnp.sum(jnp.clip(pull, -self.strength, self.strength), axis=-1)


def default_edges(n: int) -> np.ndarray:
    """(n,) increasing nodes in (0, 1] that end at 1: half spread evenly in threshold, half evenly in stiffness.

    They are the quantiles of the mean of two densities of thresholds w = u/u_max: the uniform one, and that of the
    backbone 1 - (1 - w)^3, whose elements are spread as 2(1 - w). Evenly stiff elements alone would let the last
    ones slide one by one; even thresholds alone leave the start of creep coarse. The nodes do not depend on any
    parameter of the contact, so that a bank is a smooth function of them.
    """
    if n < 1:
        raise InputError("a bank needs at least one element", key="bins", value=n, allowed="1 or more")
    share = np.arange(1, n + 1) / n
    return (3.0 - np.sqrt(9.0 - 8.0 * share)) / 2.0


def bank_from_backbone(backbone: Backbone, u_max: ArrayLike, edges: ArrayLike) -> Bank:
    """The bank whose own backbone is the chord interpolant of ``backbone`` at the nodes ``edges * u_max``.

    Exact at the nodes, hence in total strength. Only values of the backbone enter, so the bank is as smooth in the
    parameters as the backbone is.

    Args:
        backbone: force (N) on first loading at displacements (n,) in m; zero at zero, concave, constant from
            ``u_max`` on.
        u_max: displacement (m) at which the last element slides.
        edges: (n,) increasing shares of ``u_max`` that end at 1 (see `default_edges`).

    Returns:
        A bank of n elements, the i-th with threshold ``edges[i] * u_max``.
    """
    nodes, slopes = _chords(backbone, u_max, edges)
    # a concave backbone cannot give a negative element; rounding on a straight piece can
    stiffness = jnp.maximum(slopes - jnp.append(slopes[1:], 0.0), 0.0)
    return Bank(stiffness, stiffness * nodes)


def binning_error(backbone: Backbone, u_max: ArrayLike, edges: ArrayLike) -> Array:
    """Upper bound of the chord interpolant's error, as a share of the total strength.

    Rigorous for any concave backbone: between two nodes it lies above its chord and below the neighbouring chords
    drawn out, so the gap is at most the height of that triangle.
    """
    nodes, slopes = _chords(backbone, u_max, edges)
    widths = jnp.diff(nodes, prepend=0.0)
    # rounding on a straight piece can make a concave backbone rise
    fall = jnp.maximum(slopes - jnp.append(slopes[1:], 0.0), 0.0)
    before = jnp.append(jnp.inf, fall[:-1])
    height = widths * jnp.where(jnp.isinf(before), fall, before * fall / jnp.maximum(before + fall, 1e-300))
    return jnp.max(height) / jnp.sum(slopes * widths)


def _chords(backbone: Backbone, u_max: ArrayLike, edges: ArrayLike) -> tuple[Array, Array]:
    """Nodes (m) and the slope (N/m) of the chord that ends at each of them; the first chord starts at zero."""
    nodes = jnp.asarray(edges) * u_max
    return nodes, jnp.diff(backbone(nodes), prepend=0.0) / jnp.diff(nodes, prepend=0.0)
