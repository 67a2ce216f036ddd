"""The smoothed reading: a ringing and a slow motion pass as they are, noise is small, the weights are those of it."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.scales import Scales
from stickslip.inference.force.smoothing import smoothed

RATE = 1e4  # Hz
NOISE = 2e-9  # m
INNER = slice(300, -300)


def ringing(samples: float, decay: float = 0.02) -> tuple[np.ndarray, np.ndarray, Scales]:
    """A ringing of this many samples a period on a slow motion, its velocity, and the times."""
    i = np.arange(2000)
    pole = 2j * np.pi / samples - decay / samples
    wave = 2e-7 * np.exp(pole * i)
    x = np.imag(wave) + 5e-8 * i + 1e-13 * i**2
    v = (np.imag(pole * wave) + 5e-8 + 2e-13 * i) * RATE
    period = samples / RATE
    return x, v, Scales(half=period, ring=period, slip=20.0 * period)


@pytest.mark.parametrize("samples", [12.0, 18.04, 40.0])
def test_a_ringing_passes(samples):
    x, v, times = ringing(samples)
    followed, speed, _ = smoothed(x, NOISE, RATE, times)
    amplitude = np.ptp(x[INNER] - np.polyval(np.polyfit(np.arange(1400), x[INNER], 2), np.arange(1400))) / 2
    assert np.abs(followed - x)[INNER].max() < 1e-3 * amplitude
    assert np.abs(speed - v)[INNER].max() < 2e-2 * amplitude * 2 * np.pi * RATE / samples


def test_a_small_ringing_is_not_shrunk():
    """Where nothing but noise is left on top, what passes is the ringing and the slow motion, to a thousandth."""
    x, _, times = ringing(18.04, decay=0.0)
    rng = np.random.default_rng(3)
    amplitude, shown = 2.0 * NOISE, []
    for _ in range(40):
        noise = NOISE * rng.standard_normal(x.size)
        both = smoothed(amplitude / 2e-7 * x + noise, NOISE, RATE, times)[0]
        shown.append(both - smoothed(noise, NOISE, RATE, times)[0])
    wave = np.sin(2.0 * np.pi / 18.04 * np.arange(x.size))[INNER]
    slow = np.stack([np.ones(1400), np.arange(1400), np.arange(1400) ** 2], axis=1)
    left = np.mean(shown, axis=0)[INNER]
    found = np.linalg.lstsq(np.column_stack([wave, slow]), left, rcond=None)[0][0]
    assert found == pytest.approx(amplitude, rel=1e-2)


def test_noise_is_less_than_half_of_that_of_a_sample():
    x, _, times = ringing(18.04)
    noise = NOISE * np.random.default_rng(5).standard_normal(x.size)
    followed, _, smoother = smoothed(noise, NOISE, RATE, times)
    assert np.std(followed[INNER]) < 0.5 * NOISE
    index = np.arange(300, 1700)
    assert smoother.matrix(index) @ noise == pytest.approx(followed[index], abs=1e-3 * NOISE)


@pytest.mark.parametrize("samples", [2.0, 2.6, 3.4])
def test_a_ringing_of_a_few_samples_is_left_as_it_is(samples):
    """A cubic and a ringing are eight numbers, and two periods hold no more samples."""
    x, _, times = ringing(samples)
    followed, speed, smoother = smoothed(x, NOISE, RATE, times)
    assert np.array_equal(followed, x)
    assert np.isfinite(speed).all()
    assert (smoother.matrix(np.arange(x.size)) @ x == x).all()


def test_a_block_in_nucleation_is_as_fast_as_it_is():
    """Its velocity grows e-fold in less than half a period of the ringing: a parabola fitted to it has a third more."""
    i = np.arange(2000)
    growth = 7.5  # samples
    x = 2e-9 * np.exp(np.minimum(i - 1000.0, 60.0) / growth)
    v = x * RATE / growth
    times = Scales(half=19.0 / RATE, ring=19.0 / RATE, slip=400.0 / RATE)
    rng = np.random.default_rng(7)
    speeds = [smoothed(x + NOISE * rng.standard_normal(x.size), NOISE, RATE, times)[1] for _ in range(40)]
    begun = slice(1015, 1040)  # from 20 to 500 um/s
    assert np.abs(np.mean(speeds, axis=0) / v - 1.0)[begun].max() < 0.1
