"""Measured records of others: what is known of them must be found. Skipped where the data are not there."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.prescribed import prescribed, with_motion
from stickslip.data.readers import read_columns
from stickslip.data.segment import segment
from stickslip.errors import InputError
from stickslip.inference.forecast.strokes import Strokes
from stickslip.simulation.scenario import load_scenario, simulate

CAMPAIGNS = Path(__file__).parents[2] / "scenarios" / "real"


@pytest.fixture
def shipped(tmp_path, real_data):
    """The traces of a campaign file of scenarios/real, laid beside its records as its comment says."""

    def run(name, folder):
        path = shutil.copy(CAMPAIGNS / f"{name}.toml", tmp_path)
        for file in wanted(Path(path)):
            shutil.copy(real_data / folder / file, tmp_path)
        return load_traces(load_campaign(path))

    return run


def wanted(path):
    """Names of the files that a campaign file wants beside it."""
    entries = tomllib.loads(path.read_text(encoding="utf-8"))["trace"]
    channels = [c for e in entries for c in e.values() if isinstance(c, dict) and "file" in c]
    return {e["file"] for e in entries} | {c["file"] for c in channels}


SURFACE = CAMPAIGNS / "measured-surface.toml"


@pytest.mark.parametrize("path", sorted({*CAMPAIGNS.glob("*.toml")} - {SURFACE}), ids=lambda p: p.stem)
def test_a_campaign_of_others_records_says_where_they_are(path):
    """Without the record the error names the file that is missing, and the campaign's head where it is had."""
    with pytest.raises(InputError, match="the file is not there") as said:
        load_traces(load_campaign(path))
    assert any(name in str(said.value) for name in wanted(path))
    assert "GitHub" in path.read_text(encoding="utf-8").partition("schema")[0]


def test_a_rig_on_a_measured_surface_says_where_the_heights_are():
    with pytest.raises(InputError, match="the file is not there") as said:
        simulate(load_scenario(SURFACE))
    assert "matrix-3.txt" in str(said.value)
    assert "GitHub" in SURFACE.read_text(encoding="utf-8").partition("schema")[0]


@pytest.mark.slow
def test_a_rig_slips_on_a_line_of_a_measured_surface(tmp_path, real_data):
    path = shutil.copy(SURFACE, tmp_path)
    shutil.copy(real_data / "topographies" / "matrix-3.txt", tmp_path)
    found = simulate(load_scenario(path))
    drop = 1.76e-3 * 0.15  # of four loads and friction, N
    # with inertia a slip releases up to twice the drop; damping takes a little of that
    assert found["slip"].values == pytest.approx(2.0 * drop / 100.0, rel=0.1)
    assert found["slip"].size == 4


@pytest.fixture
def load(tmp_path, real_data):
    def run(file, body):
        path = tmp_path / "c.toml"
        path.write_text(f'schema = 1\n[[trace]]\nfile = "{real_data / file}"\noutside = true\n{body}\n')
        (trace,) = load_traces(load_campaign(path))
        return trace

    return run


def slider(load, stiffness, speed):
    body = 'time = { column = "t", unit = "s" }\nspring_force = { column = "Fnorm", unit = "0.3012 N" }\n'
    body += f'drive_velocity = "{speed} um/s"\nspring_stiffness = "{stiffness} N/m"'
    return load(f"paper-slider-ens/k{stiffness}Nm_v{speed}.mat", body)


def test_paper_slider_in_stick_slip(load):
    trace = slider(load, 168, 42)
    (spikes,) = trace.repairs
    assert spikes.kind == "spike"
    assert 0.002 < spikes.count / trace.time.size < 0.02
    found = segment(trace)
    assert found.regime == "stick-slip"
    large = [event for event in found.events if event.slip > 15e-6]
    assert 215 <= len(large) <= 245  # about 230 by eye
    assert np.mean([event.recurrence for event in found.events[1:]]) == pytest.approx(1.6, abs=0.05)
    # half a period of the slider on its spring, by which slips last whatever their size
    assert np.median([event.duration for event in found.events]) == pytest.approx(
        np.pi * np.sqrt(0.0307 / 168), rel=0.1
    )


def test_paper_slider_in_steady_sliding(load):
    found = segment(slider(load, 2254, 42))
    assert found.events == ()
    assert found.regime == "continuous sliding"
    assert found.dropped


@pytest.mark.parametrize(
    ("stiffness", "speed"), [(168, 1100), (1002, 1100), (2254, 1100), (168, 4300), (1002, 4300), (2254, 4300)]
)
def test_paper_slider_at_high_speed_is_read_and_named(load, stiffness, speed):
    found = segment(slider(load, stiffness, speed))
    assert found.regime in ("stick-slip", "oscillation", "continuous sliding")
    assert found.reason


def test_laboratory_fault(shipped):
    (trace,) = shipped("laboratory-fault", "psu-stickslip-p5198")
    assert trace.drive.speed == pytest.approx(9.97e-6, rel=0.05)
    found = segment(trace)
    assert len(found.events) == 46
    assert np.mean([event.recurrence for event in found.events[1:]]) == pytest.approx(6.44, abs=0.1)
    # stiffness from the rate of loading: at most 0.0041 MPa/um over 25 cm^2
    assert found.settings.gain == pytest.approx(4.1e3 * 25e-4 / 1e-6, rel=0.15)


def test_reciprocating_loops(load, shipped):
    body = 'time = { column = "Time" }\nnormal_load = { column = "Normal" }\ndrive_position = { column = "Position" }\n'
    file = "reciprocating-loops-200Hz/test_data_2.txt"
    trace = load(file, body + 'spring_force = { column = "Friction" }')
    assert {repair.kind: repair.count for repair in trace.repairs}["dropped-samples"] == 179
    assert "sign opposite" in trace.warnings[0]
    for part in shipped("reciprocating-loops", "reciprocating-loops-200Hz"):
        assert part.warnings == ()
        assert prescribed(part, segment(part))
    trace = load(file, body + 'spring_force = { column = "Friction", unit = "-1 uN" }')
    found = segment(trace)
    assert found.events == ()
    long = [phase for phase in found.during("hold") if phase.stop - phase.start > 0.8]
    assert 98 <= len(long) <= 102


def test_the_level_of_the_loops_changes_from_stroke_to_stroke(shipped):
    """The strokes' friction rises by some five per cent over the record, at the same places."""
    (trace,) = shipped("reciprocating-loops-whole", "reciprocating-loops-200Hz")
    found = Strokes.of(with_motion(trace))
    assert found is not None and found.time.size > 80
    assert found.shares["from stroke to stroke"] > 0.5 > 2.0 * found.shares["by the place"]
    assert 40e-6 < np.ptp(found.place) < 80e-6  # of a stroke of 240 um, less twice 56 um and the contact's loading
    early, late = found.level[:30].mean(), found.level[-30:].mean()
    assert late / early == pytest.approx(1.04, abs=0.02)


def test_robot_ramps(shipped):
    for trace in shipped("robot-joint", "robot-breakaway-creep/test1"):
        found = segment(trace)
        assert found.events
        assert 18 < found.events[0].t_onset < 22


def test_classroom_force_without_a_clock(shipped):
    (trace,) = shipped("classroom-slider", "classroom-slider")
    assert trace.time.size == 4261
    assert {repair.kind: repair.count for repair in trace.repairs} == {"nan": 1, "dropped-samples": 1}
    found = segment(trace)
    assert found.settings.unit == "s of loading"
    assert 120 < len(found.events) < 180  # 168 drops above 0.5 N


@pytest.mark.parametrize("name", ["rock-basalt", "rock-sepiolite"])
def test_rock_steps_slide(shipped, name):
    (trace,) = shipped(name, "rock-velocity-steps")
    found = segment(trace)
    assert found.regime in ("continuous sliding", "no slip")
    assert found.events == ()


def test_a_drill_string_sticks_and_slips(load, shipped):
    for part in shipped("drill-string", "torsional-rig-drillstring"):
        assert prescribed(part, segment(part))
    body = 'time = { column = "time_s", unit = "s" }\n'
    body += 'velocity = { column = "bit_speed_rpm", unit = "0.10471976 m/s" }\n'
    body += 'spring_force = { column = "bit_torque_Nm", unit = "N" }'
    found = segment(load("torsional-rig-drillstring/175_completo_1.csv", body))
    assert 130 <= len(found.events) <= 145  # 140 peaks of the speed
    assert np.median([e.recurrence for e in found.events[1:]]) == pytest.approx(0.36, abs=0.02)


@pytest.mark.parametrize(
    ("name", "folder"),
    [("robot-loops", "robot-breakaway-creep/test3"), ("friction-damper", "friction-damper-brfd")],
)
def test_motions_that_were_imposed_are_told(shipped, name, folder):
    for trace in shipped(name, folder):
        assert prescribed(trace, segment(trace))


def test_matlab_and_text_exports_agree(real_data):
    folder = real_data / "paper-slider-ens"
    matlab, text = read_columns(folder / "k168Nm_v1100.mat"), read_columns(folder / "k168Nm_v1100.csv")
    assert np.array_equal(matlab.data["t"], text.data["t_s"])
    assert np.array_equal(matlab.data["Fnorm"], text.data["Fnorm"])
