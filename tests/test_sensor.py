"""The vibrometer's chain, each part alone against what it should do."""

from __future__ import annotations

import itertools

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.effects import Motion, make
from stickslip.errors import InputError
from stickslip.physics.contact import power_law_bank
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.physics.sensor import Vibrometer, flicker_noise, measure, random_walk, white_noise
from stickslip.physics.sensor.chain import FRINGE, low_pass
from stickslip.simulation.scenario.schema import SensorTable

RATE = 10_000.0
T = np.arange(20_000) / RATE


def still(t: np.ndarray) -> np.ndarray:
    return np.zeros_like(t)


def ramp(t: np.ndarray) -> np.ndarray:
    return 5e-6 * np.clip(t, 0.0, None)


def test_everything_off_is_the_truth():
    np.testing.assert_array_equal(measure(Vibrometer(resolution=0.0), ramp, T), ramp(T))


def test_counts_are_whole_and_never_above_the_truth():
    y = measure(Vibrometer(), ramp, T)
    counts = y / 7.91e-9
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    behind = ramp(T) - y
    assert behind.min() >= -1e-20
    assert behind.max() < 7.91e-9


def test_dither_makes_the_mean_right():
    """Floor takes half a count off on average; without dither the mean of a still signal is stuck at a whole count."""
    at = 0.3 * 7.91e-9
    plain = measure(Vibrometer(), lambda t: np.full_like(t, at), T).mean()
    dithered = measure(Vibrometer(dither=True, seed=2), lambda t: np.full_like(t, at), T).mean()
    assert plain == 0.0
    assert dithered + 0.5 * 7.91e-9 == pytest.approx(at, abs=0.02 * 7.91e-9)


def test_counter_wraps_to_what_unwrapping_restores():
    v = Vibrometer(counter_steps=64)
    y = measure(v, ramp, T)
    assert v.wrap == pytest.approx(64 * 7.91e-9)
    assert np.ptp(y) < v.wrap
    restored = np.unwrap(y, period=v.wrap)
    np.testing.assert_allclose(restored, measure(Vibrometer(), ramp, T), atol=1e-12)


def test_clear_starts_again_from_zero():
    y = measure(Vibrometer(resolution=0.0, clears=(0.5, 1.0)), ramp, T)
    np.testing.assert_allclose(
        y, np.where(T < 0.5, ramp(T), np.where(T < 1.0, ramp(T - 0.5), ramp(T - 1.0))), atol=1e-15
    )


def test_gain_delay_drift_and_clock():
    off = {"resolution": 0.0}
    np.testing.assert_allclose(measure(Vibrometer(**off, gain=0.01), ramp, T), 1.01 * ramp(T), rtol=1e-12)
    np.testing.assert_allclose(measure(Vibrometer(**off, delay=0.1), ramp, T), ramp(T - 0.1), atol=1e-18)
    np.testing.assert_allclose(measure(Vibrometer(**off, drift=3e-9), still, T), 3e-9 * T, atol=1e-20)
    fast = measure(Vibrometer(**off, clock_error=1e-3), ramp, T)
    np.testing.assert_allclose(fast, ramp(T / 1.001), atol=1e-18)


def test_low_pass_is_exact_for_a_ramp_and_starts_settled():
    tau = 3e-3
    y = measure(Vibrometer(resolution=0.0, low_pass=tau), ramp, T)
    slope = 5e-6
    np.testing.assert_allclose(y, slope * (T - tau * (1 - np.exp(-T / tau))), atol=1e-15)
    np.testing.assert_allclose(low_pass(np.full(50, 4.0), 7.0), 4.0, rtol=1e-12)


def test_high_pass_returns_to_zero_at_its_time_constant():
    corner = 0.5
    step = measure(Vibrometer(resolution=0.0, high_pass=corner), lambda t: np.where(t < 0.2, 0.0, 1e-6), T)
    tau = 1 / (2 * np.pi * corner)
    after = T > 0.21
    np.testing.assert_allclose(step[after], 1e-6 * np.exp(-(T[after] - 0.2) / tau), rtol=2e-3)


def test_interpolation_error_has_the_period_of_a_fringe():
    y = measure(Vibrometer(resolution=0.0, interpolation_error=2e-9), ramp, T)
    error = y - ramp(T)
    assert 2e-9 < np.abs(error).max() < 3e-9
    shifted = np.interp(ramp(T) + FRINGE, ramp(T), error)
    inside = ramp(T) + FRINGE < ramp(T)[-1]
    np.testing.assert_allclose(shifted[inside], error[inside], atol=2e-12)


def test_mains_is_a_sine():
    y = measure(Vibrometer(resolution=0.0, mains=1e-9, mains_frequency=60.0), still, T)
    np.testing.assert_allclose(y, 1e-9 * np.sin(2 * np.pi * 60 * T), atol=1e-20)


def density(y: np.ndarray, frequency: float) -> float:
    """One-sided power density about a frequency (m^2/Hz)."""
    from scipy.signal import welch

    f, p = welch(y, RATE, nperseg=1024)
    return float(np.mean(p[(f > 0.7 * frequency) & (f < 1.4 * frequency)]))


def test_white_noise_has_its_density_at_every_frequency():
    y = white_noise(np.random.default_rng(1), 200_000, 1e-11, RATE)
    for frequency in (50.0, 500.0, 3000.0):
        assert density(y, frequency) == pytest.approx(1e-22, rel=0.1)


def test_flicker_noise_falls_as_one_over_f():
    y = flicker_noise(np.random.default_rng(2), 200_000, 1e-9, RATE)
    for frequency in (50.0, 500.0, 2000.0):
        assert density(y, frequency) * frequency == pytest.approx(1e-18, rel=0.15)


def test_random_walk_grows_as_the_root_of_time():
    ends = [random_walk(np.random.default_rng([3, i]), 10_001, 2e-9, RATE)[[2500, 10_000]] for i in range(400)]
    rms = np.sqrt(np.mean(np.square(ends), axis=0))
    assert rms == pytest.approx([1e-9, 2e-9], rel=0.12)


def moving(t: np.ndarray) -> np.ndarray:
    """Rest, 50 um in 25 ms, rest."""
    return 5e-5 * np.clip((t - 1.0) / 0.025, 0.0, 1.0)


def test_speckle_and_drop_outs_need_motion():
    v = Vibrometer(resolution=0.0, speckle_rate=2e5, speckle_jump=3e-8, dropout_rate=2e5, dropout_time=5e-4, seed=1)
    y = measure(v, moving, T)
    before = T < 1.0
    np.testing.assert_array_equal(y[before], 0.0)
    assert np.ptp(y[T > 1.03]) == 0.0
    assert y[-1] != pytest.approx(5e-5, abs=1e-9)


def test_drop_outs_lose_whole_half_fringes():
    y = measure(Vibrometer(resolution=0.0, dropout_rate=1e5, dropout_time=5e-4, seed=3), moving, T)
    lost = (5e-5 - y[-1]) / (0.5 * FRINGE)
    assert lost > 1
    assert lost == pytest.approx(round(lost), abs=1e-6)


def test_same_seed_same_reading_and_parts_do_not_share_a_stream():
    settings = {"resolution": 0.0, "white": 1e-11, "random_walk": 1e-9, "seed": 9}
    first = measure(Vibrometer(**settings), ramp, T)
    np.testing.assert_array_equal(first, measure(Vibrometer(**settings), ramp, T))
    alone = measure(Vibrometer(**(settings | {"random_walk": 0.0})), ramp, T)
    walk = measure(Vibrometer(**(settings | {"white": 0.0})), ramp, T)
    np.testing.assert_allclose(first, alone + walk - ramp(T), atol=1e-18)


def test_a_counter_needs_a_resolution():
    with pytest.raises(InputError, match="resolution"):
        measure(Vibrometer(resolution=0.0, counter_steps=10), ramp, T)
    with pytest.raises(InputError, match="two samples"):
        measure(Vibrometer(), ramp, T[:1])


def test_effects_of_the_sensor_stand_in_the_order_of_the_instrument():
    """Whatever order they are named in: what it looks at, low-pass, high-pass, scale, drift."""
    chain = {
        "machine-compliance": {"compliance": 1e-7},
        "sensor-low-pass": {"time_constant": 1e-3},
        "sensor-high-pass": {"cutoff": 0.5},
        "sensor-gain": {"gain": 0.05},
        "sensor-drift": {"rate": 5e-8},
    }
    x, t, force, lag, slow = 3e-5, 20.0, 0.2, 2e-7, 1e-6
    # the filters' states say how far the reading lags, and what of it is slow
    states = {"sensor-low-pass": jnp.asarray(lag), "sensor-high-pass": jnp.asarray(slow)}
    expected = (x + 1e-7 * force - lag - slow) * 1.05 + 5e-8 * t
    bank, still = power_law_bank(0.26, 1e-6, 3.2, n=8), LoadPoint(jnp.array([0.0, 1.0]), jnp.zeros(2))
    for tags in itertools.permutations(chain):
        model = Model(Block(), bank, Weakening(), still, tuple(make(tag, **chain[tag]) for tag in tags))
        state = eqx.tree_at(lambda s: s.memory, model.rest(), tuple(states.get(tag, ()) for tag in tags))
        motion = Motion(*map(jnp.asarray, (t, 1e-3, x, 0.0, 0.0, 0.0, 0.0)))
        assert float(model.read(state, motion, jnp.asarray(force))) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"resolution": -8e-9}, "sensor.resolution"),
        ({"low_pass": np.nan}, "sensor.low_pass"),
        ({"white": -1e-12}, "sensor.white"),
        ({"clock_error": -1.0}, "sensor.clock_error"),
        ({"delay": "3 m"}, r"sensor.delay: the unit 'm' is not one of s"),
        ({"resolution": 0.0, "counter_steps": 4096}, "sensor.resolution: a counter needs a resolution"),
    ],
)
def test_an_impossible_vibrometer_is_refused_where_it_is_made(settings, key):
    with pytest.raises(InputError, match=key):
        Vibrometer(**settings)


def test_texts_with_units_are_read_as_those_of_a_scenario_file():
    texts = {
        "resolution": "8 nm", "gain": "0.01", "interpolation_error": "2 nm", "delay": "1 ms", "low_pass": "2 ms",
        "high_pass": "3 mHz", "drift": "1 um/min", "random_walk": "2 nm/s**0.5", "white": "3 pm/Hz**0.5",
        "flicker": "4 nm", "mains": "5 nm", "mains_frequency": "0.06 kHz", "speckle_rate": "2/mm",
        "speckle_jump": "6 nm", "dropout_rate": "3 1/m", "dropout_time": "4 ms", "clock_error": "1e-5",
    }  # fmt: skip
    given = Vibrometer(**texts, seed=3)
    assert given == Vibrometer(**SensorTable(**texts, seed=3).model_dump(exclude={"clear_at_arrest"}))
    assert (given.drift, given.white) == pytest.approx((1e-6 / 60.0, 3e-12), rel=1e-12)


def test_a_vibrometer_shows_what_was_chosen():
    assert repr(Vibrometer()) == "Vibrometer(resolution=7.91 nm)"
    said = repr(Vibrometer(drift=-1e-9, dither=True, low_pass="0.1 ms", gain=0.01))
    assert said == "Vibrometer(resolution=7.91 nm, gain=0.01, low_pass=100 µs, drift=-1 nm/s, dither=True)"
    chosen = Vibrometer(resolution=0.0, clears=(0.5,), white=2e-12)
    assert repr(chosen) == "Vibrometer(resolution=0 m, clears=(0.5,), white=2 pm/Hz**0.5)"


@pytest.mark.parametrize("times", [[0.0, 0.1, 0.5, 0.6], [0.5, 0.1], [0.0, np.nan, 0.2], [1.0, 1.0]])
def test_a_vibrometer_refuses_times_of_another_sampling(times):
    """Its filters and noise are those of one rate."""
    with pytest.raises(InputError, match="do not increase evenly"):
        measure(Vibrometer(), ramp, np.array(times))
