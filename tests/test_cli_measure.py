"""inspect and fit as a user meets them: tables, JSON, run folders, and one message for every kind of bad input."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stickslip.cli import run
from stickslip.contact import creep_curve, default_loads

RIG = """schema = 1
title = "rig"
[rig]
mass = "89.4 g"
spring_stiffness = "1000 N/m"
contacts = 4
normal_force = "0.31 N"
friction_coefficient = { guess = 0.21, lower = 0.1, upper = 0.4 }
"""
TRACE = """[[trace]]
file = "a.csv"
time = { column = "time", unit = "s" }
displacement = { column = "x", unit = "um", resolution = "8 nm" }
drive_velocity = "50 um/s"
virgin = true
"""


@pytest.fixture(autouse=True)
def no_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("STICKSLIP_NO_CACHE", "1")
    monkeypatch.chdir(tmp_path)


def motion(slips=3, rate=5e3):
    """A static virgin creep, then slips of 40 um with the same creep before each; time (s) and position (um)."""
    curve = creep_curve(0.3, 2.46e-6, spring_stiffness=1000.0, velocity=5e-5, tau=default_loads(500))
    t_curve, u_curve = np.asarray(curve.t), np.asarray(curve.u)
    t = np.arange(0.0, t_curve[-1] * slips + 0.5, 1 / rate)
    x = np.zeros_like(t)
    for n in range(slips):
        begin = n * t_curve[-1]
        x += np.interp(t - begin, t_curve, u_curve)
        x += 20e-6 * (1 - np.cos(np.pi * np.clip((t - begin - t_curve[-1]) / 0.03, 0, 1)))
    return t, np.round(x / 8e-9) * 8e-3


def write(trace=TRACE, rig=RIG, *, rows=None, header="time,x"):
    """A campaign beside its file."""
    t, x = motion() if rows is None else rows
    np.savetxt("a.csv", np.column_stack([t, x]), delimiter=",", header=header, comments="", fmt="%.9g")
    Path("c.toml").write_text(rig + trace)
    return "c.toml"


def refused(capsys, *arguments):
    """Run something that must fail with exit code 2 and one message; returns the message."""
    capsys.readouterr()
    assert run(list(arguments)) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("stickslip:") == 1
    assert "Traceback" not in shown.err
    assert not list(Path().glob("*.partial"))
    return shown.err


def test_inspect_prints_the_traces_and_what_they_can_tell(capsys):
    assert run(["inspect", write()]) == 0
    out = capsys.readouterr().out
    assert "stick-slip" in out
    assert "50 um/s" in out
    assert "identifies nothing" in out
    assert "No hold" in out


def test_inspect_as_json_holds_the_events(capsys):
    assert run(["inspect", write(), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    (trace,) = found["traces"]
    assert len(trace["events"]) == 3
    assert trace["units"]["t_onset"] == "s"
    period = trace["events"][2]["t_onset"] - trace["events"][1]["t_onset"]
    assert trace["events"][2]["recurrence"] == pytest.approx(period)
    assert all(event["slip"] == pytest.approx(40e-6, rel=0.05) for event in trace["events"])
    assert found["cannot"]
    assert {Path(i["file"]).name for i in found["inputs"]} == {"a.csv", "c.toml"}


def test_inspect_counts_what_was_mended(capsys):
    t, x = motion()
    x[2000] += 300.0
    x[3000] = np.nan
    assert run(["inspect", write(rows=(t, x)), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert any("spike" in line for line in found["dropped"])
    assert any("nan" in line for line in found["dropped"])


def test_inspect_writes_a_run_folder(capsys):
    assert run(["inspect", write(), "--out", "seen"]) == 0
    assert {p.name for p in Path("seen").iterdir()} == {"result.json", "arrays.nc", "report.html", "trace1.png"}
    assert "run folder exists already" in refused(capsys, "inspect", "c.toml", "--out", "seen")
    assert run(["inspect", "c.toml", "--out", "seen", "--force"]) == 0


def test_json_is_alone_on_standard_output():
    command = [sys.executable, "-m", "stickslip.cli", "inspect", write(), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    json.loads(done.stdout)


def test_static_fit_gives_the_parameters_with_their_N_and_L(capsys):
    assert run(["fit", write(), "--model", "static", "--out", "fitted"]) == 0
    out = capsys.readouterr().out
    assert "N = 4096" in out
    assert "L = 20 um" in out
    assert "guessed, not measured: friction_coefficient" in out
    assert "act only together" in out
    found = json.loads(Path("fitted/result.json").read_text())
    first = found["static"]["fits"][0]
    assert first["satisfying"]
    assert first["hurst"] == pytest.approx(0.3, abs=0.15)
    assert found["static"]["processes"] == 3
    assert Path("fitted/report.html").is_file()


def test_paper_s_alignment_is_an_option(capsys):
    write()
    results = []
    for align in ("consistent", "paper"):
        assert (
            run(
                [
                    "fit",
                    "c.toml",
                    "--model",
                    "static",
                    "--align",
                    align,
                    "--time",
                    "paper",
                    "--sampling",
                    "uniform",
                    "--json",
                ]
            )
            == 0
        )
        results.append(json.loads(capsys.readouterr().out)["static"])
    assert results[1]["align"] == "paper"
    assert results[1]["fits"][0]["h_rms"] > 1.5 * results[0]["fits"][0]["h_rms"]


@pytest.mark.slow
def test_inertial_fit_of_a_simulated_campaign(capsys):
    from stickslip.challenge.generator.__main__ import main

    main(["camp", "--seed", "3"])
    assert (
        run(["fit", "camp/campaign.toml", "--out", "fitted", "--most-events", "4", "--profile", "weakening.drop"]) == 0
    )
    found = json.loads(Path("fitted/result.json").read_text())
    assert [step["model"] for step in found["ladder"]] == [["static"], ["static", "inertia"]]
    assert found["ladder"][1]["train_error"] < 1.5 < found["ladder"][0]["train_error"]
    assert found["misfit"]["sentence"].startswith("The data are described")
    assert found["parameters"]["contact.u_max"]["std"] > 0
    assert (
        found["profiles"][0]["interval"][0]
        < found["parameters"]["weakening.drop"]["value"]
        < found["profiles"][0]["interval"][1]
    )
    assert 0.02 <= found["effective"]["H"] <= 0.98
    assert "act only together" in found["identifiability"][-1]


# what is wrong with the input -> words of the one message
def no_time_column():
    return write(header="clock,x"), ("time", "sampling_rate", "a.csv")


def time_not_increasing():
    t, x = motion()
    t[4000:] -= 0.5
    return write(rows=(t, x)), ("time does not increase", "line 4002")


def unit_wrong_by_a_thousand():
    return write(TRACE.replace('"um"', '"mm"')), ("outruns the drive", "10^3", "'um' in place of 'mm'")


def two_traces_of_one_name():
    return write(TRACE + TRACE), ("same name 'a'", "trace[2].name")


def an_empty_file():
    path = write()
    Path("a.csv").write_text("")
    return path, ("a.csv", "empty")


def a_binary_file_called_csv():
    path = write()
    Path("a.csv").write_bytes(bytes(range(256)) * 40)
    return path, ("a.csv",)


def no_such_file():
    return write(TRACE.replace("a.csv", "b.csv")), ("b.csv", "not there", "did you mean 'a.csv'")


def not_a_campaign():
    Path("c.toml").write_text("schema = 1\n[rig\n")
    return "c.toml", ("not valid TOML", "c.toml")


BAD = (
    no_time_column, time_not_increasing, unit_wrong_by_a_thousand, two_traces_of_one_name, an_empty_file,
    a_binary_file_called_csv, no_such_file, not_a_campaign,
)  # fmt: skip


@pytest.mark.parametrize("command", [("inspect",), ("fit", "--model", "static"), ("fit",)], ids=" ".join)
@pytest.mark.parametrize("case", BAD, ids=lambda case: case.__name__)
def test_bad_input_is_one_message(capsys, case, command):
    path, words = case()
    message = refused(capsys, *command, path, "--out", "never")
    for word in words:
        assert word in message
    assert not Path("never").exists()


def test_a_trace_with_one_event(capsys):
    path = write(rows=motion(slips=1))
    assert run(["inspect", path]) == 0
    assert "one event" in " ".join(capsys.readouterr().out.split())
    message = refused(capsys, "fit", path)
    assert "one slip" in message
    assert "--model static" in message


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--model", "static", "--add", "tilt"], ("--add", "dynamic")),
        (["--starts", "0"], ("--starts", "1 to 100")),
        (["--v-lim", "1 kg"], ("--v-lim", "m/s")),
        (["--model", "other"], ("static", "inertial")),
        (["--add", "tild"], ("tild", "tilt")),
        (["--profile", "contact.umax"], ("--profile", "contact.u_max")),
        (["--model", "static", "--v-lim", "60 um/s"], ("static", "not faster than v_lim")),
    ],
)
def test_wrong_options_are_one_message(capsys, arguments, words):
    message = refused(capsys, "fit", write(), *arguments)
    for word in words:
        assert word in message


def test_missing_quantities_of_the_rig_are_named(capsys):
    path = write(rig=RIG.replace('normal_force = "0.31 N"\n', ""))
    assert "normal_force" in refused(capsys, "fit", path, "--model", "static")
    path = write(rig=RIG.replace('mass = "89.4 g"\n', ""))
    assert "mass" in refused(capsys, "fit", path)
