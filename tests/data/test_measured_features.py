"""Features of measured cycles: their sensor noise is what repeated noise makes, and nothing is claimed of aliases."""

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.segment import event_shapes, segment
from stickslip.data.trace import Trace
from stickslip.inference.features import measurement
from stickslip.inference.features.layout import LEVELS
from stickslip.inference.features.measurement import measure


def measured(model, rate, noise, seed, period=2e-3):
    t = np.arange(0, model.stop, 1 / rate)
    x = model.position(t) + np.random.default_rng(seed).normal(0, noise, t.size)
    trace = Trace("a", t, displacement=x, drive=Drive.constant(model.v0, 0.0, model.stop), noise=noise)
    return measure([trace], [segment(trace)], ring_period=period)


@pytest.mark.slow
def test_noise_of_slip_times_is_noise_over_velocity(stick_slip):
    """The scatter of 60 records that differ in their noise alone, against the stated standard deviation."""
    model = stick_slip(events=3)
    runs = [measured(model, 1e4, 0.3e-6, seed) for seed in range(60)]
    times = runs[0].layout.slices()["times"]
    found = np.array([m.values[0, 1, times] for m in runs])
    stated = np.median([m.sensor[0, 1, times] for m in runs], axis=0)
    # at the ends of the slip it takes several samples of noise to pass a level, whence the middle ones
    middle = [LEVELS.index(q) for q in (0.25, 0.75, 0.9)]
    ratio = (np.std(found, axis=0, ddof=1) / stated)[middle]
    assert np.all((ratio > 0.6) & (ratio < 1.7)), ratio


def test_a_run_pulled_backwards_is_never_read_as_one_forwards(stick_slip, refuses):
    model = stick_slip()
    t = np.arange(0, model.stop, 1e-4)
    x = model.position(t)
    forth = Trace("forth", t, displacement=x, drive=Drive.constant(model.v0, 0.0, model.stop))
    back = Trace("back", t, displacement=-x, drive=Drive.constant(-model.v0, 0.0, model.stop))
    found = [segment(forth), segment(back)]
    assert {e.direction for e in found[1].events} == {-1}
    m = measure([forth, back], found, ring_period=2e-3)
    assert m.names == ("forth",)
    assert any(text.startswith("back: slips from number 1 on") and "backwards" in text for text in m.dropped)
    refuses(lambda: measure([back], found[1:], ring_period=2e-3), "pulled backwards", 'unit = "-1 um"')


def test_slips_beyond_the_most_that_are_used_are_counted(stick_slip):
    model = stick_slip()
    t = np.arange(0, model.stop, 1e-4)
    trace = Trace("a", t, displacement=model.position(t), drive=Drive.constant(model.v0, 0.0, model.stop))
    found = segment(trace)
    n = len(found.events)
    assert measure([trace], [found], ring_period=2e-3, most_cycles=n).dropped == ()
    assert measure([trace], [found], ring_period=2e-3, most_cycles=2).dropped == (
        f"a: 2 of {n} slips are used, the first ones",
    )


def test_without_noise_a_fiftieth_of_a_sample_is_left(stick_slip):
    """What sampling alone makes of the times of a slip: against the same motion sampled forty times as often."""
    coarse, fine = (measured(stick_slip(events=3), rate, 0.0, 0) for rate in (1e4, 4e5))
    times = coarse.layout.slices()["times"]
    assert coarse.sensor[0, 1, times] == pytest.approx(2e-6, rel=1e-3)
    off = coarse.values[0, 1, times] - fine.values[0, 1, times]
    assert np.abs(off).max() < 3 * 2e-6, off


@pytest.mark.parametrize("rate", [500.0, 1e3, 1.5e3])
def test_few_samples_of_a_slip_are_joined_by_a_curve(stick_slip, rate, monkeypatch):
    """Against the same motion sampled at 400 kHz: straight lines between 15 to 45 samples a slip bend its course."""
    model = stick_slip(events=4)
    dense = measured(model, 4e5, 0.0, 0)
    curved = measured(model, rate, 0.0, 0)
    monkeypatch.setattr(measurement, "SLIP_SAMPLES", 0.0)
    straight = measured(model, rate, 0.0, 0)
    for name in ("times", "creep"):
        part = dense.layout.slices()[name]
        off = [np.abs((m.values - dense.values)[0, 1:3, part]).max() for m in (curved, straight)]
        assert off[0] < 0.6 * off[1], (name, off)


@pytest.mark.parametrize(("rate", "claimed"), [(1e3, False), (1.9e3, False), (4e3, True)])
def test_ringing_needs_four_samples_a_period(stick_slip, rate, claimed):
    m = measured(stick_slip(ring=150e-9), rate, 1e-9, 1)
    s = m.layout.slices()
    later = m.valid[0, 1:5]
    assert later[:, s["size"]].all()
    assert later[:, s["ring"]].any() == claimed
    assert later[:, s["frequency"]].any() == claimed


def test_what_the_sensor_makes_of_every_feature_of_an_event(stick_slip):
    """The scatter of 25 records that differ in their noise alone, against what is stated for each feature."""
    model, noise = stick_slip(ring=600e-9, events=4), 20e-9
    t = np.arange(0, model.stop, 1e-4)
    found: dict[str, list[float]] = {}
    for seed in range(25):
        x = model.position(t) + np.random.default_rng(seed).normal(0, noise, t.size)
        whole = Trace("a", t, displacement=x, drive=Drive.constant(model.v0, 0.0, model.stop), noise=noise)
        events = segment(whole)
        shapes = event_shapes(whole, events)
        event, shape = events.events[2], shapes.events[2]
        for name, value in (
            ("slip", event.slip), ("recurrence", event.recurrence), ("peak_velocity", event.peak_velocity),
            ("overshoot", shape.overshoot), ("rise_time", shape.slip_times[-1] - shape.slip_times[0]),
            ("creep", shape.creep[8]), ("ring_frequency", shape.ring.frequency), ("decay_time", shape.ring.decay_time),
        ):  # fmt: skip
            found.setdefault(name, []).append(float(value))
    ratio = {name: np.std(values, ddof=1) / shapes.noise[name] for name, values in found.items()}
    assert all(0.4 < r < 2.5 for r in ratio.values()), ratio
