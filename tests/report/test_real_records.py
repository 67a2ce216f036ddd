"""Measured records of others: what is known of them is found and said. Skipped where the data are not there."""

import json
from pathlib import Path

import numpy as np
import pytest

from stickslip.cli import run

PAPER = """schema = 1
[rig]
mass = "30.7 g"
contacts = 1
normal_force = "0.3012 N"
friction_coefficient = {{ guess = 0.3, lower = 0.15, upper = 0.6 }}
[[trace]]
file = "{data}/paper-slider-ens/k168Nm_v42.mat"
outside = true
time = {{ column = "t", unit = "s" }}
spring_force = {{ column = "Fnorm", unit = "0.3012 N" }}
drive_velocity = "42 um/s"
spring_stiffness = "168 N/m"
"""
RAMP = """[[trace]]
file = "{position}"
outside = true
time = {{ column = 1, unit = "s" }}
displacement = {{ column = 2, unit = "mm" }}
spring_force = {{ column = 2, unit = "N", file = "{torque}" }}
minimum_slip = "{smallest} mm"
stop = "{stop:.3f} s"
"""


@pytest.fixture
def program(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("STICKSLIP_NO_CACHE", "1")

    def call(text, *command):
        path = tmp_path / "c.toml"
        path.write_text(text)
        assert run([command[0], str(path), *command[1:], "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    return call


def test_paper_slider_s_gain_is_found_and_named(real_data, program):
    found = program(PAPER.format(data=real_data), "inspect")
    (trace,) = found["traces"]
    assert 215 <= sum(event["slip"] > 15e-6 for event in trace["events"]) <= 245
    # the force's scale is known to be about 10 % too large
    assert trace["stick_gain"]["value"] == pytest.approx(1.10, abs=0.02)
    assert any(
        "sensor-gain of about +11 %" in f["sentence"] or "sensor-gain of about +10 %" in f["sentence"]
        for f in found["rig"]
    )
    lines = trace["ripple"]["lines"]
    assert "mains, 50 Hz" in trace["ripple"]["text"]
    assert any(line["period"] == pytest.approx(0.399, abs=0.005) for line in lines)
    assert any("identifies nothing" in line for line in found["cannot"])


@pytest.mark.slow
def test_paper_slider_is_no_static_contact(real_data, program):
    found = program(PAPER.format(data=real_data), "fit", "--model", "static", "--v-lim", "10 um/s")
    assert any("sensor-gain of +11" in note or "sensor-gain of +10" in note for note in found["notes"])
    assert found["static"]["processes"] > 20
    assert found["static"]["share"] < 0.1


def test_robot_ramps_have_a_share_that_fits(real_data, program):
    folder = real_data / "robot-breakaway-creep" / "test1"
    parts = ["schema = 1\n"]
    for position in sorted(folder.glob("*pos*")):
        torque = Path(str(position).replace("pos", "tau"))
        rate = 0.5 if "pos1" in position.name else 0.1
        t, tau = np.loadtxt(torque).T
        if np.mean(np.diff(t) <= 0) > 0.1:
            continue
        off = np.flatnonzero(np.abs(np.abs(tau) - rate * t) > 1.5 * rate)
        stop = t[off[0] - 2] if off.size else t[-1]
        smallest = 0.03 if "pos1" in position.name else 0.3
        parts.append(RAMP.format(position=position, torque=torque, smallest=smallest, stop=stop))
    found = program("".join(parts), "fit", "--model", "static")["ramps"]
    assert found["ramps"] >= 12
    assert 0.0 < found["share"] < 0.3
    first = [f for f in found["fits"] if "pos1" in f["trace"]]
    # break-away of joint 1 at about 10 N m and a tenth of a degree
    assert np.median([f["force"] for f in first]) == pytest.approx(10.3, rel=0.1)
    assert np.median([f["u_max"] for f in first]) == pytest.approx(0.13e-3, rel=0.3)
