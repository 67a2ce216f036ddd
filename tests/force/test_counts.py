"""What rounding to counts adds in the mean: against rounded readings, and away from a motion."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.data.resolution import rounding_of_mean
from stickslip.inference.force.counts import counted, rounding
from stickslip.inference.force.knots import CREEP, unrounded
from stickslip.inference.force.scales import Scales
from stickslip.inference.force.smoothing import smoothed

COUNT, RATE = 7.9e-9, 1e4


@pytest.mark.parametrize("noise", [0.12, 0.2, 0.5])
def test_the_mean_is_that_of_rounded_readings(noise):
    x = np.linspace(-1.0, 2.0, 61) * COUNT
    draws = noise * COUNT * np.random.default_rng(2).standard_normal((20000, 1))
    mean = (COUNT * np.round((x + draws) / COUNT)).mean(axis=0) - x
    assert rounding(x, COUNT, noise * COUNT) == pytest.approx(mean, abs=0.012 * COUNT)


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("counts", [0.05, 0.4, 0.7, 1.0, 1.5, 3.2])
def test_the_mean_over_a_way_scatters_as_it_says(counts, noise):
    """Ways that begin anywhere on a count, apart from what the noise itself leaves of a mean."""
    rng, samples = np.random.default_rng(3), 100
    x = COUNT * (rng.random((2000, 1)) + counts * np.linspace(-0.5, 0.5, samples))
    faded = sum(
        (-1.0) ** k / k * np.exp(-2.0 * (np.pi * k * noise) ** 2) * np.sin(2.0 * np.pi * k * x / COUNT)
        for k in range(1, 40)
    )
    found = np.var((COUNT / np.pi * faded).mean(axis=1))
    assert rounding_of_mean(np.array([counts * COUNT]), COUNT, noise * COUNT)[0] == pytest.approx(
        found, rel=0.1, abs=2e-4 * COUNT**2
    )


@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_and_so_do_rounded_readings(noise):
    rng, samples, counts = np.random.default_rng(3), 200, 0.4
    x = COUNT * (rng.random((8000, 1)) + counts * np.linspace(-0.5, 0.5, samples))
    draws = noise * COUNT * rng.standard_normal(x.shape)
    errors = COUNT * np.round((x + draws) / COUNT) - x
    single = COUNT**2 * (noise**2 + 1.0 / 12.0) / samples
    found = np.var(errors.mean(axis=1))
    expected = rounding_of_mean(np.array([counts * COUNT]), COUNT, noise * COUNT)[0]
    assert 0.97 * expected < found < 1.03 * expected + single


def test_a_window_in_which_little_moves_counts_for_less(small):
    """Its mean is as uncertain as the part of a count that it passes leaves it, however long it is."""
    run, trace = small.knots[0], small.traces[0]
    assert np.all(run.reading.variance >= run.reading.count)
    slow = np.flatnonzero((run.phase == CREEP) & (np.abs(run.rate) < 1e-6))
    mean = run.reading.displacement[np.searchsorted(run.t, run.at[slow])]
    deviation = run.noise * np.sqrt((mean * mean) @ run.reading.variance)
    alone = run.noise * np.sqrt((mean * mean) @ run.reading.count)
    assert np.all(deviation > alone)
    assert np.max(deviation) < trace.resolution / np.sqrt(12.0) * 1.2


def test_counts_are_known_by_their_steps():
    readings = 1e-7 + COUNT * np.array([0.0, 3.0, -2.0, 5.0])
    assert counted(readings, COUNT)
    assert not counted(readings, 1.07 * COUNT)
    assert not counted(readings, 0.0)


def test_the_smoothed_path_is_nearer_to_the_motion():
    """A tenth of a count from sample to sample, with noise of a sixth: half of the mean error of many readings goes."""
    t = np.arange(4000) / RATE
    x = 1e-5 * t + 2e-8 * np.sin(2.0 * np.pi * 30.0 * t)
    noise = np.hypot(COUNT / 6.0, COUNT / np.sqrt(12.0))
    times = Scales(half=19.0 / RATE, ring=19.0 / RATE, slip=400.0 / RATE)
    rng, none, nothing = np.random.default_rng(4), np.zeros(0, int), np.zeros(x.size)

    def off(readings: np.ndarray) -> np.ndarray:
        return (smoothed(readings, noise, RATE, times, none)[0] - x)[50:-50]

    after, before = [], []
    for _ in range(60):
        readings = COUNT * np.round((x + COUNT / 6.0 * rng.standard_normal(x.size)) / COUNT)
        after.append(off(unrounded(readings, nothing, COUNT, noise, RATE, times, none)))
        before.append(off(readings))
    assert np.std(np.mean(after, axis=0)) < 0.5 * np.std(np.mean(before, axis=0))
    assert np.std(after) < 0.9 * np.std(before)
    plain = x + noise * rng.standard_normal(x.size)  # not counted
    assert np.array_equal(unrounded(plain, nothing, COUNT, noise, RATE, times, none), plain)
