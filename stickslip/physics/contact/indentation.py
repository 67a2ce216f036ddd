"""Normal indentation of a spring foundation: force against depth and back, exact, from one sorted cumulative sum.

F_n(d) = E* dx * sum(max(d - gap_i, 0)) is convex and linear between the sorted gaps, so a table of the gaps and of the
force at each of them gives both F_n(d) and d(F_n) by one search. Everything static follows from this function.
"""

from __future__ import annotations

import dataclasses
import warnings

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import InputError
from .profiles import Profile


class SaturationWarning(UserWarning):
    """More than half of a line is in contact: its finite length begins to shape the result."""


class Indentation(eqx.Module):
    """Table of one or many lines.

    Queries broadcast against the leading axes of the table: a table of lines (100, N) asked at (400, 1) forces gives
    (400, 100) depths. Differentiable in everything.

    Fields:
        gaps: (..., N) sorted, in units of ``height``.
        sums: (..., N) sum of (gap_n - gap_j) over the gaps j below the n-th, in units of ``height``.
        dx: spacing of the springs, m.
        height: length in m that the gaps are counted in; broadcasts against the leading axes. Scaling a rough line
            keeps the order of its springs, so lines of unit rms are sorted once for every rms height.
        springs: of a line, where the table leaves out those that do not touch (see `touching`).
    """

    gaps: Array
    sums: Array
    dx: ArrayLike
    height: ArrayLike = 1.0
    springs: int | None = eqx.field(default=None, static=True)

    @property
    def n_springs(self) -> int:
        """Springs of a line, touching or not."""
        return self.gaps.shape[-1] if self.springs is None else self.springs

    def scaled(self, height: ArrayLike) -> Indentation:
        """The same lines with heights multiplied by ``height``; costs nothing."""
        return dataclasses.replace(self, height=jnp.asarray(self.height) * height)

    def force(self, depth: ArrayLike, modulus: ArrayLike) -> Array:
        """Normal force in N at indentation ``depth`` in m of the top, zero out of contact; ``modulus``: E*, Pa."""
        level = jnp.asarray(depth) / self.height
        count, gap, total = self._search(self.gaps, level)
        return (total + count * jnp.maximum(level - gap, 0.0)) * modulus * self.dx * self.height

    def depth(self, force: ArrayLike, modulus: ArrayLike) -> Array:
        """Indentation in m at which the normal force is ``force`` (N, not negative); ``modulus`` E* in Pa."""
        load = jnp.maximum(jnp.asarray(force) / modulus / self.dx / self.height, 0.0)
        count, gap, total = self._search(self.sums, load)
        return (gap + (load - total) / count) * self.height

    def contact_length(self, depth: ArrayLike) -> Array:
        """Length in m of the springs that touch; dF_n/d(depth) is E* times it."""
        return self.contact_share(depth) * (self.n_springs * self.dx)

    def contact_share(self, depth: ArrayLike) -> Array:
        """Share of the springs that touch, 0 to 1."""
        level = jnp.asarray(depth) / self.height
        count, gap, _ = self._search(self.gaps, level)
        return jnp.where(level > gap, count, count - 1.0) / self.n_springs

    def _search(self, table: Array, query: ArrayLike) -> tuple[Array, Array, Array]:
        """How many entries of ``table`` are at or below each query (at least one), and the gap and sum at the last."""
        lead = table.shape[:-1]
        shape = jnp.broadcast_shapes(jnp.shape(query), lead)
        if shape[len(shape) - len(lead) :] != lead:
            raise ValueError(f"a query of shape {jnp.shape(query)} does not broadcast against lines of shape {lead}")
        return _find(table, self.gaps, self.sums, jnp.broadcast_to(query, shape))


@jax.jit
def _find(table: Array, gaps: Array, sums: Array, queries: Array) -> tuple[Array, Array, Array]:
    n = table.shape[-1]
    rows = queries.reshape(-1, int(np.prod(table.shape[:-1]))).T
    found = jax.vmap(_last_below)(table.reshape(-1, n), gaps.reshape(-1, n), sums.reshape(-1, n), rows)
    count, gap, total = (part.T.reshape(queries.shape) for part in found)
    return count, gap, total


def _last_below(table: Array, gaps: Array, sums: Array, queries: Array) -> tuple[Array, Array, Array]:
    last = jnp.maximum(jnp.searchsorted(table, queries, side="right") - 1, 0)
    return last + 1.0, gaps[last], sums[last]


def indentation(profile: Profile) -> Indentation:
    """Sort the gaps (..., N) of a profile into the table that answers F_n(d) and d(F_n)."""
    gaps = sort_gaps(jnp.asarray(profile.gaps, dtype=float))
    rises = jnp.diff(gaps, axis=-1) * jnp.arange(1, gaps.shape[-1])
    # a sum of terms that are all positive: increasing to the last bit, and without cancellation
    sums = jnp.pad(jnp.cumsum(rises, axis=-1), [(0, 0)] * (gaps.ndim - 1) + [(1, 0)])
    return Indentation(gaps, sums, profile.dx)


def check_saturation(share: ArrayLike, *, key: str | None = None) -> None:
    """Warn above half contact, refuse full contact.

    Args:
        share: share of the springs in contact, any shape; the largest counts.
        key: where the contact stands, for the message.

    Raises:
        InputError: a line is in contact over its whole length, so its length decides the result.
    """
    shares = np.ravel(np.asarray(share))
    largest = float(shares.max())
    if largest >= 1.0:
        raise InputError(
            f"saturated: {int((shares >= 1.0).sum())} of {shares.size} lines touch over their whole length, "
            "so the tangential curve is that of a flat punch",
            key=key,
            allowed="less than 100 % in contact; below 50 % the length of the line does not matter",
            hint="lengthen the line (line_length L), roughen it (h_rms) or lower the normal force (F_n)",
        )
    if largest > 0.5:
        warnings.warn(
            f"{int((shares > 0.5).sum())} of {shares.size} lines touch over more than half of their length (up to "
            f"{100 * largest:.0f} %): the curve begins to depend on the length of the line. To correct: lengthen the "
            "line (line_length L), roughen it (h_rms) or lower the normal force (F_n).",
            SaturationWarning,
            stacklevel=2,
        )


@jax.custom_jvp
def sort_gaps(gaps: Array) -> Array:
    """Sort along the last axis; entries must not be negative.

    Doubles without a sign have the order of their bit patterns, and XLA sorts integers on a CPU five times faster.
    """
    return jax.lax.bitcast_convert_type(jnp.sort(_bits(gaps), axis=-1), gaps.dtype)


@sort_gaps.defjvp
def _sort_gaps_jvp(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    order = jnp.argsort(_bits(primals[0]), axis=-1)
    return jnp.take_along_axis(primals[0], order, axis=-1), jnp.take_along_axis(tangents[0], order, axis=-1)


def _bits(gaps: Array) -> Array:
    return jax.lax.bitcast_convert_type(gaps + 0.0, jnp.int64)  # + 0.0 turns a negative zero into zero
