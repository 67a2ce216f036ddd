"""Onset and arrest against closed forms, on clean, noisy, counted, unevenly sampled and force-only records."""

from itertools import pairwise

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.segment import PHASES, block_motion, choose_settings, segment, segment_motion, velocity
from stickslip.data.trace import Trace
from stickslip.errors import InputError

LSB = 7.91e-9


def of(segmentation, name, first=0):
    return np.array([getattr(event, name) for event in segmentation.events[first:]])


def displacement(model, rate=10_000.0, noise=0.0, count=None, seed=1, **more):
    t = np.arange(0, model.stop, 1 / rate)
    x = model.position(t)
    if noise:
        x = x + np.random.default_rng(seed).normal(0, noise, t.size)
    if count:
        x = np.floor(x / count) * count
    drive = Drive.constant(model.v0, 0.0, model.stop)
    return Trace("a", t, displacement=x, drive=drive, resolution=count, noise=noise or None, **more)


def spring_force(model, stiffness, rate=2000.0, noise=0.0, known=True, seed=2):
    t = np.arange(0, model.stop, 1 / rate)
    force = stiffness * (model.v0 * t - model.position(t)) + np.random.default_rng(seed).normal(0, noise, t.size)
    drive = Drive.constant(model.v0, 0.0, model.stop)
    return Trace("f", t, spring_force=force, drive=drive, noise=noise, spring_stiffness=stiffness if known else None)


@pytest.mark.parametrize("rate", [5e3, 10e3, 50e3])
@pytest.mark.parametrize("v0", [50e-6, 200e-6])
def test_onset_and_arrest_to_a_fraction_of_a_sample(stick_slip, rate, v0):
    model = stick_slip(v0=v0, period=75e-6 / v0, ring=100e-9)
    result = segment(displacement(model, rate))
    assert result.regime == "stick-slip"
    assert result.settings.threshold == pytest.approx(4 * v0 + 1e-4)
    onset = of(result, "t_onset")
    arrest = of(result, "t_arrest")
    assert np.abs(onset - model.onsets(result.settings.threshold)).max() < 0.2 / rate
    assert np.abs(arrest - model.arrests).max() < 1.01 / rate  # the block stops dead within one sample
    assert of(result, "slip") == pytest.approx(model.position(arrest) - model.position(onset), abs=3e-3 * model.size)
    assert of(result, "peak_velocity") == pytest.approx(0.5 * model.size * model.w, rel=0.02)
    assert of(result, "recurrence", 1) == pytest.approx(model.period, abs=1e-9)
    assert of(result, "drive_position") == pytest.approx(v0 * onset)
    assert set(of(result, "arrest")) == {"zero"}


def test_a_block_that_never_quite_stops_is_arrested_where_it_falls_behind_the_drive(stick_slip):
    model = stick_slip()
    result = segment(displacement(model))
    assert result.settings.arrest == "drive"
    exact = model.arrests - np.arcsin(model.v0 / (0.5 * model.size * model.w)) / model.w
    assert np.abs(of(result, "t_arrest") - exact).max() < 0.2e-4
    assert all("does not stop" in event.warnings[0] for event in result.events)


def test_counts_of_8_nm_and_noise_cost_less_than_a_sample(stick_slip):
    model = stick_slip(ring=200e-9)
    clean = segment(displacement(model))
    trace = displacement(model, noise=3e-9, count=LSB)
    result = segment(trace, settings=clean.settings)
    own = segment(trace)
    assert len(result.events) == len(own.events) == model.events
    for event, exact, other in zip(result.events, clean.events, own.events, strict=True):
        assert event.t_onset == pytest.approx(exact.t_onset, abs=1e-4)
        assert event.t_arrest == pytest.approx(exact.t_arrest, abs=1e-4)
        assert event.slip == pytest.approx(exact.slip, abs=3 * LSB)
        assert other.t_onset == pytest.approx(exact.t_onset, abs=1e-4)


@pytest.mark.parametrize("rate", [10e3, 100e3])
def test_the_window_grows_with_the_noise_so_that_no_false_event_is_found(stick_slip, rate):
    model = stick_slip()
    for noise in (10e-9, 100e-9, 1e-6):
        result = segment(displacement(model, rate, noise))
        assert len(result.events) == model.events, noise
        assert result.settings.threshold == pytest.approx(4 * model.v0 + 1e-4)
        onset = of(result, "t_onset")
        assert np.abs(onset - model.onsets(result.settings.threshold)).max() < max(
            1.5 * result.settings.window, 2 / rate
        )


def test_uneven_sampling_and_gaps(stick_slip):
    model = stick_slip(ring=100e-9)
    trace = displacement(model)
    rng = np.random.default_rng(7)
    keep = rng.random(trace.time.size) > 0.3
    uneven = Trace("u", trace.time[keep], displacement=trace.displacement[keep], drive=trace.drive)
    onset = np.array([event.t_onset for event in segment(uneven).events])
    assert np.abs(onset - model.onsets(4 * model.v0 + 1e-4)).max() < 3e-4
    start = model.starts[2]
    hole = (trace.time < start + 0.010) | (trace.time > start + 0.014)
    before = float(trace.time[hole][trace.time[hole] < start + 0.010][-1])
    holed = Trace("h", trace.time[hole], displacement=trace.displacement[hole], drive=trace.drive, missing=(before,))
    events = segment(holed).events
    assert len(events) == model.events
    assert [bool(event.warnings) for event in events] == [False, False, True, False, False, False]
    assert "missing" in events[2].warnings[0]


def test_pulled_the_other_way(stick_slip):
    model = stick_slip()
    forth = displacement(model)
    back = Trace("b", forth.time, displacement=-forth.displacement, drive=Drive.constant(-model.v0, 0.0, model.stop))
    a, b = segment(forth), segment(back)
    assert of(a, "t_onset").tolist() == of(b, "t_onset").tolist()
    assert of(b, "direction").tolist() == [-1] * model.events
    assert of(b, "slip") == pytest.approx(of(a, "slip"))


def test_there_and_back(stick_slip):
    model = stick_slip()
    t = np.arange(0, 2 * model.stop, 1e-4)
    x = np.where(
        t < model.stop, model.position(t), model.position(np.full(1, model.stop))[0] - model.position(t - model.stop)
    )
    drive = Drive.from_pieces([model.stop, 2 * model.stop], [model.v0, -model.v0])
    result = segment(Trace("r", t, displacement=x, drive=drive))
    assert of(result, "direction").tolist() == [1] * model.events + [-1] * model.events
    assert result.events[7].t_onset - model.stop == pytest.approx(result.events[1].t_onset, abs=1e-4)


def test_spring_force_with_known_stiffness(stick_slip):
    model = stick_slip(v0=42e-6, period=1.6, duration=0.045)
    result = segment(spring_force(model, 168.0, noise=168 * 1e-6))
    assert len(result.events) == model.events
    assert of(result, "slip") == pytest.approx(model.size, abs=3e-6)
    clean = segment(spring_force(model, 168.0, noise=168 * 1e-6, seed=3), settings=result.settings)
    assert of(clean, "t_onset") == pytest.approx(of(result, "t_onset"), abs=6e-3)


def test_spring_force_without_stiffness(stick_slip):
    """The rate of loading stands for the stiffness: events are the same, lengths within a tenth."""
    model = stick_slip(v0=42e-6, period=1.6, duration=0.045)
    result = segment(spring_force(model, 168.0, noise=168 * 0.3e-6, known=False))
    assert result.settings.gain == pytest.approx(168.0, rel=0.1)
    assert len(result.events) == model.events
    assert of(result, "slip") == pytest.approx(model.size, rel=0.1)


def test_force_alone_gives_events_in_seconds_of_loading(stick_slip):
    model = stick_slip(v0=42e-6, period=1.6, duration=0.045, events=12)
    trace = spring_force(model, 168.0, noise=168 * 0.3e-6, known=False).replace(drive=None)
    result = segment(trace)
    assert result.settings.unit == "s of loading"
    assert len(result.events) == model.events
    assert of(result, "recurrence", 1) == pytest.approx(model.period, abs=2e-3)
    drop = model.size - model.v0 * model.duration
    assert of(result, "slip") == pytest.approx(drop / model.v0 + model.duration, rel=0.1)


def test_velocity_channel(stick_slip):
    model = stick_slip()
    trace = displacement(model, 20e3)
    v = np.gradient(trace.displacement, trace.time)
    result = segment(Trace("v", trace.time, velocity=v, drive=trace.drive))
    assert of(result, "t_onset") == pytest.approx(model.onsets(4 * model.v0 + 1e-4), abs=1e-4)
    assert of(result, "slip") == pytest.approx(model.size, rel=0.02)


def test_laboratory_fault_scale(stick_slip):
    """Slips only five times as fast as the drive, sampled at 10 Hz: the rig's threshold would find nothing."""
    model = stick_slip(v0=10e-6, period=6.4, duration=1.5, events=10)
    result = segment(displacement(model, 10.0))
    assert result.settings.threshold < 4 * model.v0 + 1e-4
    assert len(result.events) == model.events
    onset = of(result, "t_onset")
    assert np.abs(onset - model.onsets(result.settings.threshold)).max() < 0.1


def test_holds_come_from_the_drive():
    v0, w = 50e-6, np.pi / 0.03
    drive = Drive.from_pieces([1.0, 3.0, 4.0, 4.5, 6.0], [v0, 0.0, v0, 0.0, v0])
    t = np.arange(0, 6, 1e-4)

    def slip(start):
        return 35e-6 * (1 - np.cos(w * np.clip(t - start, 0, 0.03)))

    result = segment(Trace("h", t, displacement=slip(0.5) + slip(3.9) + slip(5.5), drive=drive))
    assert [event.holds for event in result.events] == [(), ((1.0, 3.0),), ((4.0, 4.5),)]
    assert of(result, "hold_time") == pytest.approx([0, 2, 0.5])
    assert [(p.start, p.stop, p.event) for p in result.during("hold")] == [(1.0, 3.0, 1), (4.0, 4.5, 2)]
    assert result.events[1].drive_position == pytest.approx(v0 * (1 + result.events[1].t_onset - 3), rel=1e-9)


@pytest.mark.parametrize("virgin", [True, False])
def test_phases_follow_one_another_and_cover_the_record(stick_slip, virgin):
    model = stick_slip(ring=2e-6)
    trace = displacement(model, noise=2e-9, count=LSB, virgin=virgin)
    result = segment(trace)
    phases = result.phases
    assert phases[0].kind == ("virgin loading" if virgin else "stick")
    assert phases[0].first == 0
    assert phases[-1].last == trace.time.size
    assert all(a.last == b.first for a, b in pairwise(phases))
    assert all(a.stop == pytest.approx(b.start, abs=2e-4) for a, b in pairwise(phases))
    assert {phase.kind for phase in phases} <= set(PHASES)
    for event, slip, ring in zip(result.events, result.during("slip"), result.during("ring-down"), strict=True):
        assert (slip.start, slip.stop) == (event.t_onset, event.t_arrest)
        assert slip.event == ring.event == event.index
        # 2 um at 400 Hz sinks to the noise of the velocity within five to nine decay times of 10 ms
        assert 0.03 < ring.stop - ring.start < 0.09
    starts = [phase.start for phase in result.during("nucleation")]
    overtakes = model.starts + np.arcsin((model.v0 - model.creep) / (0.5 * model.size * model.w)) / model.w
    assert starts == pytest.approx(overtakes, abs=3e-4)


def test_nucleation_begins_where_the_block_overtakes_the_drive(stick_slip):
    model = stick_slip(ring=200e-9)
    result = segment(displacement(model, 50e3))
    starts = np.array([phase.start for phase in result.during("nucleation")])
    exact = model.starts + np.arcsin(model.v0 / (0.5 * model.size * model.w)) / model.w
    assert np.abs(starts - exact).max() < 2 / 50e3


def test_tremor_after_arrest_is_dropped_with_its_reason(stick_slip):
    result = segment(displacement(stick_slip(ring=2e-6)))
    assert len(result.events) == 6
    (dropped,) = result.dropped
    assert dropped.count >= 6
    assert "smaller than the smallest slip" in dropped.reason


def test_records_cut_within_a_slip(stick_slip):
    model = stick_slip(ring=100e-9)
    trace = displacement(model)
    part = (trace.time > model.starts[0] + 0.01) & (trace.time < model.starts[4] + 0.01)
    result = segment(Trace("c", trace.time[part], displacement=trace.displacement[part], drive=trace.drive))
    assert len(result.events) == 3
    reasons = " ".join(dropped.reason for dropped in result.dropped)
    assert "already slipping" in reasons
    assert "does not end" in reasons


@pytest.mark.parametrize(
    ("motion", "regime", "word"),
    [
        (lambda t: 50e-6 * t, "continuous sliding", "follows the drive (100 %"),
        (lambda t: 50e-6 * t + 0.2e-6 * np.sin(2 * np.pi * 7 * t), "continuous sliding", "without slips"),
        (lambda t: 0.2e-6 * t / (1 + t), "no slip", "never slips"),
        (lambda t: np.zeros_like(t), "no slip", "never slips"),
        (lambda t: 50e-6 * (t - np.sin(2 * np.pi * 4 * t) / (2 * np.pi * 4)), "oscillation", "rests for less time"),
    ],
)
def test_motion_without_stick_slip_is_named(motion, regime, word):
    t = np.arange(0, 10, 1e-3)
    x = motion(t) + np.random.default_rng(1).normal(0, 5e-9, t.size)
    result = segment(Trace("s", t, displacement=x, drive=Drive.constant(50e-6, 0, 10)))
    assert result.regime == regime
    assert word in result.reason
    if regime != "oscillation":
        assert result.events == ()
        assert result.warnings == ("no event: nothing but creep or sliding can be fitted",)
        assert [(p.first, p.last) for p in result.phases] == [(0, t.size)]


def test_a_few_large_slips_before_steady_sliding_are_kept(stick_slip):
    model = stick_slip(events=2, ring=100e-9)
    t = np.arange(0, 60, 1e-3)
    x = model.position(t) + 50e-6 * np.clip(t - 2.2, 0, None)
    x += np.random.default_rng(1).normal(0, 5e-9, t.size)
    result = segment(Trace("s", t, displacement=x, drive=Drive.constant(50e-6, 0, 60)))
    assert len(result.events) == 2
    assert result.regime == "oscillation"
    assert "only 3 %" in result.reason


def test_one_event_is_a_warning(stick_slip):
    result = segment(displacement(stick_slip(events=1), virgin=True))
    assert len(result.events) == 1
    assert np.isnan(result.events[0].recurrence)
    assert "one event: no recurrence" in result.warnings[0]


def test_minimum_slip_is_obeyed(stick_slip):
    model = stick_slip(ring=2e-6)
    few = segment(displacement(model), minimum_slip=1e-6)
    assert len(few.events) > model.events
    stated = segment(displacement(model, minimum_slip=1e-6))
    assert len(stated.events) == len(few.events)
    assert segment(displacement(model), minimum_slip=1e-3).events == ()
    assert list(of(segment(displacement(model), minimum_slip="1 um"), "slip")) == list(of(few, "slip"))
    with pytest.raises(InputError, match="minimum_slip: the unit 's' is not one of m"):
        segment(displacement(model), minimum_slip="1 s")


def test_irregular_events(stick_slip):
    rng = np.random.default_rng(11)
    v0, at, x0 = 50e-6, 0.0, 0.0
    t = np.arange(0, 40, 1e-4)
    x = np.zeros_like(t)
    sizes, starts = [], []
    while True:
        size = float(rng.uniform(15e-6, 100e-6))
        at += size / v0
        if at > 39.9:
            break
        x += 0.5 * size * (1 - np.cos(np.pi / 0.03 * np.clip(t - at, 0, 0.03)))
        sizes.append(size)
        starts.append(at)
    x = np.round((x0 + x + rng.normal(0, 2e-9, t.size)) / LSB) * LSB
    result = segment(Trace("i", t, displacement=x, drive=Drive.constant(v0, 0, 40), resolution=LSB))
    assert of(result, "slip") == pytest.approx(sizes, rel=0.03)
    assert np.abs(of(result, "t_onset") - starts).max() < 5e-3


def test_the_estimator_is_the_same_for_data_and_model(stick_slip):
    """Settings chosen on noisy data give the model's clean trace the same events, also on another time base."""
    model = stick_slip(ring=200e-9)
    data = segment(displacement(model, noise=20e-9, count=LSB))
    assert data.settings.relative == 0.0
    t = np.arange(0, model.stop, 1 / 25e3)
    again = segment_motion(t, model.position(t), Drive.constant(model.v0, 0, model.stop), data.settings)
    assert of(again, "t_onset") == pytest.approx(of(data, "t_onset"), abs=2e-4)
    assert of(again, "t_arrest") == pytest.approx(of(data, "t_arrest"), abs=2e-4)


@pytest.mark.parametrize("half", [1, 2, 5, 40])
def test_windowed_velocity_is_exact_for_steady_motion_and_has_the_stated_noise(half):
    t = 1e4 + np.arange(600_000) * 2e-5
    assert np.abs(velocity(t, 3e-5 * t, half) / 3e-5 - 1).max() < 1e-6
    noise = np.random.default_rng(2).normal(0, 1e-8, t.size)
    from stickslip.data.segment.kinematics import velocity_noise

    assert np.std(velocity(t, noise, half)) == pytest.approx(velocity_noise(1e-8, half, 2e-5), rel=0.03)


def test_no_drive_and_measured_displacement(stick_slip):
    """Loaded by a force: no drive, so the threshold comes from the block's own speeds."""
    t = np.arange(0, 30, 0.015)
    x = 1e-4 * np.exp((t - 20) / 5) + 2e-3 / (1 + np.exp(-(t - 20) / 0.1))
    result = segment(Trace("f", t, displacement=x, spring_force=0.5 * t, noise=1e-7))
    assert len(result.events) == 1
    assert result.events[0].t_onset == pytest.approx(19.6, abs=0.4)


def test_position_from_force_is_drive_minus_elongation(stick_slip):
    model = stick_slip(v0=42e-6)
    trace = spring_force(model, 168.0)
    x, drive, gain, unit = block_motion(trace)
    assert (gain, unit, drive) == (168.0, "m", trace.drive)
    assert np.allclose(x, model.position(trace.time), atol=1e-15)


def test_settings_scale_with_units(stick_slip):
    """The choice of the estimator depends on ratios alone below the rig's floor of 0.1 mm/s."""
    model = stick_slip(v0=10e-6, period=6.4, duration=1.5, events=10)
    trace = displacement(model, 10.0)
    small = choose_settings(trace.time, trace.displacement, trace.drive, 1e-9)
    shrunk = choose_settings(trace.time, 1e-2 * trace.displacement, Drive.constant(1e-2 * model.v0, 0, 60), 1e-11)
    assert shrunk.threshold == pytest.approx(1e-2 * small.threshold)
    assert shrunk.window == small.window
