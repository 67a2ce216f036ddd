"""The rough lines of the independent simulator against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from stickslip.blind.generator.bank import make_bank
from stickslip.blind.generator.lines import (
    Surface,
    gaps,
    group,
    indentation_depth,
    press,
    rough_line,
)
from stickslip.errors import InputError

LOAD, MU = 0.31, 0.21


def slide_curve(normal: np.ndarray, stiffness: np.ndarray, friction: float, u: np.ndarray) -> np.ndarray:
    """Virgin tangential force at displacements ``u``: sum of min(k u, friction f_n) (Grzemba 2014 eqs. 2-3), N."""
    return np.array([np.minimum(stiffness * step, friction * normal).sum() for step in np.atleast_1d(u)])


@pytest.fixture(scope="module")
def surface() -> Surface:
    return Surface(points=4096)


@pytest.fixture(scope="module")
def heights(surface: Surface) -> np.ndarray:
    return rough_line(surface, np.random.default_rng(4))


def test_line_has_exact_rms_and_the_slope_of_its_spectrum(surface: Surface, heights: np.ndarray) -> None:
    assert heights.std() == pytest.approx(surface.h_rms, rel=1e-12)
    amplitude = np.abs(np.fft.rfft(heights))[1:-1]
    wave = np.arange(1, amplitude.size + 1)
    assert np.polyfit(np.log(wave), np.log(amplitude), 1)[0] == pytest.approx(-(surface.hurst + 0.5), abs=1e-10)


@pytest.mark.parametrize("form", ["flat", "smooth"])
def test_roll_off_levels_the_long_waves_only(surface: Surface, form: str) -> None:
    line = rough_line(Surface(points=4096, roll_off=8, roll_off_form=form), np.random.default_rng(4))
    amplitude = np.abs(np.fft.rfft(line))
    assert amplitude[1] / amplitude[4] < 1.15  # without roll-off 4^0.8 = 3.03
    assert amplitude[400] / amplitude[800] == pytest.approx(2**0.8, rel=1e-3)


def test_depth_is_exact(surface: Surface, heights: np.ndarray) -> None:
    gap, c_n = gaps(surface, heights), surface.normal_spring
    searched = brentq(lambda d: c_n * np.maximum(d - gap, 0).sum() - LOAD, 0, 1e-4, xtol=1e-20, rtol=1e-15)
    assert indentation_depth(gap, c_n, LOAD) == pytest.approx(searched, rel=1e-13)
    assert press(surface, heights, LOAD).sum() == pytest.approx(LOAD, rel=1e-12)


def test_springs_follow_the_superposition_theorem(surface: Surface, heights: np.ndarray) -> None:
    """F_t(u) = mu [F_n(d) - F_n(d - G* u / (mu E*))], Ciavarella and Jaeger."""
    gap, c_n, c_t = gaps(surface, heights), surface.normal_spring, surface.tangential_spring
    normal = press(surface, heights, LOAD)
    depth = indentation_depth(gap, c_n, LOAD)
    u = np.linspace(0, 1.2 * MU * c_n / c_t * depth, 60)
    shallower = np.array([c_n * np.maximum(depth - c_t * s / (MU * c_n) - gap, 0).sum() for s in u])
    curve = slide_curve(normal, np.full(normal.size, c_t), MU, u)
    assert np.allclose(curve, MU * (LOAD - shallower), rtol=0, atol=1e-12 * LOAD)


def test_smooth_parabola_gives_cattaneo_mindlin() -> None:
    """F_t / (mu F_n) = 1 - (1 - u/u_max)^1.5 of the sphere, R the radius of the line's parabola x^2/R."""
    radius = 1e-4
    surface = Surface(points=16384, curvature=1 / radius)
    normal = press(surface, np.zeros(surface.points), 0.02)
    stiffness = np.full(normal.size, surface.tangential_spring)
    u_max = MU * normal[-1] / surface.tangential_spring
    w = np.linspace(0, 1, 41)
    curve = slide_curve(normal, stiffness, MU, w * u_max) / (MU * 0.02)
    assert np.allclose(curve, 1 - (1 - w) ** 1.5, atol=1e-5)
    e_star = surface.normal_spring * surface.points / surface.length
    depth = normal[-1] / surface.normal_spring
    g_star = surface.tangential_spring * surface.points / surface.length
    assert u_max == pytest.approx(3 * MU * 0.02 / (4 * g_star * np.sqrt(radius * depth)), rel=1e-4)
    assert 4 / 3 * e_star * np.sqrt(radius) * depth**1.5 == pytest.approx(0.02, rel=1e-4)


def test_grouping_keeps_the_sums_and_hardly_moves_the_curve(surface: Surface, heights: np.ndarray) -> None:
    normal, c_t = press(surface, heights, LOAD), surface.tangential_spring
    errors = []
    for groups in (32, 64, 128, 256):
        joined, stiffness = group(normal, c_t, groups)
        assert joined.size <= groups + 1
        assert joined.sum() == pytest.approx(LOAD, rel=1e-12)
        assert stiffness.sum() == pytest.approx(c_t * normal.size, rel=1e-12)
        u = MU * np.unique(np.concatenate([joined / stiffness, normal / c_t]))  # the error is largest at a threshold
        full = slide_curve(normal, np.full(normal.size, c_t), MU, u)
        errors.append(np.abs(slide_curve(joined, stiffness, MU, u) - full).max() / (MU * LOAD))
    assert errors[2] < 2e-4
    assert errors[0] / errors[2] > 8  # second order in the number of groups


def test_every_spring_and_groups_hold_the_same_contacts(surface: Surface) -> None:
    loads = np.array([0.2, 0.3, 0.35, 0.4])
    whole, grouped = (make_bank(surface, loads, 3, pool=2, groups=n) for n in (None, 64))
    assert whole.contacts == grouped.contacts == 4
    assert np.allclose(whole.stiffness.sum(1), grouped.stiffness.sum(1), rtol=1e-12)
    for j in range(4):
        part = slice(grouped.start[j], grouped.start[j + 1])
        assert np.allclose(grouped.normal[:, part].sum(1), loads[j], rtol=1e-12)
    assert not np.allclose(whole.stiffness[0].sum(), whole.stiffness[1].sum(), rtol=1e-3)


@pytest.mark.parametrize("form", ["cap", "soft"])
def test_softening_spreads_the_load(surface: Surface, heights: np.ndarray, form: str) -> None:
    elastic = press(surface, heights, LOAD)
    soft = press(Surface(points=4096, softening=0.4, softening_form=form), heights, LOAD)
    assert soft.sum() == pytest.approx(LOAD, rel=1e-9)
    assert soft.size > elastic.size
    if form == "cap":
        assert soft[-1] == pytest.approx(0.6 * elastic[-1], rel=1e-9)
    assert soft[-1] < elastic[-1]


def test_adhesion_adds_its_share_of_the_load(surface: Surface, heights: np.ndarray) -> None:
    stuck = press(Surface(points=4096, adhesion=0.05), heights, LOAD)
    assert stuck.sum() == pytest.approx(1.05 * LOAD, rel=1e-12)
    wide = press(Surface(points=4096, adhesion=0.05, adhesion_form="range"), heights, LOAD)
    assert wide.size > stuck.size
    assert wide.sum() == pytest.approx(1.05 * LOAD, rel=1e-12)


def test_saturated_line_is_refused() -> None:
    surface = Surface(h_rms=2e-8, points=1024)
    with pytest.raises(InputError, match="saturates"):
        press(surface, rough_line(surface, np.random.default_rng(0)), LOAD)
