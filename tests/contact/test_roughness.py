"""Rough lines: exact normalisation, spectrum, one-point statistics, common random numbers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import RoughLines, cut_to_line_factor, line_phasors
from stickslip.physics.contact.roughness import amplitudes, lines_from_phasors


def unit_lines(H, lines=100, n_springs=4096, seed=0, **waves):
    """Heights of rms one on lines of length one."""
    return RoughLines(H, 1.0, 1.0, lines=lines, n_springs=n_springs, seed=seed, **waves).heights


@pytest.mark.parametrize("H", [0.05, 0.3, 0.9])
def test_every_line_has_zero_mean_and_unit_rms(H):
    z = np.asarray(unit_lines(H, 30, 512, seed=3))
    assert np.abs(z.mean(axis=1)).max() < 1e-14
    assert np.abs(z.std(axis=1) - 1).max() < 1e-12


@pytest.mark.parametrize("H", [0.1, 0.5, 0.8])
def test_spectral_density_falls_as_q_to_minus_2h_plus_1(H):
    z = np.asarray(unit_lines(H, 1, 4096, seed=1))[0]
    power = np.abs(np.fft.rfft(z))[1:-1] ** 2
    slope = np.polyfit(np.log(np.arange(1, power.size + 1)), np.log(power), 1)[0]
    assert slope == pytest.approx(-(2 * H + 1), abs=1e-9)


def test_roll_off_and_cut_off_bound_the_spectrum():
    z = np.asarray(unit_lines(0.4, 1, 1024, roll_off=1 / 8, cut_off=1 / 100))[0]
    power = np.abs(np.fft.rfft(z))[1:] ** 2
    assert np.allclose(power[:8], power[0], rtol=1e-9)
    assert power[8] == pytest.approx(power[0] * (8 / 9) ** 1.8, rel=1e-9)
    assert power[99] > 0.5 * power[98] * (99 / 100) ** 1.8
    assert power[100:].max() < 1e-24 * power[0]


def test_cut_off_is_continuous():
    lines = [
        np.asarray(unit_lines(0.3, 1, 256, cut_off=1 / k))[0] for k in (40.0, 40.0 + 1e-6, 40.5, 41.0 - 1e-6, 41.0)
    ]
    assert np.abs(lines[1] - lines[0]).max() < 1e-6
    assert np.abs(lines[4] - lines[3]).max() < 1e-6
    assert np.abs(lines[2] - lines[0]).max() > 1e-3


@pytest.mark.parametrize("point", [0, 23])
def test_one_point_statistics(point):
    """Over many lines a point has mean 0, variance 1 and the kurtosis of a sum of waves with random phase."""
    H, half = 0.3, 32
    z = np.asarray(unit_lines(H, 20000, 2 * half, seed=5))[:, point]
    power = np.asarray(amplitudes(H, half)) ** 2
    excess = -1.5 * (power**2).sum() / power.sum() ** 2
    n = z.size
    assert abs(z.mean()) < 4 / np.sqrt(n)
    assert abs(z.var() - 1) < 4 * np.sqrt((2 + excess) / n)
    assert abs((z**3).mean()) < 4 * np.sqrt(15 / n)
    assert abs((z**4).mean() - 3 - excess) < 4 * np.sqrt(96 / n)


def test_lines_are_independent_of_each_other():
    z = np.asarray(unit_lines(0.9, 400, 64))
    correlation = np.corrcoef(z)[np.triu_indices(400, 1)]
    assert abs(correlation.mean()) < 0.01
    assert np.abs(correlation).max() < 1 - 1e-3


def test_common_random_numbers():
    """More lines, or finer ones, keep the phases of those that were there."""
    few, many = line_phasors(3, 64, 7), line_phasors(8, 256, 7)
    assert np.array_equal(few, many[:3, :32])
    assert not np.allclose(few, line_phasors(3, 64, 8))
    coarse, fine = (np.fft.rfft(np.asarray(unit_lines(0.3, 1, n, seed=7))[0])[1:9] for n in (64, 256))
    assert np.allclose(coarse / np.abs(coarse), fine / np.abs(fine), atol=1e-12)


def test_derivative_in_H_follows_finite_differences():
    phasors = line_phasors(4, 128, 2)
    value = lambda H: lines_from_phasors(H, phasors)  # noqa: E731
    exact = jax.jvp(value, (0.37,), (1.0,))[1]
    for step in (1e-2, 1e-4, 1e-6):
        difference = (value(0.37 + step) - value(0.37 - step)) / (2 * step)
        assert jnp.abs(difference - exact).max() < 20 * step**2 + 1e-15 / step * 10


def test_derivatives_in_the_wavelengths_are_finite():
    slopes = jax.jacfwd(lambda w: unit_lines(0.3, 2, 128, roll_off=w[0], cut_off=w[1]))(jnp.array([0.21, 0.043]))
    assert jnp.isfinite(slopes).all()
    assert (jnp.abs(slopes).max(axis=(0, 1)) > 1e-3).all()


def test_cut_of_a_surface_is_weaker_than_its_equivalent_line():
    factor = np.asarray(cut_to_line_factor(np.array([0.3, 1 - 1e-9])))
    assert 1 / factor**2 == pytest.approx([0.73, 0.5], abs=5e-3)


@pytest.mark.parametrize("arguments", [(0.0,), (1.0,), (-0.2,), (float("nan"),), (0.3, 0), (0.3, 10, 5), (0.3, 10, 2)])
def test_bad_lines_are_refused(arguments):
    with pytest.raises(InputError):
        unit_lines(*arguments)
