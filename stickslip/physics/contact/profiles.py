"""One-dimensional profiles of all kinds, as gaps below the highest point."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from ...errors import InputError
from ...system import jax_settings  # noqa: F401  (before the first array)
from ._ranges import check_within


class Profile(NamedTuple):
    """A spring foundation: ``gaps`` (..., N) in m below the highest point of each line, at the spacing ``dx`` in m."""

    gaps: Array
    dx: ArrayLike


def from_heights(heights: ArrayLike, dx: ArrayLike) -> Profile:
    """The profile of lines (..., N) with heights in m, upwards towards the other body."""
    heights = jnp.asarray(heights)
    return Profile(jnp.asarray(jnp.max(heights, axis=-1, keepdims=True) - heights), dx)


def power_law(half_width: float | str, n_springs: int, exponent: ArrayLike, coefficient: ArrayLike) -> Profile:
    """Gap coefficient * abs(x)^exponent on abs(x) < half_width. F_n grows as depth^((exponent + 1)/exponent)."""
    exponent = check_within("the exponent of the profile", exponent, above=0.0, key="exponent")
    x, dx = _grid(half_width, n_springs)
    return Profile(jnp.asarray(coefficient * jnp.abs(x) ** exponent), dx)


def sphere(half_width: float | str, n_springs: int, radius: ArrayLike | str) -> Profile:
    """Gap x^2/R, the line that is equivalent to the paraboloid z = r^2/(2R) (method of dimensionality reduction)."""
    R = check_within("the radius", radius, above=0.0, key="radius", unit="m")
    return power_law(half_width, n_springs, 2.0, 1.0 / R)


def cone(half_width: float | str, n_springs: int, slope: ArrayLike) -> Profile:
    """Gap (pi/2) slope abs(x), the line that is equivalent to the cone z = slope * r."""
    slope = check_within("the slope of the cone", slope, above=0.0, key="slope")
    return power_law(half_width, n_springs, 1.0, 0.5 * np.pi * slope)


def flat_punch(half_width: float | str, n_springs: int) -> Profile:
    """No gap anywhere: all springs touch at once and slide at once."""
    x, dx = _grid(half_width, n_springs)
    return Profile(jnp.zeros_like(x), dx)


def add_curvature(heights: ArrayLike, dx: ArrayLike, curvature: ArrayLike) -> Array:
    """Heights (..., N) of lines on a body of radius R = 1/curvature (1/m): lowered by x^2/R about the middle."""
    heights = jnp.asarray(heights)
    x = (jnp.arange(heights.shape[-1]) - 0.5 * (heights.shape[-1] - 1)) * dx
    return heights - x**2 * jnp.asarray(curvature)


def heights_from_scan(
    position: ArrayLike | None, height: ArrayLike, *, spacing: float | str | None = None, n_springs: int | None = None
) -> tuple[np.ndarray, float]:
    """A measured scan, made even in spacing and freed of its linear trend.

    Args:
        position: (M,) in m, increasing; None for a scan of heights alone, which then needs ``spacing``.
        height: (M,) in m.
        spacing: distance of neighbouring points in m, where there is no position.
        n_springs: points wanted; default as many as measured. Linear interpolation.

    Returns:
        (n_springs,) heights with zero mean and no trend, and their spacing in m. A scan is a cut through the
        surface: see `cut_to_line_factor` before using it as an equivalent line.

    Raises:
        InputError: too few points, something not finite, or positions that do not increase.
    """
    z = np.asarray(height, dtype=float)
    if z.ndim != 1 or z.size < 8:
        raise InputError(
            "too few heights for a profile", key="height", value=z.shape, allowed="one column of 8 or more"
        )
    if position is None:
        if spacing is None:
            raise InputError("heights without positions need a spacing", key="spacing", allowed="a length above zero")
        x = check_within("the spacing", spacing, above=0.0, key="spacing", unit="m") * np.arange(z.size)
    else:
        x = np.asarray(position, dtype=float)
    if x.shape != z.shape:
        raise InputError("positions and heights differ in number", key="position", value=x.shape, allowed=str(z.shape))
    if bad := np.flatnonzero(~(np.isfinite(x) & np.isfinite(z))).tolist():
        raise InputError("a height or position is not a finite number", key=f"row {bad[0] + 1}")
    if bad := np.flatnonzero(np.diff(x) <= 0).tolist():
        raise InputError(
            "positions must increase",
            key=f"row {bad[0] + 2}",
            value=float(x[bad[0] + 1]),
            hint="sort the rows by position",
        )
    even = np.linspace(x[0], x[-1], n_springs or x.size)
    z = np.interp(even, x, z)
    slope, level = np.polyfit(even - even.mean(), z, 1)
    return z - level - slope * (even - even.mean()), float(even[1] - even[0])


def _grid(half_width: float | str, n_springs: int) -> tuple[Array, float]:
    """Springs in the middle of equal cells (the midpoint rule is why integrals converge with order 2)."""
    half = check_within("the half width", half_width, above=0.0, key="half_width", unit="m")
    if n_springs < 1:
        raise InputError("a profile needs springs", key="springs", value=n_springs, allowed="1 or more")
    dx = 2.0 * half / n_springs
    return (jnp.arange(n_springs) + 0.5) * dx - half, dx
