"""Shapes of events with known slips, ring-downs, creep and holds."""

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.segment import LEVELS, crept, event_shapes, segment
from stickslip.data.trace import Trace

DECAY = {
    "exponential": lambda t, fold: np.exp(-t / fold),
    "linear": lambda t, fold: np.clip(1 - t / (2 * fold), 0, None),
    "algebraic": lambda t, fold: 1 / (1 + 3 * t / fold),
}


def record(model, rate, *, noise=2e-9, ring=0.0, frequency=400.0, law="exponential", fold=0.01, drive=None, slope=0.0):
    """A trace of that motion, ringing after every arrest by one of the laws."""
    t = np.arange(0, model.stop, 1 / rate)
    x = model.position(t) + slope * t
    for arrest in model.arrests:
        after = t - arrest
        inside = (after > 0) & (after < model.period / 2)
        swing = ring * DECAY[law](np.clip(after, 0, None), fold) * np.sin(2 * np.pi * frequency * after)
        x -= np.where(inside, swing, 0.0)
    x += np.random.default_rng(5).normal(0, noise, t.size)
    return Trace("a", t, displacement=x, drive=drive or Drive.constant(model.v0, 0.0, model.stop), noise=noise)


def shapes(trace):
    return event_shapes(trace, segment(trace))


@pytest.mark.parametrize("rate", [1e4, 5e4])
def test_times_of_a_half_cosine(stick_slip, rate):
    model = stick_slip()
    trace = record(model, rate, noise=0.0)
    found = segment(trace)
    for event, shape in zip(found.events, event_shapes(trace, found).events, strict=True):
        # between onset and arrest the half cosine passes each level of what is left of it at a known time
        begin = model.starts[event.index]
        low = 0.5 * (1 - np.cos(model.w * (event.t_onset - begin)))
        exact = begin + np.arccos(1 - 2 * (low + np.array(LEVELS) * (1 - low))) / model.w - event.t_onset
        assert shape.slip_times == pytest.approx(exact, abs=2e-5)


@pytest.mark.parametrize("law", DECAY)
@pytest.mark.parametrize("frequency", [180.0, 400.0])
def test_ring_down_and_its_law(stick_slip, law, frequency):
    fold = 0.015
    found = shapes(record(stick_slip(), 2e4, ring=150e-9, law=law, frequency=frequency, fold=fold))
    assert found.frequency == pytest.approx(frequency, rel=0.003)
    assert found.decay == law
    rings = [shape.ring for shape in found.events]
    assert all(ring is not None for ring in rings[:-1])
    assert sum(ring.law == law for ring in rings if ring) >= 4
    if law == "exponential":
        assert rings[1].decay_time == pytest.approx(fold, rel=0.05)
    assert rings[1].amplitude == pytest.approx(150e-9 * DECAY[law](1 / frequency, fold), rel=0.07)


def test_nothing_rings_in_a_silent_record(stick_slip):
    found = shapes(record(stick_slip(), 2e4))
    assert np.isnan(found.frequency)
    assert all(shape.ring is None for shape in found.events)
    assert "above the level of the sticks" in found.missing["ring"]


def test_hum_that_goes_on_all_the_time_is_no_ring_down(stick_slip):
    trace = record(stick_slip(), 2e4)
    hum = 100e-9 * np.sin(2 * np.pi * 150.0 * trace.time)
    found = shapes(trace.replace(displacement=trace.displacement + hum))
    assert np.isnan(found.frequency)


def test_an_alias_is_not_claimed(stick_slip):
    """400 Hz sampled at 1 kHz are 2.5 samples a period."""
    found = shapes(record(stick_slip(), 1e3, ring=150e-9))
    assert np.isnan(found.frequency)
    assert found.missing["ring"]
    assert shapes(record(stick_slip(), 2e3, ring=150e-9)).frequency == pytest.approx(400.0, rel=0.01)


def test_overshoot_is_the_arrest_less_the_rest(stick_slip):
    model = stick_slip(events=4)
    trace = record(model, 2e4, noise=0.0)
    x = trace.displacement.copy()
    for arrest in model.arrests:  # after the arrest the block falls back by 200 nm within a few ms
        x -= 200e-9 * (1 - np.exp(-np.clip(trace.time - arrest, 0, None) / 3e-3))
    found = shapes(trace.replace(displacement=x))
    crept = model.creep * 2.53 * model.duration
    assert [s.overshoot for s in found.events] == pytest.approx([200e-9 - crept] * 4, abs=3e-9)


def test_creep_before_an_onset_is_aligned_at_it(stick_slip):
    model = stick_slip(events=4)
    trace = record(model, 1e4, noise=0.0)
    found = segment(trace)
    told = event_shapes(trace, found)
    ahead = told.creep_before
    assert np.all(np.diff(np.log(ahead)) == pytest.approx(np.log(ahead[1] / ahead[0])))
    for event, shape in zip(found.events[1:], told.events[1:], strict=True):
        begin = model.starts[event.index]
        slipped = model.size / 2 * (1 - np.cos(model.w * (event.t_onset - begin)))
        exact = slipped + model.creep * (ahead - (event.t_onset - begin))
        far = ahead > 4 * (event.t_onset - begin)
        assert far.sum() > 8
        assert shape.creep[far] == pytest.approx(exact[far], abs=5e-9)


def test_creep_between_two_slips_is_that_from_where_the_block_has_settled(stick_slip):
    model = stick_slip(events=4)
    trace = record(model, 1e4, noise=0.0, ring=100e-9)
    found = segment(trace)
    told = crept(trace, found)
    assert np.isnan(told[0]) and told.size == 4
    duration = np.median([e.duration for e in found.events])
    for before, event, value in zip(found.events, found.events[1:], told[1:], strict=False):
        slipped = model.position(event.t_onset) - model.position(model.starts[event.index])
        crawled = model.creep * (model.starts[event.index] - before.t_arrest - 2.53 * duration)
        assert value == pytest.approx(slipped + crawled, abs=5e-9)


def test_displacement_in_a_hold():
    t = np.arange(0, 7, 1e-3)
    drive = Drive.from_pieces([1.5, 4.5, 7.0], [50e-6, 0.0, 50e-6])
    x = np.zeros_like(t)
    for onset in (1.0, 5.0, 6.0):
        x += 20e-6 * (1 - np.cos(np.pi * np.clip((t - onset) / 0.03, 0, 1)))
    x += 60e-9 * np.clip((t - 1.5) / 3.0, 0, 1)  # over the whole hold
    trace = Trace("a", t, displacement=x, drive=drive, noise=1e-10)
    found = segment(trace)
    told = event_shapes(trace, found)
    assert [len(s.hold_motion) for s in told.events] == [0, 1, 0]
    assert told.events[1].hold_motion[0] == pytest.approx(60e-9 * 0.97, rel=0.01)
    assert "hold_motion" not in told.missing


def test_too_few_samples_and_no_events(stick_slip):
    model = stick_slip(duration=0.3, period=6.0, v0=10e-6)
    trace = record(model, 30.0, noise=1e-9)
    told = shapes(trace)
    assert "samples a slip" in told.missing["slip_times"]
    assert all(np.isnan(s.slip_times).all() for s in told.events)
    t = np.linspace(0, 10, 1000)
    slide = Trace("s", t, displacement=5e-5 * t, drive=Drive.constant(5e-5, 0.0, 10.0))
    assert shapes(slide).events == ()
