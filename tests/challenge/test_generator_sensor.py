"""The statistics and filters of the simulated vibrometer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from stickslip.blind.generator.sensor import COUNT, FRINGE, SILENT, Sensor, counts, filtered, noise, spot

RATE = 1e4


def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def test_white_noise_has_its_density() -> None:
    y = noise(replace(SILENT, white=3e-11), np.zeros(400_000), RATE, rng())
    _, density = signal.welch(y, RATE, nperseg=4096)
    assert np.sqrt(density[10:-10].mean()) == pytest.approx(3e-11, rel=0.02)


def test_flicker_falls_with_frequency() -> None:
    y = noise(replace(SILENT, flicker=1e-10), np.zeros(1 << 20), RATE, rng())
    f, density = signal.welch(y, RATE, nperseg=1 << 15)
    part = (f > 3) & (f < 1000)
    slope, level = np.polyfit(np.log(f[part]), np.log(density[part]), 1)
    assert slope == pytest.approx(-1, abs=0.05)
    assert np.exp(level / 2) == pytest.approx(1e-10, rel=0.1)


def test_random_walk_spreads_with_the_root_of_time() -> None:
    ends = [
        noise(replace(SILENT, walk=1e-9), np.zeros(40_001), RATE, np.random.default_rng(i))[[10_000, 40_000]]
        for i in range(400)
    ]
    assert np.std(ends, axis=0) == pytest.approx([1e-9, 2e-9], rel=0.1)


def test_drift_is_linear_or_settles() -> None:
    t = np.arange(50_000) / RATE
    assert np.allclose(noise(replace(SILENT, drift=2e-9), 0 * t, RATE, rng()), 2e-9 * t, rtol=0, atol=1e-20)
    settling = noise(replace(SILENT, drift=2e-9, drift_settling=1.0), 0 * t, RATE, rng())
    assert settling[-1] == pytest.approx(2e-9 * (1 - np.exp(-5)), rel=1e-3)
    assert settling[10] == pytest.approx(2e-12, rel=1e-3)


def test_interpolation_error_repeats_with_half_a_wavelength() -> None:
    y = np.linspace(0, 20 * FRINGE, 20 * 200 + 1)
    error = noise(replace(SILENT, interpolation=1e-9), y, RATE, rng())
    assert np.allclose(error[:-200], error[200:], atol=1e-15)
    assert 0.8e-9 < np.abs(error).max() < 1.5e-9


def test_speckle_jumps_come_with_travel_only() -> None:
    sensor = replace(SILENT, speckle=1e5)
    assert not noise(sensor, np.zeros(10_000), RATE, rng()).any()
    steps = np.diff(noise(sensor, np.linspace(0, 1e-3, 100_000), RATE, rng()))
    jumps = np.abs(steps[steps != 0])
    assert jumps.size == pytest.approx(100, abs=35)
    assert jumps.min() >= 10e-9
    assert jumps.max() <= 60e-9


@pytest.mark.parametrize("order", [1, 3])
def test_low_pass_delays_a_ramp(order: int) -> None:
    tau, v, fine = 1e-3, 1e-4, 4e4
    x = v * np.arange(40_000) / fine
    y = filtered(replace(SILENT, low_pass=tau, low_pass_order=order), x, fine)
    delay = (x[-1] - y[-1]) / v
    if order == 1:
        assert delay == pytest.approx(tau, rel=0.01)
    else:
        assert tau < delay < 2.5 * tau
    gain = np.abs(
        np.fft.rfft(
            filtered(
                replace(SILENT, low_pass=tau, low_pass_order=order),
                np.sin(2 * np.pi / (2 * np.pi * tau) * np.arange(40_000) / fine),
                fine,
            )[20_000:]
        )
    ).max()
    full = np.abs(np.fft.rfft(np.sin(2 * np.pi / (2 * np.pi * tau) * np.arange(40_000) / fine)[20_000:])).max()
    assert gain / full == pytest.approx(np.sqrt(0.5), rel=0.03)


def test_high_pass_lets_a_step_die_out() -> None:
    x = np.where(np.arange(40_000) < 10_000, 0.0, 1e-4)
    y = filtered(replace(SILENT, high_pass=0.5), x, RATE)
    t = (np.arange(40_000) - 10_000) / RATE
    after = t > 0.01
    assert np.allclose(y[after], 1e-4 * np.exp(-2 * np.pi * 0.5 * t[after]), atol=2e-7)


def test_gain_and_its_bend() -> None:
    x = np.linspace(0, 1e-3, 100)
    assert np.allclose(filtered(replace(SILENT, gain=0.01), x, RATE), 1.01 * x)
    bent = filtered(replace(SILENT, gain=0.01, gain_bend=2e-4), x, RATE) / np.where(x > 0, x, 1)
    assert bent[1] < 1.001 < 1.009 < bent[-1]


def test_counts_are_whole_and_nearest() -> None:
    x = np.linspace(0, 1e-6, 40_001)
    read = counts(SILENT, x, 4e4, RATE, rng())
    assert read.dtype == np.int64
    assert read.size == 10_001
    error = read * COUNT - x[::4]
    assert np.abs(error).max() <= COUNT / 2 * (1 + 1e-9)
    assert np.abs(error).max() > 0.45 * COUNT


def test_clock_and_delay_shift_the_samples() -> None:
    x = 1e-3 * np.arange(80_001) / 4e4
    fast = counts(replace(SILENT, clock=1e-3), x, 4e4, RATE, rng())
    assert fast[-1] * COUNT == pytest.approx((fast.size - 1) / RATE * 1.001 * 1e-3, abs=COUNT)
    late = counts(replace(SILENT, delay=5e-3), x, 4e4, RATE, rng())
    assert late[10_000] * COUNT == pytest.approx((1.0 - 5e-3) * 1e-3, abs=COUNT)


def test_spot_sees_the_compliance_and_the_yaw() -> None:
    sensor = Sensor(compliance=1e-7, yaw_arm=0.5)
    seen = spot(sensor, np.array([1e-6]), np.array([0.2]), np.array([4e-9]))
    assert seen[0] == pytest.approx(1e-6 + 2e-8 + 2e-9, rel=1e-12)


def test_defaults_stay_near_a_count() -> None:
    y = noise(Sensor(), np.zeros(50_000), RATE, rng())
    assert 0.5e-9 < np.std(y[:2000] - y[:2000].mean()) < 4e-9
