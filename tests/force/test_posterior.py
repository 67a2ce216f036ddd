"""The density that a sampler walks through: its gradient, and what it is near the optimum."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.inference.force.descent import SETTLED
from stickslip.inference.force.posterior import posterior_density

pytestmark = pytest.mark.slow

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"


@pytest.fixture(scope="module")
def aged():
    return ss.load_campaign(SHIPPED).fit(["contact-ageing"])


@pytest.fixture(scope="module")
def way(aged):
    """Counted in the deviations of the derivatives, without what profiles add to them."""
    return posterior_density(replace(aged.force_fit, valleys=()))


def test_the_gradient_is_that_of_the_density(way):
    rng = np.random.default_rng(0)
    x, along = 0.5 * rng.standard_normal(way.size), rng.standard_normal(way.size)
    _, _, slope = way.at(x)
    for step in (1e-2, 1e-3, 1e-4):
        numeric = (way.at(x + step * along)[1] - way.at(x - step * along)[1]) / (2.0 * step)
        assert numeric == pytest.approx(slope @ along, rel=2e-3, abs=1e-3)


def test_near_the_optimum_it_is_the_normal_density_of_the_covariance(way):
    rng = np.random.default_rng(1)
    _, top, slope = way.at(np.zeros(way.size))
    assert np.linalg.norm(slope) < np.sqrt(SETTLED)  # a fit ends within that of its optimum
    for _ in range(5):
        x = 0.01 * rng.standard_normal(way.size)  # farther out the valley bends, and elements begin to slide
        assert way.at(x)[1] - top == pytest.approx(slope @ x - 0.5 * x @ x, rel=0.1, abs=2e-5)


def test_beyond_a_bound_it_falls_steeply(way):
    f = way.fit.free[4]
    far = np.linalg.solve(way.root, np.eye(way.size)[4] * (f.bounds[1] - way.fit.point.z[4] + 1.0 / float(f.scale)))
    assert way.at(far)[1] < way.at(np.zeros(way.size))[1] - 1e3


@pytest.mark.long
def test_draws_have_the_deviations_of_the_fit(aged):
    """Where the density is nearly normal, a sampler and the curvature must agree (five minutes)."""
    found = aged.sample(draws=150, tune=100, chains=2, seed=1)
    posterior = found.posterior
    for f in aged.free:
        draws = posterior[f.name].values.ravel()
        assert draws.std() == pytest.approx(aged.std[f.name], rel=0.35)
        assert abs(draws.mean() - aged.values[f.name]) < 1.0 * aged.std[f.name]
        assert posterior[f.name].attrs["units"] == f.unit
    assert "No divergence" in posterior.attrs["trust"]
