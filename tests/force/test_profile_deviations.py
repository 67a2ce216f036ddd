"""Deviations by profile: a rough valley is as wide as it is, a smooth one stays, and the truth lies in it."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.descent import SETTLED
from stickslip.inference.force.fit import fit
from stickslip.inference.force.profile_deviations import LEVEL, _variance, held, widened

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def virgin(small):
    """From the first loading on: the contact's strength is seen."""
    return fit(small.problem, small.point)


@pytest.fixture(scope="module")
def used(begun):
    """The spring stretched at the start by what nobody knows: of the strength only what is lost in a slip is seen."""
    return fit(begun.problem, begun.point)


@pytest.fixture(scope="module")
def wide(used):
    return widened(used, [LEVEL], 3.0)


def deviation(found, direction) -> float:
    return float(np.sqrt(direction @ found.covariance @ direction))


@pytest.mark.parametrize("dent", [0.0, 3.0])
def test_a_parabola_with_a_dent_is_as_wide_as_the_parabola(dent):
    """The lowest point lies in a dent of the profile, whose curvature is that of another parabola."""
    offset = np.array([-6.0, -2.0, -0.5, 0.0, 0.5, 2.0, 6.0])
    rise = (offset / 2.5) ** 2 + np.where(offset == 0.0, 0.0, dent)
    assert np.sqrt(_variance(offset, rise)) == pytest.approx(2.5, rel=1e-6 if dent == 0.0 else 0.15)


def test_a_flat_profile_is_as_wide_as_one_looked():
    offset = np.array([-30.0, -10.0, 0.0, 10.0, 30.0])
    assert np.sqrt(_variance(offset, np.array([0.2, 0.0, 0.0, 0.3, 0.1]))) == pytest.approx(30.0)


def _rise(found, f, k, times: float) -> float:
    """Of the cost so many deviations from the optimum: the mean of both sides, for what is odd is no curvature."""
    sd, best = float(np.sqrt(found.covariance[k, k])), float(found.point.z[k])
    least = held(found, f.name, best)[1]  # by the same search
    assert least == pytest.approx(found.cost, abs=2.0 * SETTLED)
    return float(np.mean([held(found, f.name, best + side * times * sd)[1] for side in (-1.0, 1.0)])) - least


def test_held_parameters_cost_what_the_covariance_says_where_all_is_seen(virgin):
    for k, f in enumerate(virgin.free):
        near, far = (_rise(virgin, f, k, times) for times in (3.0, 6.0))
        assert far == pytest.approx(6.0**2, abs=0.03 * 36.0), f.name
        assert far - near == pytest.approx(6.0**2 - 3.0**2, rel=0.03), f.name


def test_near_by_they_cost_it_to_the_end_of_a_search(virgin):
    for k, f in enumerate(virgin.free):
        assert _rise(virgin, f, k, 3.0) == pytest.approx(3.0**2, abs=SETTLED), f.name


def test_where_all_is_seen_nothing_becomes_wider_than_the_dispersion(virgin):
    wide = widened(virgin, [LEVEL], 3.0)
    assert wide.std()[LEVEL] == pytest.approx(np.sqrt(3.0) * virgin.std()[LEVEL], rel=0.1)


def test_only_what_the_profile_lets_go_becomes_wider(used, wide):
    """The share that is lost is known badly; what is lost of the strength stays known, and so does the damping."""
    names = [f.name for f in used.free]
    drop, weights = names.index(LEVEL), len(names) + used.point.phases.size
    share = np.zeros(used.covariance.shape[0])
    share[drop] = used.free[drop].slope(float(used.point.z[drop])) / used.values[LEVEL]
    lost = share.copy()
    lost[weights : weights + used.point.weights.size] = 1.0 / used.strength
    assert deviation(wide, lost) < 0.1 * deviation(wide, share)
    assert wide.std()["rig.damping"] < 1.2 * used.std()["rig.damping"]


def test_the_cost_rises_as_the_profile_says_and_not_as_the_derivatives_do(used, wide):
    """With the share held two and three of its deviations away, the mean of both sides, over the dispersion."""
    drop = [f.name for f in used.free].index(LEVEL)
    ratio = wide.std()[LEVEL] / used.std()[LEVEL]
    for times in (2.0, 3.0):
        rise = _rise(used, used.free[drop], drop, times * ratio) / 3.0
        assert rise == pytest.approx(times**2, rel=0.35)
        assert (times * ratio) ** 2 / 3.0 > 2.5 * rise  # what the derivatives say


def test_the_truth_lies_in_it(begun, wide):
    rig = begun.truth["rig"]
    true = 1.0 - rig["mu_k"] / rig["mu_s"]
    assert abs(wide.values[LEVEL] - true) < 2.5 * wide.std()[LEVEL]
