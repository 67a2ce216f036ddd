"""Faults put into a clean record must be found, counted and undone, and a clean record left alone."""

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.readers.repair import (
    correct_clock,
    despike,
    drop_duplicates,
    drop_nan,
    find_gaps,
    from_load_point,
    join_resets,
    unwrap,
)
from stickslip.data.resolution import estimate_resolution, noise_level
from stickslip.data.trace import Trace
from stickslip.errors import InputError

LSB = 7.91e-9
RATE = 10_000


@pytest.fixture
def record(stick_slip):
    """Time and counts of a vibrometer with 2 nm of noise."""
    model = stick_slip(ring=150e-9)
    t = np.arange(0, model.stop, 1 / RATE)
    x = model.position(t) + np.random.default_rng(3).normal(0, 2e-9, t.size)
    return t, np.round(x / LSB) * LSB


def count(repairs):
    return {repair.kind: repair.count for repair in repairs}


def test_clean_records_are_left_alone(record):
    t, x = record
    assert unwrap(x, 4096 * LSB, "x", LSB) == (x, []) or unwrap(x, 4096 * LSB, "x", LSB)[1] == []
    assert despike(x, "x", t, LSB)[1] == []
    assert join_resets(t, x, "x", True, LSB, LSB)[1] == []
    assert drop_nan(t, {"x": x}) == (None, [])
    assert drop_duplicates(t) == (None, [])
    assert find_gaps(t)[1] == []
    assert correct_clock(t, 0.0)[0] is t


def test_a_count_far_below_the_range_rounds_nothing():
    x = np.array([0.0, 0.4, 0.8, 0.2, 0.6]) * 1e-3
    result, repairs = unwrap(x, 1e-3, "x", 1e-320)
    assert np.all(np.isfinite(result))
    assert result[-1] == pytest.approx(1.6e-3)
    assert repairs[0].kind == "wrap"
    cleared = np.concatenate([np.linspace(1e-6, 2e-6, 50), np.linspace(0, 1e-6, 50)])
    result, _ = join_resets(np.arange(100.0), cleared, "x", True, 1e-320, 1e-12)
    assert np.all(np.isfinite(result))


def test_counter_wrap_is_undone_to_the_count(record):
    _, x = record
    counts = np.round(x / LSB).astype(int)
    wrapped = ((counts + 2048) % 4096 - 2048) * LSB
    result, repairs = unwrap(wrapped, 32.4e-6, "x", LSB)  # the period as a person writes it
    assert np.array_equal(np.round(result / LSB), counts)
    turns = np.abs(np.diff((counts + 2048) // 4096)).sum()
    assert turns >= 8
    assert count(repairs) == {"wrap": turns}


@pytest.mark.parametrize(
    ("channel", "period", "shown"),
    [("displacement", 32.4e-6, "32.4 µm"), ("spring_force", 2.5, "2.5 N"), ("x", 2.5, "2.5")],
)
def test_the_note_of_a_wrap_has_the_channel_s_unit(channel, period, shown):
    rising = np.linspace(0.0, 3.2, 200) * period
    _, (repair,) = unwrap(rising % period, period, channel)
    assert repair.reason == f"the counter ran over its range of {shown}"
    assert repair.count == 3


def test_counter_wrap_passes_over_nan(record):
    _, x = record
    wrapped = (x + 16.2e-6) % 32.4e-6 - 16.2e-6
    wrapped[::97] = np.nan
    result, _ = unwrap(wrapped, 32.4e-6, "x")
    good = np.isfinite(wrapped)
    assert np.allclose(result[good] - result[1], (x - x[1])[good], atol=1e-12)


def test_wrap_of_doubtful_sign_is_refused():
    with pytest.raises(InputError, match="nearly half its range"):
        unwrap(np.array([0.0, 0.49, 0.98, 0.1]), 1.0, "x")


@pytest.mark.parametrize("told", ["times", True])
def test_resets_are_joined(record, told):
    t, x = record
    moments = [0.5, 1.5, 4.4]
    cleared = x.copy()
    for moment in moments:
        i = np.searchsorted(t, moment)
        cleared[i:] -= cleared[i]
    result, repairs = join_resets(t, cleared, "x", moments if told == "times" else True, LSB, 2e-9)
    assert count(repairs) == {"reset": 3}
    assert np.abs(result - x).max() < 3 * 3 * LSB  # what is lost is the noise of one sample for each reset


def test_reset_where_there_is_none_is_refused(record):
    t, x = record
    with pytest.raises(InputError, match=r"no jump of the counter near 0\.7 s"):
        join_resets(t, x, "x", [0.7], LSB, 2e-9)


def test_spikes_are_found_counted_and_replaced(record):
    t, x = record
    rng = np.random.default_rng(5)
    places = np.sort(rng.choice(np.arange(50, t.size - 50, 7), 300, replace=False))
    spiked = x.copy()
    spiked[places] += rng.choice([-1, 1], 300) * rng.uniform(2e-6, 20e-6, 300)
    result, repairs = despike(spiked, "x", t, LSB)
    found = np.flatnonzero(result != spiked)
    assert np.isin(places, found).mean() > 0.99
    assert count(repairs) == {"spike": found.size}
    assert np.isin(found, places).mean() > 0.99
    changed = np.isin(np.arange(t.size), places) & (result != spiked)
    assert np.abs(result - x)[changed].max() < 1e-6


def test_crests_of_a_coarsely_sampled_ring_down_are_no_spikes():
    t = np.arange(400) / 2000
    x = 1e-6 * np.exp(-t / 0.1) * np.sin(2 * np.pi * 500 * t + 0.3)
    assert despike(x, "x", t, 2e-9)[1] == []


def test_noisy_stretches_are_no_spikes():
    rng = np.random.default_rng(8)
    x = np.concatenate([rng.normal(0, 1, 20_000), rng.normal(0, 8, 20_000)])
    result, _ = despike(x, "x", np.arange(x.size), 1.0)
    assert (result != x).mean() < 1e-3


def test_nan_runs_are_counted(record):
    t, x = record
    x = x.copy()
    x[0], x[100:110], x[500] = np.nan, np.nan, np.inf
    keep, (repair,) = drop_nan(t, {"x": x, "f": t})
    assert keep.sum() == t.size - 12
    assert repair.count == 12
    assert "3 runs" in repair.reason
    assert repair.where == "x, first at sample 0 (0 s)"


def test_duplicate_stamps_keep_their_first_sample():
    keep, (repair,) = drop_duplicates(np.array([0.0, 1, 1, 1, *range(2, 40)]))
    assert repair.count == 2
    assert keep[:5].tolist() == [True, True, False, False, True]
    with pytest.raises(InputError, match="rounded too coarsely"):
        drop_duplicates(np.repeat(np.arange(10.0), 3))


def test_dropped_samples_are_counted_and_not_invented():
    t = np.arange(1000) * 0.005
    lost = [100, 101, 102, 500, 998]
    times, (repair,) = find_gaps(np.delete(t, lost))
    assert repair.count == 5
    assert times == pytest.approx([t[99], t[499], t[997]])


def test_a_change_of_sampling_rate_is_no_gap():
    t = np.concatenate([np.arange(0, 100, 0.1), np.arange(100, 110, 0.01)])
    assert find_gaps(t)[1] == []
    times, (repair,) = find_gaps(np.delete(t, [300, 301, 1500]))
    assert repair.count == 3
    assert times == pytest.approx([29.9, 104.99])


def test_clock_error():
    t = 5 + np.arange(11) * 1.0
    read = 5 + (t - 5) * (1 + 40e-6)
    result, repairs = correct_clock(read, 40e-6)
    assert np.allclose(result, t, rtol=0, atol=1e-12)
    assert repairs[0].kind == "clock"
    assert "fast by 40 ppm" in repairs[0].reason
    with pytest.raises(InputError, match="beyond one per cent"):
        correct_clock(read, 0.5)


@pytest.mark.parametrize("zero", [0.0, 12e-3])
def test_a_freshly_set_down_block_begins_where_its_load_point_is(zero):
    t = np.arange(50) * 1e-3
    x = np.linspace(0.0, 1e-8, 50)
    drive = Drive(np.array([0.0, 1.0]), zero + np.array([0.0, 1e-4]))
    run = Trace("a", t, displacement=3e-4 + x, drive=drive, noise=5e-9, resolution=8e-9, virgin=True)
    found = from_load_point(run)
    assert found.displacement == pytest.approx(x - np.median(x[:5]), abs=1e-16)
    assert found.drive.position(t) == pytest.approx(1e-4 * t, abs=1e-16)
    assert [r.kind for r in found.repairs] == ["zero"]
    assert "from the load point" in found.repairs[0].reason
    assert from_load_point(run.replace(virgin=False)).displacement is run.displacement
    near = run.replace(displacement=zero + 1.5e-8 + x)  # within noise and counts
    seen = from_load_point(near)
    assert seen is near if zero == 0.0 else seen.displacement == pytest.approx(1.5e-8 + x, abs=1e-16)
    assert from_load_point(near.replace(noise=1e-9, resolution=None)).repairs
    assert bool(from_load_point(near.replace(noise=1e-9, resolution=None, hum=1e-7)).repairs) is (zero != 0.0)


@pytest.mark.parametrize("sigma", [5e-9, 50e-9])
def test_noise_of_a_moving_block(stick_slip, sigma):
    model = stick_slip()
    t = np.arange(0, model.stop, 1 / RATE)
    x = model.position(t) + np.random.default_rng(4).normal(0, sigma, t.size)
    assert noise_level(x) == pytest.approx(sigma, rel=0.1)


def test_noise_of_counts_that_stand_still_is_that_of_rounding(stick_slip):
    model = stick_slip()
    t = np.arange(0, model.stop, 1 / RATE)
    x = np.round(model.position(t) / LSB) * LSB
    assert noise_level(x, LSB) == pytest.approx(LSB / np.sqrt(12))


@pytest.mark.parametrize("scale", [1.0, 1e-6, 331.7])
def test_resolution_is_found(record, scale):
    _, x = record
    assert estimate_resolution(x * scale) == pytest.approx(LSB * scale, rel=1e-4)
    # as a file with few decimals gives it
    assert estimate_resolution(np.round(x * 1e6, 4)) == pytest.approx(LSB * 1e6, rel=0.02)


def test_a_smooth_record_has_no_resolution(record):
    t, x = record
    assert estimate_resolution(x + np.random.default_rng(1).normal(0, LSB, t.size)) is None
    assert estimate_resolution(np.zeros(100)) is None
