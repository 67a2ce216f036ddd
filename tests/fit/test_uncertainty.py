"""Directions the data leave open are named, and profiles find their intervals."""

import re

import numpy as np
import pytest
from scipy.optimize import root_scalar

from stickslip.inference.uncertainty import flat_directions, null_directions, profile, relative

NAMES = ("strength", "u_max", "p")


def covariance(direction, long, short=0.01):
    d = np.asarray(direction, float) / np.linalg.norm(direction)
    return short**2 * np.eye(len(d)) + long**2 * np.outer(d, d)


def test_a_flat_direction_names_its_parameters_and_what_is_known_of_them():
    (first, *_) = flat_directions(NAMES, covariance([0.0, 1.0, -1.0], 0.8))
    assert set(first.names) == {"u_max", "p"}
    assert first.std == pytest.approx(0.8, rel=0.01)
    # u_max and p move against each other, so their product is what is known
    assert "act almost only together: u_max * p is known to 1.4 %, each to a factor 1.8" in first.text
    (first, *_) = flat_directions(NAMES, covariance([0.0, 1.0, 1.0], 0.8))
    assert "u_max / p is known" in first.text


def test_the_combination_that_is_known_is_known_that_well():
    """Draws with the covariance: the product that is named scatters as the text says, whatever its exponents."""
    c = covariance([0.2, 1.0, -0.6], 0.9)
    draws = np.exp(np.random.default_rng(1).multivariate_normal(np.zeros(3), c, 20000))
    (first, *_) = flat_directions(NAMES, c)
    formula, said = re.search(r"together: (.*) is known to ([\d.]+) %", first.text).groups()
    value = np.zeros(len(draws))
    for sign, name, power in re.findall(r"(^|[*/] )(\w+)\^?([\d.]*)", formula):
        value += (-1 if sign == "/ " else 1) * float(power or 1) * np.log(draws[:, NAMES.index(name)])
    assert value.std() == pytest.approx(float(said) / 100, rel=0.1)
    assert value.std() < 0.05 * np.sqrt(c[1, 1])


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
    assert "strength / u_max is known to 0.2 %, each to 1 %" in pair.text
    c[0, 1] = c[1, 0] = -0.98e-4
    (pair,) = flat_directions(NAMES, c)
    assert "strength * u_max is known to 0.2 %" in pair.text


def test_what_is_known_in_no_combination_says_so_once():
    found = flat_directions(NAMES, np.array([[1e-4, 0, 0], [0, 1.0, 0.3], [0, 0.3, 0.9]]))
    assert [set(d.names) for d in found] == [{"u_max", "p"}]
    assert "neither alone nor together: each to a factor 2.7" in found[0].text


def test_three_that_are_tied_are_told_in_two_pairs():
    d = np.ones(3) / np.sqrt(3)
    found = flat_directions(NAMES, 0.001**2 * np.eye(3) + 0.1**2 * np.outer(d, d))
    assert len(found) == 2
    assert {n for direction in found for n in direction.names} == set(NAMES)


def test_what_is_not_sought_as_a_logarithm_is_taken_relative_to_its_value():
    """An amplitude of 5 with an error of 0.5 is known to 10 %; one of 0.5 with that error may be zero."""
    c = np.diag([1e-4, 0.25, 0.25])
    c[0, 1] = c[1, 0] = 0.99 * 0.01 * 0.5
    kept, part, lost = relative(NAMES, [3.0, 5.0, 0.5], c, [True, False, False])
    assert kept == [0, 1]
    (text,) = lost
    assert text.startswith(
        "p is known to 1 times its value, so its size alone is not significantly different from zero"
    )
    assert relative(NAMES, [3.0, 5.0, 0.01], c, [True, False, False])[2] == [
        "p is not significantly different from zero"
    ]
    assert np.sqrt(np.diag(part)) == pytest.approx([0.01, 0.1])
    (pair,) = flat_directions(NAMES[:2], part)
    assert set(pair.names) == {"strength", "u_max"}


def test_what_a_model_can_never_tell():
    # two parameters of the fit that depend on a/b and c only
    jacobian = np.array([[1.0, -1.0, 0.3], [0.0, 0.0, 1.0]])
    (only,) = null_directions(("a", "b", "c"), jacobian, 0.02**2 * np.eye(2))
    assert only.names == ("a", "b")
    assert "a and b act only together: a / b is known to 2.1 %" in only.text
    # a third one that tells b
    more = np.vstack([jacobian, [0.0, 1.0, 0.0]])
    assert null_directions(("a", "b", "c"), more, 0.02**2 * np.eye(3)) == []
    # ... unless it is badly known itself
    (again,) = null_directions(("a", "b", "c"), more, np.diag([0.02, 0.02, 1.0]) ** 2)
    assert again.names == ("a", "b")
    assert "almost only together" in again.text


def test_groups_that_have_nothing_to_do_with_each_other_are_named_apart():
    jacobian = np.array([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -2.0]])
    found = null_directions(("a", "b", "c", "d"), jacobian, 1e-4 * np.eye(2))
    assert [d.names for d in found] == [("a", "b"), ("c", "d")]
    assert "a * b is known" in found[0].text
    assert "d / c^0.5 is known" in found[1].text


def test_profile_of_a_parabola_gives_its_interval():
    found = profile("k", 2.0, 0.1, (0.0, 5.0), lambda z: 7.0 + ((z - 2.0) / 0.1) ** 2)
    assert found.interval == pytest.approx((2.0 - 1.96 * 0.1, 2.0 + 1.96 * 0.1), rel=1e-3)
    assert "both sides" in found.text
    assert found.z.size <= 9 and np.abs(found.z - 2.0).max() < 1.0  # near the interval's ends


@pytest.mark.parametrize("std", [2e-4, 1e-3, 4e-3])
def test_an_interval_does_not_depend_on_the_deviation_from_which_it_is_sought(std):
    """Of a cost that rises faster to one side."""

    def cost(z):
        e = (z - 2.0) / 1e-3
        return 2.0 / 0.3**2 * (np.expm1(0.3 * e) - 0.3 * e)

    found = profile("k", 2.0, std, (0.0, 5.0), cost)
    ends = [root_scalar(lambda z: cost(z) - 3.84, bracket=b).root for b in ((1.99, 2.0), (2.0, 2.01))]
    assert found.interval == pytest.approx(tuple(ends), abs=1e-4)


def test_a_parameter_at_its_bound_has_a_profile_to_the_other_side():
    found = profile("k", 0.0, 0.0, (0.0, 5.0), lambda z: 100.0 * (z + 0.1) ** 2)
    assert found.interval == (-np.inf, pytest.approx(np.sqrt(0.01 + 0.0384) - 0.1, abs=1e-3))
    assert "one side" in found.text


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
    found = profile("a.b", 0.0, 1.0, (-9.0, 9.0), lambda value: 4.0 * value**2 - 30.0 * (value < -2.5))
    assert "do not follow one optimum" in found.text
    assert "do not follow" not in profile("a.b", 0.0, 1.0, (-9.0, 9.0), lambda value: 4.0 * value**2).text
