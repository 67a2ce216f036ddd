"""Derived quantities: deviations are those of closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from stickslip.errors import InputError
from stickslip.objects.derived import derived

VALUES = {"rig.mass": 0.0894, "rig.spring_stiffness": 980.0, "weakening.drop": 0.25, "contact.strength": 0.26}
NAMES = ["contact.strength", "rig.spring_stiffness", "weakening.drop"]  # the mass is not fitted
STD = np.array([3e-3, 4.0, 2e-3])
CORRELATION = np.array([[1.0, 0.3, -0.9], [0.3, 1.0, 0.1], [-0.9, 0.1, 1.0]])


def fit(std=STD):
    covariance = xarray.DataArray(
        CORRELATION * np.outer(std, std), dims=("parameter", "other"), coords={"parameter": NAMES, "other": NAMES}
    )
    return SimpleNamespace(values=VALUES, std=dict(zip(NAMES, std, strict=True)), covariance=covariance)


def test_the_frequency_of_a_spring_is_half_as_uncertain_as_its_stiffness():
    found = derived(fit(), lambda p: np.sqrt(p["rig.spring_stiffness"] / p["rig.mass"]))
    frequency = np.sqrt(980.0 / 0.0894)
    assert isinstance(found.value, float) and found.value == pytest.approx(frequency)
    assert isinstance(found.std, float) and found.std == pytest.approx(0.5 * frequency * 4.0 / 980.0, rel=1e-4)


def test_correlations_count():
    """Of a product: variances of the logarithms, and twice their covariance."""
    found = derived(fit(), lambda p: p["contact.strength"] * p["weakening.drop"])
    one, other = 3e-3 / 0.26, 2e-3 / 0.25
    relative = np.sqrt(one**2 + other**2 - 2.0 * 0.9 * one * other)
    assert found.std == pytest.approx(0.26 * 0.25 * relative, rel=1e-3)


def test_an_array_has_deviations_of_its_shape():
    times = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    found = derived(fit(), lambda p: p["contact.strength"] + p["weakening.drop"] * times)
    np.testing.assert_allclose(found.value, 0.26 + 0.25 * times)
    variance = 9e-6 + 4e-6 * times**2 - 2.0 * 0.9 * 6e-6 * times
    np.testing.assert_allclose(found.std, np.sqrt(variance), rtol=1e-6)


def test_what_is_not_fitted_or_stands_at_a_bound_is_exact():
    assert derived(fit(), lambda p: p["rig.mass"] ** 2).std == 0.0
    held = fit(STD * [1.0, 1.0, 0.0])
    assert derived(held, lambda p: p["weakening.drop"]).std == 0.0
    assert derived(held, lambda p: p["weakening.drop"] + p["contact.strength"]).std == pytest.approx(3e-3)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda p: p["rig.mas"], "rig.mass"),
        (lambda p: p["rig.mass"] / np.float64("inf") * np.float64("inf"), "finite"),
        (lambda p: "a tenth", "finite"),
        (lambda p: None, "finite"),
        (lambda p: {"a": 1.0}, "finite"),
    ],
)
def test_a_function_that_cannot_be_used_is_refused_in_words(function, said):
    with np.errstate(invalid="ignore"), pytest.raises(InputError, match=said):
        derived(fit(), function)


def test_an_error_of_the_function_itself_is_its_own():
    with pytest.raises(KeyError, match="own"):
        derived(fit(), lambda p: {}["own"])


def test_a_derived_quantity_shows_its_deviation_and_an_array_its_ends():
    assert repr(derived(fit(), lambda p: p["rig.mass"] ** 0 * p["weakening.drop"])) == "Derived(0.2500 ± 0.0020)"
    assert repr(derived(fit(), lambda p: p["rig.mass"])) == "Derived(0.0894)"
    many = derived(fit(), lambda p: p["weakening.drop"] * np.array([[1.0, 2.0], [3.0, 4.0]]))
    assert repr(many) == "Derived(shape=(2, 2), value=0.25 to 1, std=0.002 to 0.008)"
