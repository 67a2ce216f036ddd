"""The smoothed reading: a ringing and a slow motion pass as they are, noise is small, the weights are those of it."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.scales import Scales
from stickslip.inference.force.smoothing import smoothed

RATE = 1e4  # Hz
NOISE = 2e-9  # m
INNER = slice(300, -300)
NONE = np.zeros(0)  # arrests


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
    followed, speed, _ = smoothed(x, NOISE, RATE, times, NONE)
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
        both = smoothed(amplitude / 2e-7 * x + noise, NOISE, RATE, times, NONE)[0]
        shown.append(both - smoothed(noise, NOISE, RATE, times, NONE)[0])
    wave = np.sin(2.0 * np.pi / 18.04 * np.arange(x.size))[INNER]
    slow = np.stack([np.ones(1400), np.arange(1400), np.arange(1400) ** 2], axis=1)
    left = np.mean(shown, axis=0)[INNER]
    found = np.linalg.lstsq(np.column_stack([wave, slow]), left, rcond=None)[0][0]
    assert found == pytest.approx(amplitude, rel=1e-2)


def test_noise_is_less_than_half_of_that_of_a_sample():
    x, _, times = ringing(18.04)
    noise = NOISE * np.random.default_rng(5).standard_normal(x.size)
    followed, _, smoother = smoothed(noise, NOISE, RATE, times, NONE)
    assert np.std(followed[INNER]) < 0.5 * NOISE
    index = np.arange(300, 1700)
    assert smoother.matrix(index) @ noise == pytest.approx(followed[index], abs=1e-3 * NOISE)


@pytest.mark.parametrize("samples", [2.0, 2.6, 3.4])
def test_a_ringing_of_a_few_samples_is_left_as_it_is(samples):
    """A cubic and a ringing are eight numbers, and two periods hold no more samples."""
    x, _, times = ringing(samples)
    followed, speed, smoother = smoothed(x, NOISE, RATE, times, NONE)
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
    speeds = [smoothed(x + NOISE * rng.standard_normal(x.size), NOISE, RATE, times, NONE)[1] for _ in range(40)]
    begun = slice(1015, 1040)  # from 20 to 500 um/s
    assert np.abs(np.mean(speeds, axis=0) / v - 1.0)[begun].max() < 0.1


@pytest.mark.parametrize("part", [0.0, 0.4])
def test_at_an_arrest_nothing_is_biased(part):
    """A contact that slid holds from there on: one function over the arrest is off by a third of a sample's noise."""
    samples, amplitude, at = 19.0, 2e-8, 1000
    i = np.arange(2000) - at - part
    turn = 2.0 * np.pi / samples
    wave = np.cos(turn * i) * np.exp(-0.005 * i) - 1.0 + 0.005 * i
    x = amplitude * np.where(i < 0.0, -0.5 * (turn * i) ** 2, wave)
    times = Scales(half=samples / RATE, ring=samples / RATE, slip=400.0 / RATE)
    rng = np.random.default_rng(11)
    around = slice(at - 20, at + 21)

    def off(arrests: np.ndarray) -> tuple[float, float]:
        shown = [smoothed(x + NOISE * rng.standard_normal(x.size), NOISE, RATE, times, arrests)[0] for _ in range(200)]
        return float(np.abs(np.mean(shown, axis=0) - x)[around].max()), float(np.std(shown, axis=0)[around].max())

    (bent, noise), (straight, less) = off(np.array([at + part])), off(NONE)
    assert bent < 0.15 * NOISE
    assert straight > 2.0 * bent
    assert noise < 1.1 * less < 0.6 * NOISE


@pytest.mark.parametrize("part", [0.0, 0.25, 0.9])
def test_a_bent_motion_passes(part):
    """A cubic before an arrest, and a ringing after it, equal there up to the acceleration."""
    samples, at = 18.04, 1000.0 + part
    i = np.arange(2000) - at
    turn = 2.0 * np.pi / samples
    slow, speed = 5e-8 * i - 1e-10 * i**3, 5e-8 - 3e-10 * i**2
    ring = 2e-7 * (np.sin(turn * i) - turn * i + 0.1 * (np.cos(turn * i) - 1.0 + 0.5 * (turn * i) ** 2))
    rate = 2e-7 * turn * (np.cos(turn * i) - 1.0 + 0.1 * (turn * i - np.sin(turn * i)))
    x, v = slow + (i > 0.0) * ring, RATE * (speed + (i > 0.0) * rate)
    times = Scales(half=samples / RATE, ring=samples / RATE, slip=400.0 / RATE)
    followed, found, smoother = smoothed(x, NOISE, RATE, times, np.array([600.0, 625.0, at]))  # two too near each other
    near = np.arange(980, 1020)
    assert followed[near] == pytest.approx(x[near], abs=2e-3 * 2e-7)
    assert found[near] == pytest.approx(v[near], abs=5e-3 * 2e-7 * turn * RATE)
    assert len(smoother.bends) == 1
    index = np.arange(x.size)
    matrix = smoother.matrix(index)
    assert matrix @ x == pytest.approx(followed, rel=1e-12, abs=1e-15)
    assert np.asarray((matrix**2).sum(axis=1)).ravel()[200:-200] == pytest.approx(smoother.squares[200:-200], rel=1e-9)
