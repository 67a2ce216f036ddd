"""Profiles and measured scans."""

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import (
    RoughLines,
    add_curvature,
    cone,
    flat_punch,
    from_heights,
    heights_from_scan,
    power_law,
    sphere,
)


def test_analytic_gaps():
    x = (np.arange(10) + 0.5) * 0.2 - 1.0
    assert np.allclose(sphere(1.0, 10, 4.0).gaps, x**2 / 4)
    assert np.allclose(cone(1.0, 10, 0.1).gaps, np.pi / 2 * 0.1 * np.abs(x))
    assert np.allclose(power_law(1.0, 10, 3.0, 2.0).gaps, 2 * np.abs(x) ** 3)
    assert np.array_equal(flat_punch(1.0, 10).gaps, np.zeros(10))
    assert sphere(1.0, 10, 4.0).dx == pytest.approx(0.2)


def test_gaps_of_a_line_start_at_its_top():
    z = np.asarray(RoughLines(0.5, 1e-6, lines=3, n_springs=64).heights)
    profile = from_heights(z, 1e-8)
    assert np.asarray(profile.gaps).min(axis=1) == pytest.approx(0.0, abs=0.0)
    assert np.allclose(profile.gaps, z.max(axis=1, keepdims=True) - z)


def test_curvature_of_a_smooth_line_is_a_sphere():
    lowered = add_curvature(np.zeros(10), 0.2, 1 / 4)
    assert np.allclose(np.asarray(from_heights(lowered, 0.2).gaps), np.asarray(sphere(1.0, 10, 4.0).gaps) - 0.01 / 4)


def test_scan_is_resampled_and_detrended():
    rng = np.random.default_rng(0)
    x = np.sort(rng.random(4000)) * 1e-4 + 5e-3
    wave = 1e-7 * np.sin(2 * np.pi * (x - x[0]) / 2e-5)
    z, dx = heights_from_scan(x, wave + 3e-4 + 0.02 * x, n_springs=1000)
    even = x[0] + dx * np.arange(1000)
    expected = 1e-7 * np.sin(2 * np.pi * (even - x[0]) / 2e-5)
    expected -= np.polyval(np.polyfit(even - even.mean(), expected, 1), even - even.mean())
    assert dx == pytest.approx((x[-1] - x[0]) / 999)
    assert np.abs(z - expected).max() < 1e-9
    assert abs(z.mean()) < 1e-15 * 3e-4
    assert abs(np.polyfit(even - even.mean(), z, 1)[0]) < 1e-12 * 0.02


def test_scan_of_heights_alone():
    z = np.cos(np.linspace(0, 20, 200))
    profile = from_heights(*heights_from_scan(None, z, spacing=1e-7))
    assert profile.dx == pytest.approx(1e-7)
    assert profile.gaps.shape == (200,)


@pytest.mark.parametrize(
    "position, height, spacing, fault",
    [
        ([0, 1, 2, 3, 3, 5, 6, 7], np.zeros(8), None, "row 5: positions must increase"),
        (None, np.zeros(8), None, "need a spacing"),
        (None, np.zeros(8), 0.0, "spacing is out of range"),
        (None, np.zeros(4), 1.0, "too few"),
        (np.arange(9), np.zeros(8), None, "differ in number"),
        (np.arange(8), [0, 0, np.nan, 0, 0, 0, 0, 0], None, "row 3"),
    ],
)
def test_bad_scans_are_refused(position, height, spacing, fault):
    with pytest.raises(InputError, match=fault):
        heights_from_scan(position, height, spacing=spacing)


def test_bad_profiles_are_refused():
    for make in (lambda: sphere(1.0, 10, 0.0), lambda: cone(0.0, 10, 1.0), lambda: flat_punch(1.0, 0)):
        with pytest.raises(InputError):
            make()
