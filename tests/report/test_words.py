"""Sentences about data and misfit, the ripple in the sticks, the gain of a force sensor."""

import numpy as np
import pytest

from stickslip.data.checks.spring_force import common_gain, force_findings, gain_is_wrong, stick_gain
from stickslip.data.displacements import true_gains
from stickslip.data.drive import Drive
from stickslip.data.segment import segment
from stickslip.data.segment.stick_ripple import stick_ripple, stick_spectrum
from stickslip.data.trace import Trace
from stickslip.objects.data_abilities import abilities
from stickslip.show.report.describe import describe_trace
from stickslip.show.report.ripple_text import ripple_text


def sawtooth(
    *,
    v0=42e-6,
    rate=2000.0,
    sticks=60,
    stiffness=168.0,
    gain=1.0,
    ripple=0.0,
    period=0.4,
    wander=0.0,
    noise=1e-6,
    seed=0,
    creep=0.0,
):
    """A block that stands still, creeps before it slips by a half cosine of 38 ms; recurrence varies at random."""
    rng = np.random.default_rng(seed)
    onsets = np.cumsum(rng.uniform(1.3, 1.9, sticks))
    t = np.arange(0.0, onsets[-1] + 1.0, 1 / rate)
    x, before = np.zeros_like(t), 0.0
    steps = wander * np.random.default_rng(seed + 1).standard_normal(sticks)  # periods, from stick to stick
    phase = np.interp(t, onsets, np.cumsum(steps))
    for onset in onsets:
        size = v0 * (onset - before) - creep
        x += 0.5 * size * (1 - np.cos(np.pi * np.clip((t - onset) / 0.038, 0, 1)))
        x += creep * np.clip((t - onset + 0.5) / 0.5, 0, 1) ** 2
        before = onset
    drive = Drive.constant(v0, 0.0, t[-1])
    position = drive.position(t) + ripple * np.sin(2 * np.pi * (t / period + phase))
    force = gain * stiffness * (position - x) + stiffness * noise * rng.standard_normal(t.size)
    return Trace("saw", t, spring_force=force, drive=drive, spring_stiffness=stiffness, noise=stiffness * noise)


def test_a_force_sensor_that_reads_too_much_is_named_with_its_size():
    trace = sawtooth(gain=1.1, creep=8e-6)
    found = segment(trace)
    assert stick_gain(trace, found)["value"] == pytest.approx(1.1, abs=0.005)
    (said,) = force_findings([trace], [found])
    assert "sensor-gain of about +10 %" in said.sentence
    assert not said.stops  # it is set right before a fit
    trace = sawtooth(gain=1.0, creep=8e-6)
    assert force_findings([trace], [segment(trace)]) == []


def test_a_force_that_rises_too_slowly_may_be_creep_and_is_left_as_it_is():
    trace = sawtooth(gain=0.9, creep=8e-6)
    found = segment(trace)
    assert not gain_is_wrong(stick_gain(trace, found))
    (said,) = force_findings([trace], [found])
    assert "creeps along at 10 % of the drive's velocity, or sensor-gain of about -10 %" in said.sentence
    assert not said.stops
    assert true_gains([trace], [found]) == ([found], [])
    fast = sawtooth(gain=1.1, creep=8e-6)
    (mended,), (note,) = true_gains([fast], [segment(fast)])
    assert "sensor-gain of +9.8 %" in note
    assert mended.events[3].slip < 0.95 * segment(fast).events[3].slip
    # one sensor, so all runs have its scale, a run with too few sticks for one of its own too, and it is said once
    again, few = fast.replace(name="again"), fast.between(stop=fast.time[0] + 3.5).replace(name="few")
    assert stick_gain(few, segment(few)) is None
    mended, (note,) = true_gains([fast, again, few], [segment(t) for t in (fast, again, few)])
    assert "+9.8 %" in note and f"; {fast.name}, again, few): while" in note
    assert [m.settings.gain for m in mended] == [pytest.approx(1.098 * fast.spring_stiffness, rel=1e-3)] * 3
    # runs that differ by more than their errors: what is wrong is set right alone
    mended, (note,) = true_gains([fast, plain := sawtooth(creep=8e-6)], [segment(fast), segment(plain)])
    assert "+9.8 %" in note and note.count(fast.name) == 1
    assert [m.settings.gain / fast.spring_stiffness for m in mended] == [pytest.approx(1.098, rel=1e-3), 1.0]
    # the mean of runs that differ is known as well as they differ
    apart = [{"value": v, "std": 1e-3, "sticks": 9.0} for v in (1.05, 1.15)]
    assert common_gain(apart)["value"] == pytest.approx(1.1)
    assert common_gain(apart)["std"] == pytest.approx(0.05)


def test_ripple_of_the_drive_is_found_below_the_noise():
    trace = sawtooth(ripple=150e-9, period=0.4)
    found = stick_ripple(trace, segment(trace))
    assert found["lines"][0]["period"] == pytest.approx(0.4, rel=0.005)
    assert found["lines"][0]["amplitude"] == pytest.approx(150e-9, rel=0.3)
    assert len(found["lines"]) == 1
    assert "µm of drive" in ripple_text(found["lines"], trace, found["unit"])


def test_a_ripple_whose_phase_wanders_shows_in_the_spectra_without_phase():
    """Its phase walks by half a turn from stick to stick."""
    saws = [sawtooth(ripple=r, period=0.15, wander=0.5) for r in (0.0, 400e-9)]
    none, some = (stick_spectrum(saw, segment(saw)) for saw in saws)
    assert some[2] > 50
    near = np.abs(some[0] - 1 / 0.15) < 0.3
    assert np.max(some[1][near]) == pytest.approx(400e-9, rel=0.25)
    assert np.max(none[1][near]) < 100e-9


@pytest.mark.parametrize("seed", range(4))
def test_no_ripple_where_there_is_none(seed):
    trace = sawtooth(seed=seed)
    assert stick_ripple(trace, segment(trace))["lines"] == []


def test_hum_is_called_by_its_name():
    trace = sawtooth(ripple=500e-9, period=0.02)
    assert "mains, 50 Hz" in ripple_text(stick_ripple(trace, segment(trace))["lines"], trace, "m")


def test_one_velocity_identifies_nothing_and_three_do():
    one = sawtooth(sticks=8)
    said = abilities([one], [segment(one)])
    assert any("identifies nothing" in line for line in said.cannot)
    assert any("No hold" in line for line in said.cannot)
    assert any("No virgin start" in line for line in said.cannot)
    assert any("Spring force only" in line for line in said.cannot)
    assert any("too slowly for a ring-down" in line for line in said.cannot)
    traces = [sawtooth(sticks=8, v0=v) for v in (2e-5, 5e-5, 1e-4)]
    said = abilities(traces, [segment(t) for t in traces])
    assert not any("identifies nothing" in line for line in said.cannot)
    assert any(line.startswith("3 drive velocities") for line in said.can)


def test_one_is_not_said_in_the_plural():
    one = sawtooth(sticks=1)
    said = abilities([one], [segment(one)])
    assert "1 slip in 1 of 1 trace." in said.can
    assert any(line.startswith("1 creep process cannot be compared with the static model: ") for line in said.cannot)
    many = sawtooth(sticks=8)
    said = abilities([many, many], [segment(many)] * 2)
    assert "16 slips in 2 of 2 traces." in said.can
    assert any(line.startswith("16 creep processes cannot be compared with the static model: ") for line in said.cannot)
    assert any("(2 kHz)" in line for line in said.cannot)


def test_no_slip_at_all_is_said_first():
    t = np.linspace(0.0, 10.0, 2000)
    sliding = Trace("slide", t, displacement=5e-5 * t, drive=Drive.constant(5e-5, 0.0, 10.0))
    assert abilities([sliding], [segment(sliding)]).cannot[0].startswith("No trace holds a slip")


def test_events_are_described_with_their_units():
    trace = sawtooth(sticks=8)
    row = describe_trace(trace, segment(trace))
    assert len(row["events"]) == 8
    event = row["events"][3]
    assert set(event) - {"warnings"} <= set(row["units"])
    assert row["units"]["slip"] == "m"
    assert event["slip"] == pytest.approx(42e-6 * event["recurrence"], rel=0.1)
    assert event["t_arrest"] > event["t_onset"]
