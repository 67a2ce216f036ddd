"""`Motion.relax` against the closed form at constant speed and against quadrature where the speed changes linearly."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from stickslip.physics.effects.base import Motion

DT = 3e-3  # s


def relaxed(last: float, total: float) -> tuple[float, float]:
    """What is left of the start's value, and what a gain of 1/DT has made.

    Args:
        last: rate at the end, times DT.
        total: integral of the rate.
    """
    at, way = jnp.asarray(0.0), jnp.asarray(total)
    still = Motion(at, jnp.asarray(DT), at, jnp.asarray(last / DT), None, way, at)
    begun, gained = (float(still.relax(jnp.asarray(v), g, 0.0, 1.0)) for v, g in ((1.0, 0.0), (0.0, 1.0 / DT)))
    return begun, gained


def exact(last: float, total: float) -> float:
    """The integral over the increment, the rate going linearly to ``last``."""
    near = [1.0 / last] if last > 1.0 else None
    return quad(lambda s: np.exp(-last * s + (last - total) * s * s), 0.0, 1.0, epsabs=1e-13, points=near)[0]


@pytest.mark.parametrize("whole", [1e-9, 1e-4, 0.02, 0.5, 3.0, 40.0, 600.0])
def test_a_constant_speed_is_relaxed_exactly(whole):
    left, made = relaxed(whole, whole)
    assert left == pytest.approx(np.exp(-whole), rel=1e-13, abs=1e-300)
    assert made == pytest.approx(-np.expm1(-whole) / whole, rel=1e-12)


@pytest.mark.parametrize(
    ("last", "total", "error"),
    [
        (1e-3, 2e-3, 1e-12), (1e-3, 0.0, 1e-12), (0.03, 0.06, 3e-9), (0.3, 0.33, 3e-8), (0.3, 0.0, 2e-5),
        (1.0, 1.1, 3e-5), (3.0, 3.3, 3e-3), (100.0, 110.0, 1e-3), (1e4, 1.1e4, 1e-5),
    ],
)  # fmt: skip
def test_a_speed_that_changes_is_relaxed_as_by_quadrature(last, total, error):
    """The bounds are those of three Gauss points: what is approximated within them adds a tenth at most."""
    left, made = relaxed(last, total)
    assert left == pytest.approx(np.exp(-total), rel=1e-13, abs=1e-300)
    assert made == pytest.approx(exact(last, total), rel=error)


def test_where_all_is_lost_values_and_derivatives_are_finite():
    """A block that has slid far and stands at the end."""

    def made(total):
        at = jnp.asarray(0.0)
        return Motion(at, jnp.asarray(DT), at, jnp.asarray(1e-9), None, total, at).relax(at, 1.0 / DT, 0.0, 1.0)

    for total in (1e3, 1e6, 1e12):
        value, slope = jax.value_and_grad(made)(jnp.asarray(total))
        assert 0.0 <= value < 0.3 and np.isfinite(slope) and slope <= 0.0
