"""Directions the data leave open are named, and profiles find their intervals."""

import numpy as np
import pytest

from stickslip.uncertainty import flat_directions, null_directions, profile

NAMES = ("strength", "u_max", "p")


def covariance(direction, long, short=0.01):
    d = np.asarray(direction, float) / np.linalg.norm(direction)
    return short**2 * np.eye(len(d)) + long**2 * np.outer(d, d)


def test_a_flat_direction_names_its_parameters_and_what_is_known_of_them():
    (first, *_) = flat_directions(NAMES, covariance([0.0, 1.0, -1.0], 0.8))
    assert set(first.names) == {"u_max", "p"}
    assert first.std == pytest.approx(0.8, rel=0.01)
    assert "act together" in first.text
    # u_max and p move against each other, so their product is what is known
    assert "*" in first.text
    (first, *_) = flat_directions(NAMES, covariance([0.0, 1.0, 1.0], 0.8))
    assert "/" in first.text


def test_a_single_parameter_that_is_not_determined():
    found = flat_directions(NAMES, np.diag([1e-4, 1.0, 1e-4]), widths=[np.inf, 1.0, np.inf])
    assert [d.names for d in found] == [("u_max",)]
    assert "not determined" in found[0].text
    assert "prior" in found[0].text


def test_nothing_is_said_of_what_is_known():
    assert flat_directions(NAMES, np.diag([1e-4, 1e-4, 1e-4])) == []


def test_parameters_that_are_known_but_tied():
    c = np.diag([1e-4, 1e-4, 1e-4])
    c[0, 1] = c[1, 0] = 0.98e-4
    (pair,) = flat_directions(NAMES, c)
    assert set(pair.names) == {"strength", "u_max"}
    assert "correlation 0.98" in pair.text


def test_what_a_model_can_never_tell():
    # a prediction that depends on a/b and c only
    rng = np.random.default_rng(0)
    x = rng.standard_normal((20, 2))
    (only,) = null_directions(("a", "b", "c"), np.column_stack([x[:, 0], -x[:, 0], x[:, 1]]))
    assert set(only.names) == {"a", "b"}
    assert "a / b" in only.text or "b / a" in only.text


def test_profile_of_a_parabola_gives_its_interval():
    found = profile("k", 2.0, 0.1, (0.0, 5.0), lambda z: 7.0 + ((z - 2.0) / 0.1) ** 2)
    assert found.interval == pytest.approx((2.0 - 1.96 * 0.1, 2.0 + 1.96 * 0.1), rel=1e-3)
    assert "both sides" in found.text


def test_flat_and_one_sided_profiles_say_so():
    flat = profile("k", 0.0, 1.0, (-9.0, 9.0), lambda z: 3.0)
    assert flat.interval == (-np.inf, np.inf)
    assert "flat" in flat.text
    half = profile("k", 0.0, 1.0, (-9.0, 9.0), lambda z: max(z, 0.0) ** 2 * 9)
    assert half.interval[0] == -np.inf
    assert np.isfinite(half.interval[1])
    assert "one side" in half.text


def test_a_profile_that_falls_again_says_so():
    """Refits that end in different valleys are no profile."""
    valleys = iter([30.0, 8.0, 20.0, 0.0, 9.0, 25.0, 60.0])
    found = profile("a.b", 0.0, 1.0, (-9.0, 9.0), lambda value: next(valleys))
    assert "do not follow one valley" in found.text
    assert "valley" not in profile("a.b", 0.0, 1.0, (-9.0, 9.0), lambda value: 4.0 * value**2).text
