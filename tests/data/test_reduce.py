"""A reduced record keeps its events, and a long one is handled in seconds and bounded memory."""

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.segment import reduce_trace, segment
from stickslip.data.trace import Trace
from tests.data.long_record import INSPECT, LONG, long_record, numbers

LSB = 7.91e-9


@pytest.fixture
def trace(stick_slip):
    model = stick_slip(ring=150e-9)
    t = np.arange(0, model.stop, 5e-5)
    x = np.floor((model.position(t) + np.random.default_rng(1).normal(0, 3e-9, t.size)) / LSB) * LSB
    drive = Drive.constant(model.v0, 0.0, model.stop)
    return Trace("a", t, displacement=x, normal_load=1 + 0 * t, drive=drive, resolution=LSB, noise=3e-9)


def test_slips_stay_at_full_rate_and_creep_is_shortened(trace):
    found = segment(trace)
    short = reduce_trace(trace, found)
    assert short.time.size < 0.25 * trace.time.size
    for event in found.events:
        inside = (trace.time > event.t_onset - 0.05) & (trace.time < event.t_arrest + 0.05)
        kept = (short.time > event.t_onset - 0.05) & (short.time < event.t_arrest + 0.05)
        assert np.array_equal(short.displacement[kept], trace.displacement[inside])
    (note,) = short.repairs
    assert note.kind == "reduced"
    assert note.count == trace.time.size - short.time.size
    assert short.normal_load == pytest.approx(1.0)


def test_segmentation_of_the_reduced_record_is_the_same(trace):
    found = segment(trace)
    again = segment(reduce_trace(trace, found), settings=found.settings)
    assert len(again.events) == len(found.events)
    for a, b in zip(again.events, found.events, strict=True):
        assert a.t_onset == pytest.approx(b.t_onset, abs=1e-5)
        assert a.slip == pytest.approx(b.slip, abs=LSB)


def test_means_of_creep_are_finer_than_a_count(trace, stick_slip):
    """Averages over the windows of creep follow the true position much closer than one count."""
    model = stick_slip(ring=150e-9)
    short = reduce_trace(trace, segment(trace))
    middle = (np.abs(np.mod(short.time, 1.0) - 0.5) < 0.25) & (short.time < 6)
    error = short.displacement[middle] + LSB / 2 - model.position(short.time[middle])
    assert middle.sum() > 100
    assert np.sqrt(np.mean(error**2)) < LSB / 8


def test_a_record_without_events_is_shortened_too():
    t = np.arange(0, 100, 1e-3)
    trace = Trace("s", t, displacement=1e-9 * t, drive=Drive.constant(50e-6, 0, 100))
    short = reduce_trace(trace, segment(trace), points=200)
    assert 100 < short.time.size <= 200
    assert short.displacement == pytest.approx(1e-9 * short.time, abs=1e-20)
    assert np.all(np.diff(short.time) > 0)


@pytest.mark.long
@pytest.mark.parametrize(("ending", "seconds"), [("npy", 15), ("csv", 45)])
def test_ten_million_samples(tmp_path, ending, seconds):
    """Read, segmented and reduced in seconds of processor time and less than 1 GB; inspected likewise."""
    n = 10_000_000
    path = long_record(tmp_path, ending, n)
    size, events, short, spent, memory = numbers(LONG, path)
    assert size == n
    assert events == 133
    assert short < n / 5
    assert memory < 1e9
    assert spent < seconds
    code, spent, memory = numbers(INSPECT, path)
    assert code == 0
    assert memory < 1e9
    assert spent < seconds
