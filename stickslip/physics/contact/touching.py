"""The table of the springs that touch: most of a rough line never does, and sorting is most of a static curve's cost.

A bound of the depth comes first. F_n(d) is convex, so a Newton step from wherever some spring touches ends at or beyond
the root: steps on every eighth spring find the place, and one on all of them gives a depth that is not exceeded.
Springs with larger gaps can be left out without changing a bit of what the others carry.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ._ranges import concrete
from .indentation import Indentation, indentation
from .profiles import Profile

THINNED, STEPS = 8, 5  # every how many-th spring serves the first steps, and how many these are


def touching(profile: Profile, load: ArrayLike) -> Indentation:
    """`indentation` for loads up to a largest one; the springs that it leaves out of contact are not sorted.

    Where values are traced (jit, derivatives) it is `indentation` itself: what touches is not known then.

    Args:
        profile: gaps (..., N).
        load: largest F_n/(E* dx) that will be asked for, in the unit of the gaps; above zero, broadcasts against the
            lines.

    Returns:
        A table that holds for loads up to the largest, and for depths up to its own at that load.
    """
    if not (concrete(profile.gaps) and concrete(load)):
        return indentation(profile)
    gaps = np.asarray(profile.gaps, dtype=float)
    lead, n = gaps.shape[:-1], gaps.shape[-1]
    touch = gaps < np.asarray(_bound(jnp.asarray(profile.gaps), np.broadcast_to(load, lead)))[..., None]
    count = np.count_nonzero(touch, axis=-1, keepdims=True)
    most = int(count.max())
    size = 2 ** int(np.ceil(np.log2(max(64, most))))  # few shapes, few compilations
    if size >= n:
        return indentation(profile)
    # what stands in for the others lies as deep as the deepest of them
    part = np.full((*lead, size), gaps.max())
    part[np.arange(size) < count] = gaps[touch]
    part[..., :most].sort(axis=-1)
    sums = np.zeros_like(part)
    np.cumsum(np.diff(part, axis=-1) * np.arange(1, size), axis=-1, out=sums[..., 1:])
    return Indentation(jnp.asarray(part), jnp.asarray(sums), profile.dx, springs=n)


@jax.jit
def _bound(gaps: Array, load: Array) -> Array:
    """Depths that ``load`` does not exceed, in the unit of the gaps."""
    few = gaps[..., ::THINNED]
    share = load * (few.shape[-1] / gaps.shape[-1])
    depth = jnp.max(few, axis=-1) + share / few.shape[-1]  # all of them touch
    return _newton(gaps, load, jax.lax.fori_loop(0, STEPS, lambda _, d: _newton(few, share, d), depth))


def _newton(gaps: Array, load: Array, depth: Array) -> Array:
    over = depth[..., None] - gaps
    carried, count = jnp.sum(jnp.maximum(over, 0.0), axis=-1), jnp.sum(over > 0.0, axis=-1)
    # rounding may lift the depth of a thinned line off its highest spring; one alone carries all at depth + load
    return jnp.where(count > 0, depth - (carried - load) / jnp.maximum(count, 1), jnp.maximum(depth, 0.0) + load)
