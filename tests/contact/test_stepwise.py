"""The closed form against the paper's procedure: bisection for the depth, then every spring at every step."""

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.physics.contact import default_loads
from tests.benchmark import static


@pytest.mark.slow
@pytest.mark.parametrize("way", [static.numpy_plain, static.numpy_careful, static.numba_loops])
def test_steps_follow_the_closed_form(way):
    z = static.heights(5, 512)
    found = way(z, 60)
    assert found.u.shape == found.force.shape == (60, 5)
    assert found.force[-1] == pytest.approx(static.FRICTION * static.LOAD, rel=1e-12)
    force, u = static.gap_to_closed_form(z, found)
    assert force < 1e-12
    assert u < 1e-10  # the last springs are soft


def test_what_the_benchmark_times_is_one_curve():
    z, tau = jnp.asarray(static.heights(5, 512)), jnp.asarray(default_loads(30))
    known, traced = static.own(z, tau), static.traced(z, tau)
    assert np.abs(np.asarray(known - traced)).max() < 1e-12 * float(traced[-1])
