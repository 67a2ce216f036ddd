"""Measured records of others: what is known of them must be found. Skipped where the data are not there."""

import numpy as np
import pytest

from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.readers import read_columns
from stickslip.data.segment import segment


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


def test_laboratory_fault(load):
    body = 'time = { column = "Time", unit = "s" }\ndrive_position = { column = "LPDisp", unit = "um" }\n'
    body += 'spring_force = { column = "ShearStress", unit = "1 MPa * 25 cm^2" }'
    trace = load("psu-stickslip-p5198/newDF_TimeToFailure_from_6600_to_6900_WITHOUT_subwindows.csv", body)
    assert trace.drive.speed == pytest.approx(9.97e-6, rel=0.05)
    found = segment(trace)
    assert len(found.events) == 46
    assert np.mean([event.recurrence for event in found.events[1:]]) == pytest.approx(6.44, abs=0.1)
    # stiffness from the rate of loading: at most 0.0041 MPa/um over 25 cm^2
    assert found.settings.gain == pytest.approx(4.1e3 * 25e-4 / 1e-6, rel=0.15)


def test_reciprocating_loops(load):
    body = 'time = { column = "Time" }\nnormal_load = { column = "Normal" }\ndrive_position = { column = "Position" }\n'
    file = "reciprocating-loops-200Hz/test_data_2.txt"
    trace = load(file, body + 'spring_force = { column = "Friction" }')
    assert {repair.kind: repair.count for repair in trace.repairs}["dropped-samples"] == 179
    assert "sign opposite" in trace.warnings[0]
    trace = load(file, body + 'spring_force = { column = "Friction", unit = "-1 uN" }')
    assert trace.warnings == ()
    found = segment(trace)
    assert found.events == ()
    long = [phase for phase in found.during("hold") if phase.stop - phase.start > 0.8]
    assert 98 <= len(long) <= 102


@pytest.mark.parametrize("run", range(1, 5))
def test_robot_ramps(load, real_data, run):
    body = 'time = { column = 1, unit = "s" }\ndisplacement = { column = 2, unit = "mm" }\n'
    other = real_data / f"robot-breakaway-creep/test1/est_tau1_05_exp{run}_gan.t"
    body += f'spring_force = {{ column = 2, unit = "N", file = "{other}" }}\nstop = "25 s"\nminimum_slip = "0.03 mm"'
    found = segment(load(f"robot-breakaway-creep/test1/est_pos1_05_exp{run}_gan.t", body))
    assert found.events
    assert 18 < found.events[0].t_onset < 22


def test_classroom_force_without_a_clock(load, real_data):
    trace = load("classroom-slider/Force7.txt", 'sampling_rate = "4 Hz"\nspring_force = { column = 1, unit = "N" }')
    assert trace.time.size == 4261
    assert {repair.kind: repair.count for repair in trace.repairs} == {"nan": 1, "dropped-samples": 1}
    found = segment(trace)
    assert found.settings.unit == "s of loading"
    assert 120 < len(found.events) < 180  # 168 drops above 0.5 N


def test_rock_steps_slide(load):
    for file, load_unit in (
        ("velstep4_BRAVA_expb819_basalt.txt", "20 MN"),
        ("velstep3_TR2_exp013_sepiolite.txt", "30 MN"),
    ):
        body = 'time = { column = "Time" }\ndrive_position = { column = "Displ" }\n'
        body += f'spring_force = {{ column = "Friction", unit = "{load_unit}" }}'
        trace = load("rock-velocity-steps/" + file, body)
        found = segment(trace)
        assert found.regime in ("continuous sliding", "no slip")
        assert found.events == ()


def test_matlab_and_text_exports_agree(real_data):
    folder = real_data / "paper-slider-ens"
    matlab, text = read_columns(folder / "k168Nm_v1100.mat"), read_columns(folder / "k168Nm_v1100.csv")
    assert np.array_equal(matlab.data["t"], text.data["t_s"])
    assert np.array_equal(matlab.data["Fnorm"], text.data["Fnorm"])
