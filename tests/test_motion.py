"""The displacement that spring force or velocity imply, and that a diagnosis is given it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.cli import run
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.checks import rig_against_motion
from stickslip.data.checks.slip_time import at_odds, slip_time
from stickslip.data.displacements import true_gains, with_displacements
from stickslip.data.drive import Drive
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.objects import diagnosis
from stickslip.objects.diagnosis import diagnose_campaign

STIFFNESS, SPEED = 168.0, 42e-6  # N/m, m/s


def moved() -> tuple[np.ndarray, np.ndarray]:
    """Times and displacement of a block that slips by a half cosine of 40 ms every 1.5 s (s, m)."""
    t = np.arange(0.0, 31.0, 5e-4)
    x = np.zeros_like(t)
    for onset in 1.5 * np.arange(1, 20):
        x += 0.5 * SPEED * 1.5 * (1.0 - np.cos(np.pi * np.clip((t - onset) / 0.04, 0.0, 1.0)))
    return t, x


def forces(gain: float = 1.0) -> tuple[Trace, np.ndarray]:
    t, x = moved()
    pulled = Drive.constant(SPEED, 0.0, t[-1])
    noise = 1e-7 * np.random.default_rng(1).standard_normal(t.size)
    force = gain * STIFFNESS * (pulled.position(t) - x + noise)
    trace = Trace("force", t, spring_force=force, drive=pulled, spring_stiffness=STIFFNESS, noise=STIFFNESS * 1e-7)
    return trace, x


@pytest.mark.parametrize("gain", [1.0, 1.1])
def test_the_spring_force_tells_where_the_block_is(gain):
    trace, x = forces(gain)
    found, notes = true_gains([trace], [segment(trace)])
    (seen,), implied = with_displacements([trace], found)
    off = seen.displacement - x
    assert np.std(off) < 1.5e-7 + 0.005 * SPEED * 1.5  # noise, and the gain to half a per cent of a stick's loading
    assert len(notes) == (gain != 1.0)
    assert implied == ["force: the displacement is drive - F/c_s"]
    assert seen.noise == pytest.approx(1e-7, rel=0.3)


def test_the_velocity_tells_where_the_block_is_and_a_measured_displacement_stays():
    t, x = moved()
    given = Trace("v", t, velocity=np.gradient(x, t), drive=Drive.constant(SPEED, 0.0, t[-1]), noise=1e-9)
    (seen,), implied = with_displacements([given], [segment(given)])
    assert np.max(np.abs(seen.displacement - x)) < 2e-8
    assert implied == ["v: the displacement is the integral of the velocity"]
    assert with_displacements([seen], [segment(seen)]) == ([seen], [])


def test_a_diagnosis_of_spring_force_is_given_the_displacement(tmp_path, monkeypatch):
    trace, x = forces(1.1)
    np.savetxt(tmp_path / "f.csv", np.stack([trace.time, trace.spring_force], 1), delimiter=",", header="t [s],F [N]")
    (tmp_path / "c.toml").write_text(
        'schema = 1\n[rig]\nmass = "30 g"\ncontacts = 1\nnormal_force = "0.3 N"\nfriction_coefficient = 0.3\n'
        f'spring_stiffness = "{STIFFNESS} N/m"\n[[trace]]\nfile = "f.csv"\ntime = {{ column = 1, unit = "s" }}\n'
        f'spring_force = {{ column = 2, unit = "N" }}\ndrive_velocity = "{1e6 * SPEED} um/s"\n'
    )

    class Seen(Exception):
        pass

    def diagnose(prepared, *_):
        raise Seen(prepared.traces[0].displacement, prepared.segmentations[0])

    monkeypatch.setattr(diagnosis, "search", diagnose)
    with pytest.raises(Seen) as seen:
        diagnose_campaign(tmp_path / "c.toml", tmp_path / "out")
    displacement, events = seen.value.args
    assert np.std(displacement - x) < 1.5e-7 + 0.005 * SPEED * 1.5
    assert len(events.events) == pytest.approx(19, abs=1)


@pytest.mark.parametrize(("time", "drive"), [(1e-3, 1.0), (1.0, 1e-3), (1e3, 1.0), (1.0, 1e3)])
@pytest.mark.parametrize("command", [("fit", "--model", "static"), ("fit",), ("diagnose",)])
def test_a_drive_or_a_clock_wrong_by_a_thousand_is_refused(tmp_path, capsys, time, drive, command):
    """However short the record: the block keeps up with its drive from slip to slip."""
    t, x = moved()
    first = t < 10.0
    rows = np.stack([time * t[first], 1e6 * x[first]], 1)
    np.savetxt(tmp_path / "x.csv", rows, delimiter=",", header="t [s],x [um]", comments="")
    (tmp_path / "c.toml").write_text(
        'schema = 1\n[rig]\nmass = "30 g"\ncontacts = 4\nnormal_force = "0.3 N"\nfriction_coefficient = 0.3\n'
        f'spring_stiffness = "1000 N/m"\n[[trace]]\nfile = "x.csv"\ntime = {{ column = "t" }}\n'
        f'displacement = {{ column = "x" }}\ndrive_velocity = "{drive * 1e6 * SPEED} um/s"\n'
    )
    out = tmp_path / "out"
    assert run([command[0], str(tmp_path / "c.toml"), *command[1:], "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "drive" in said
    assert "to fix" in said
    assert not out.exists()


@pytest.mark.parametrize("factor", [0.6, 1.0])
def test_a_block_ahead_of_its_drive_is_pointed_out(tmp_path, factor):
    t, x = moved()
    np.savetxt(tmp_path / "x.csv", np.stack([t, 1e6 * x], 1), delimiter=",", header="t [s],x [um]", comments="")
    (tmp_path / "c.toml").write_text(
        'schema = 1\n[[trace]]\nfile = "x.csv"\ntime = { column = "t" }\ndisplacement = { column = "x" }\n'
        f'drive_velocity = "{factor * 1e6 * SPEED} um/s"\n'
    )
    campaign = load_campaign(tmp_path / "c.toml")
    traces = load_traces(campaign)
    found = rig_against_motion(campaign, traces, [segment(t) for t in traces])
    assert len(found) == (factor != 1.0)
    if found:
        assert "x: from slip to slip the block moves 42 µm/s, the drive 25.2 µm/s" in found[0].sentence
        assert found[0].stops
        assert found[0].value == pytest.approx(1 / factor, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("mass", "off"), [("26 g", False), ("100 g", False), ("26 kg", True), ("26 mg", True)])
def test_a_mass_wrong_by_a_thousand_is_pointed_out(tmp_path, capsys, mass, off):
    """Slips of 40 ms on 168 N/m are those of 27 g."""
    t, x = moved()
    np.savetxt(tmp_path / "x.csv", np.stack([t, 1e6 * x], 1), delimiter=",", header="t [s],x [um]", comments="")
    (tmp_path / "c.toml").write_text(
        f'schema = 1\n[rig]\nmass = "{mass}"\nspring_stiffness = "{STIFFNESS} N/m"\n[[trace]]\nfile = "x.csv"\n'
        f'time = {{ column = "t" }}\ndisplacement = {{ column = "x" }}\ndrive_velocity = "{1e6 * SPEED} um/s"\n'
    )
    campaign = load_campaign(tmp_path / "c.toml")
    traces = load_traces(campaign)
    found = rig_against_motion(campaign, traces, [segment(t) for t in traces])
    said = [f.sentence for f in found]
    assert {f.what for f in found} <= {"mass and spring"}
    assert len(said) == off
    assert run(["inspect", str(tmp_path / "c.toml")]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert ("check mass and stiffness" in shown) == off
    if off:
        assert said[0] in shown
        assert f"half a period of {mass}" in said[0]
        assert "a block of 2" in said[0]
        assert "g would slip so" in said[0]


def test_a_guessed_mass_and_slips_that_are_not_resolved_are_not_judged(tmp_path):
    t, x = moved()
    np.savetxt(tmp_path / "x.csv", np.stack([t, 1e6 * x], 1), delimiter=",", header="t [s],x [um]", comments="")
    (tmp_path / "c.toml").write_text(
        'schema = 1\n[rig]\nmass = { guess = "26 kg", lower = "1 g", upper = "100 kg" }\n'
        f'spring_stiffness = "{STIFFNESS} N/m"\n[[trace]]\nfile = "x.csv"\ntime = {{ column = "t" }}\n'
        f'displacement = {{ column = "x" }}\ndrive_velocity = "{1e6 * SPEED} um/s"\n'
    )
    campaign = load_campaign(tmp_path / "c.toml")
    (trace,) = load_traces(campaign)
    found = segment(trace)
    assert rig_against_motion(campaign, [trace], [found]) == ()
    assert slip_time(trace, found) == pytest.approx(0.04, rel=0.05)
    assert slip_time(trace, replace(found, settings=replace(found.settings, window=0.01))) is None
    assert slip_time(trace, replace(found, events=found.events[:3])) is None
    assert slip_time(trace.replace(time=20.0 * trace.time), found) is None


@pytest.mark.parametrize(("ratio", "off"), [(1 / 5, True), (1 / 3, False), (1.0, False), (8.0, False), (13.0, True)])
def test_strong_damping_makes_slips_last_but_nothing_makes_them_short(ratio, off):
    half = np.pi * np.sqrt(0.1 / 1000.0)
    assert bool(at_odds([0.9 * ratio * half, ratio * half, 2.0 * ratio * half], 0.1, 1000.0)) == off
