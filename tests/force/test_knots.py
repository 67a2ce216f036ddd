"""Knots stand for the record: means where it creeps, its samples where it is fast, all under one test function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from stickslip.inference.force.kernels import kernels
from stickslip.inference.force.knots import CREEP, _between, bow, knots
from stickslip.inference.force.reading import Reading
from stickslip.inference.force.smoothing import onward
from stickslip.inference.force.windows import start_of_motion

RATE = 1e4


@pytest.mark.parametrize("half", [3e-4, 1e-3, 4e-3])
def test_kernels_are_exact_for_a_parabola(half):
    phi, first, second = kernels(half, RATE)
    h = phi.size // 2
    s = np.arange(-h, h + 1) / RATE
    parabola = 3.0 - 7.0 * s + 11.0 * s * s
    assert phi.sum() == pytest.approx(1.0, abs=1e-13)
    assert phi @ s == pytest.approx(0.0, abs=1e-15)
    assert first @ parabola == pytest.approx(-7.0, rel=1e-12)
    assert second @ parabola == pytest.approx(22.0, rel=1e-8)
    assert np.all(phi >= 0.0)


@pytest.mark.parametrize("half", [3e-4, 5e-4, 2e-3])
def test_kernels_have_the_moments_of_the_derivatives_of_the_test_function(half):
    """Also where it spans a few samples only; the derivatives themselves, sampled, do not."""
    phi, first, second = kernels(half, RATE)
    h = phi.size // 2
    s = np.arange(-h, h + 1) / RATE
    assert first @ s**3 == pytest.approx(3.0 * (phi @ s**2), rel=1e-7)
    assert second @ s**4 == pytest.approx(12.0 * (phi @ s**2), rel=1e-7)


@pytest.mark.parametrize("half", [2e-3, 4e-3])
def test_the_weak_form_is_the_mean_of_rate_and_acceleration(half):
    """phi'' on x is phi on x'', also where x'' is no constant over the test function."""
    phi, first, second = kernels(half, RATE)
    h = phi.size // 2
    t = 0.37 + np.arange(-h, h + 1) / RATE
    w = 2.0 * np.pi / (3.0 * half)
    x, v, a = np.sin(w * t), w * np.cos(w * t), -w * w * np.sin(w * t)
    assert first @ x == pytest.approx(phi @ v, abs=2e-3 * w)
    assert second @ x == pytest.approx(phi @ a, abs=5e-3 * w * w)


def test_a_force_at_the_knots_is_averaged_as_the_motion_is(small):
    """The mean of a smooth force between knots is that of its samples."""
    phi, _, _ = kernels(small.times.half, small.traces[0].sampling_rate)
    h = phi.size // 2
    for k, trace in zip(small.knots, small.traces, strict=True):
        np.testing.assert_allclose(np.asarray(k.mean.sum(axis=1)).ravel(), 1.0, atol=1e-12)

        def force(t):
            return np.sin(2.0 * np.pi * 3.0 * t) + 5.0 * t

        got = k.mean @ force(k.t)
        fast = np.flatnonzero(k.phase != CREEP)
        centre = np.rint((k.at[fast] - trace.time[0]) * trace.sampling_rate).astype(int)
        assert np.abs(trace.time[centre] - k.at[fast]).max() < 1e-9
        want = force(trace.time[centre[:, None] + np.arange(-h, h + 1)]) @ phi
        assert np.abs(got[fast] - want).max() < 2e-3
        slow = k.phase == CREEP
        np.testing.assert_allclose(k.mean[np.flatnonzero(slow)] @ (5.0 * k.t), 5.0 * k.at[slow], atol=1e-12)


def test_forces_between_knots_are_of_fourth_order():
    """Friction falls with slip as exp(-s): its chord lies above it everywhere, the cubic crosses it."""
    rng = np.random.default_rng(3)
    errors = []
    for number in (20, 40, 80, 160):
        t = np.cumsum(rng.uniform(0.6, 1.4, number + 1)) / number
        moments = np.linspace(t[0], t[-1], 3000).reshape(3, -1)
        nodes, weights = _between(t, moments)
        np.testing.assert_allclose((weights * (t[nodes] ** 3 - t[nodes])).sum(axis=0), moments**3 - moments, atol=1e-12)
        off = (weights * np.exp(-5.0 * t[nodes])).sum(axis=0) - np.exp(-5.0 * moments)
        errors.append(np.sqrt(np.mean(off**2)))
        chord = np.interp(moments, t, np.exp(-5.0 * t)) - np.exp(-5.0 * moments)
        assert abs(off.mean()) < 0.05 * chord.mean()
    assert np.log2(np.array(errors[:-1]) / errors[1:]).mean() == pytest.approx(4.0, abs=0.4)


def test_points_have_the_motion_under_the_test_function(small):
    """Rate and acceleration at a point are those of the reading there, which loses energy only in the slip."""
    k, trace = small.knots[0], small.traces[0]
    phi, first, second = kernels(small.times.half, trace.sampling_rate)
    h = phi.size // 2
    fast = np.flatnonzero(k.phase != CREEP)
    centre = np.rint((k.at[fast] - trace.time[0]) * trace.sampling_rate).astype(int)
    x = trace.displacement[centre[:, None] + np.arange(-h, h + 1)]
    x = x - x[:, h : h + 1]
    # the mains' hum, nanometres, is taken off beforehand
    assert np.abs(k.rate[fast] - x @ first).max() < 1e-3 * np.abs(k.rate).max()
    assert np.abs(k.acceleration[fast] - x @ second).max() < 1e-3 * np.abs(k.acceleration).max()


def test_windows_are_made_of_the_samples(small):
    for k, trace in zip(small.knots, small.traces, strict=True):
        slow = k.phase == CREEP
        knot = np.searchsorted(k.t, k.at[slow])
        np.testing.assert_array_equal(k.t[knot], k.at[slow])
        made_of, count = k.reading.displacement[knot], k.reading.count
        np.testing.assert_allclose(made_of @ k.reading.sums(k.reading.samples), k.x[knot], rtol=0.0, atol=1e-15)
        assert np.all((made_of != 0.0) @ count > 1)
        np.testing.assert_allclose(k.drive[knot], trace.drive.position(k.at[slow]), atol=1e-13)
        np.testing.assert_allclose(made_of @ count, 1.0, atol=1e-12)
        half = 0.25 * np.minimum(k.t[knot] - k.t[knot - 1], k.t[knot + 1] - k.t[knot])
        edges = np.searchsorted(trace.time, [k.t[knot] - half, k.t[knot] + half])
        far = np.diff(edges, axis=0)[0] > 20
        assert far.sum() > 20
        for j, a, b in zip(knot[far], *edges[:, far], strict=True):
            assert k.x[j] == pytest.approx(trace.displacement[a:b].mean(), abs=2e-8)


def test_means_over_windows_are_made_of_values_in_their_middles():
    """Friction falls with slip as exp(-s): its mean over a window lies above the value in the middle."""
    rng = np.random.default_rng(5)
    shape, bent, plain = rng.uniform(0.6, 1.4, 20), [], []
    for number in (40, 80, 160, 320):
        width = np.tile(shape, number // 20)
        width = width / width.sum()
        edges = np.append(0.0, np.cumsum(width))
        t = 0.5 * (edges[1:] + edges[:-1])
        value, mean = np.exp(-5.0 * t), -np.diff(np.exp(-5.0 * edges)) / (5.0 * width)
        matrix, inner = bow(t, width, np.zeros(0)), (t > 0.15) & (t < 0.85)
        bent.append(np.sqrt(np.mean((value + matrix @ value - mean)[inner] ** 2)))
        plain.append(np.sqrt(np.mean((value - mean)[inner] ** 2)))
        # the other way the neighbours are bent otherwise
        assert np.sqrt(np.mean((mean - matrix @ mean - value)[inner] ** 2)) < 0.25 * plain[-1]
        np.testing.assert_allclose(matrix @ (3.0 - 2.0 * t), 0.0, atol=1e-12)
    assert np.log2(np.array(plain[:-1]) / plain[1:]).mean() == pytest.approx(2.0, abs=0.1)
    assert np.log2(np.array(bent[:-1]) / bent[1:]).mean() > 2.9  # 4 where all windows are of one width
    assert bent[-1] < 0.02 * plain[-1]


def test_no_mean_reaches_over_a_break_of_the_drive_or_into_samples():
    width = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    t = np.array([0.0, 0.1, 0.6, 1.6, 2.6, 3.6, 4.6, 5.6, 6.2])
    rows = np.diff(bow(t, width, np.array([3.1])).indptr) * (abs(bow(t, width, np.array([3.1]))).sum(axis=1) > 0.0)
    np.testing.assert_array_equal(np.flatnonzero(rows), [3, 6])


def test_knots_go_forward_in_time(small, begun):
    for k in (*small.knots, *begun.knots):
        assert np.all(np.diff(k.t) > 0.0)
        assert np.all(np.diff(k.event) >= 0)


def test_no_point_belongs_to_a_stick_with_an_unknown_past(small, begun):
    for k in begun.knots:
        assert not k.virgin
        assert k.of.min() == 1
    for k in small.knots:
        assert k.virgin
        assert k.of.min() == 0
    thinned = knots(replace(small.traces[0], virgin=False), small.found[0], small.times)
    assert thinned.of.min() == 1


def flat(x, **options):
    x = np.asarray(x, float)
    given = {"weight": np.ones(x.size), "slow": np.ones(x.size, bool), "event": np.zeros(x.size, int), "noise": 1e-9}
    return onward(x, **{**given, **options}) @ x


def test_a_way_that_goes_on_is_left_alone():
    x = np.cumsum(np.abs(np.random.default_rng(0).standard_normal(50))) * 1e-9
    np.testing.assert_array_equal(flat(x), x)
    np.testing.assert_array_equal(flat(-x), -x)


def test_steps_back_of_the_size_of_noise_are_taken_out():
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 1e-7, 60) + 1e-9 * rng.standard_normal(60)
    assert np.any(np.diff(x) < 0.0)
    found = flat(x)
    assert np.all(np.diff(found) >= 0.0)
    assert np.abs(found - x).max() < 5e-9
    assert found.mean() == pytest.approx(x.mean(), abs=1e-15)


def test_a_real_way_back_is_kept():
    x = np.concatenate([np.linspace(0.0, 1e-7, 30), np.linspace(1e-7, 6e-8, 10)])
    np.testing.assert_array_equal(flat(x), x)


def test_samples_and_other_events_are_not_made_to_go_on():
    x = np.array([0.0, 1.0, 0.5, 2.0, 3.0, 0.0, 1.0, 0.9, 2.0]) * 1e-9
    fast = np.zeros(9, bool)
    np.testing.assert_array_equal(flat(x, slow=fast), x)
    event = np.array([0, 0, 0, 0, 0, 1, 1, 1, 1])
    found = flat(x, event=event)
    assert found[4] == pytest.approx(3e-9)
    assert found[5] == pytest.approx(0.0, abs=1e-20)
    assert np.all(np.diff(found[:5]) >= 0.0)
    assert np.all(np.diff(found[5:]) >= 0.0)


def test_samples_of_equal_weights_are_one_group():
    """What a group holds is what its samples would by themselves, and neighbours that differ anywhere are apart."""
    rng = np.random.default_rng(2)
    groups = np.repeat(np.arange(5), [3, 1, 4, 2, 2])
    parts = [csr_array(rng.standard_normal((4, 5)) * (rng.random((4, 5)) < 0.6)) for _ in range(3)]
    dense = [part.toarray()[:, groups] for part in parts]
    dense[2][0, 6] += 1.0  # the samples 4 to 7 of the third part into 4 and 5, 6, 7
    samples, other = rng.standard_normal((2, 12))
    made = Reading.of(samples, *map(csr_array, dense))
    np.testing.assert_array_equal(made.count, [3, 1, 2, 1, 1, 2, 2])
    for found, whole in zip((made.displacement, made.rate, made.acceleration), dense, strict=True):
        np.testing.assert_allclose(found @ made.sums(other), whole @ other, atol=1e-13)
        np.testing.assert_allclose((found * made.count) @ found.T.toarray(), whole @ whole.T, atol=1e-13)


@pytest.mark.parametrize("count", [2e-9, 8e-9])
def test_the_fast_part_begins_where_a_count_is_passed_in_half_a_test_function(count):
    """A velocity that grows evenly from rest: passed from where it is a count in so many samples."""
    h, gain = 20, 1e-13  # m a sample, per sample
    x = 0.5 * gain * np.arange(6000.0) ** 2
    begin = start_of_motion(100, 5000, count * np.round(x / count), count, h)
    assert begin == pytest.approx(count / h / gain, rel=0.15)
    assert start_of_motion(100, 5000, x, 0.0, h) == 100  # a sensor without counts
    assert start_of_motion(3000, 5000, x, count, h) == max(3000, begin) or begin > 3000
    assert start_of_motion(5000, 4990, x, count, h) == 5000
