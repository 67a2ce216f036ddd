"""A campaign file is read into SI, and every fault in it is named with file, line or key, and how to fix it."""

import math

import numpy as np
import pytest

from stickslip.data.campaign import Unmeasured, campaign_template, load_campaign, load_traces
from stickslip.data.campaign.located_errors import key_lines

ROWS = np.column_stack([np.arange(100) * 0.01, np.arange(100) * 0.4])
TRACE = """time = { column = "time", unit = "s" }
displacement = { column = "x", unit = "um" }
drive_velocity = "50 um/s"
"""


def test_units_are_si_and_a_trace_may_override_the_rig(campaign):
    rig = 'mass = "89.4 g"\nspring_stiffness = { guess = "1 N/mm", lower = 200, upper = "5 kN/m" }\ncontacts = 4\n'
    rig += 'youngs_modulus = "210 GPa"\ntemperature = "20 degC"\nnote = "steel"'
    loaded = load_campaign(campaign(TRACE + 'spring_stiffness = "168 N/m"\nnormal_force = 0.31', rig=rig, rows=ROWS))
    assert loaded.rig.mass == pytest.approx(0.0894)
    assert loaded.rig.spring_stiffness == Unmeasured(1000.0, 200.0, 5000.0)
    assert loaded.rig.youngs_modulus == pytest.approx(210e9)
    assert loaded.rig.temperature == pytest.approx(293.15)
    own = loaded.rig_of("a")
    assert (own.spring_stiffness, own.normal_force, own.mass, own.note) == (168.0, 0.31, loaded.rig.mass, "steel")
    assert own.poisson_ratio is None
    assert loaded.names == ["a"]
    assert len(loaded.sha256) == 64


@pytest.mark.parametrize(
    ("trace", "words"),
    [
        (TRACE + 'drive_velocty = "1 um/s"', ["line 9", "trace[1].drive_velocty", "did you mean 'drive_velocity'"]),
        (TRACE + "mass = -1", ["line 9: trace[1].mass", "out of range", "above 0 kg"]),
        (TRACE + 'mass = "5"', ["the unit is missing", "5 kg"]),
        (TRACE + 'mass = "5 N"', ["not one of kg"]),
        (TRACE + 'mass = "heavy"', ["cannot read the quantity"]),
        (TRACE + "mass = nan", ["not a finite number"]),
        (TRACE + "mass = true", ["not a quantity"]),
        (TRACE + "mass = { guess = 1, lower = 2, upper = 3 }", ["between its bounds"]),
        (TRACE + "mass = { guess = 1, lower = 2 }", ["lacks 'upper'"]),
        (TRACE + "mass = { gess = 1 }", ["unknown key 'gess'", "did you mean 'guess'"]),
        (TRACE + "poisson_ratio = 0.5", ["poisson_ratio", "below 0.5"]),
        (TRACE + "contacts = 0", ["contacts", "greater than or equal to 1"]),
        (TRACE + "contacts = 2.5", ["contacts", "integer"]),
        (TRACE + 'role = "test"', ["role", "'train' or 'held-out'"]),
        (TRACE + 'clock_error = "5 %"', ["clock_error", "below 0.01"]),
        (TRACE + 'sampling_rate = "1 kHz"', ["both 'time' and 'sampling_rate'"]),
        (TRACE + 'drive = [{ until = "1 s", velocity = 0 }]', ["given more than once: drive_velocity, drive"]),
        (TRACE + 'start = "2 s"\nstop = "1 s"', ["'stop' is not after 'start'"]),
        (TRACE.replace('"x", unit', '"x", unti'), ["line 7", "displacement.unti", "did you mean 'unit'"]),
        (TRACE.replace('"um"', '"mm/s"'), ["displacement.unit", "not one of m"]),
        (TRACE.replace('"um"', '"0 um"'), ["other than zero"]),
        (TRACE.replace('"um"', '"um", resolution = "8 nN"'), ["displacement.resolution", "not one of m"]),
        (TRACE.replace('"um"', '"um", wrap = -1'), ["displacement.wrap", "at least 1e-18 m"]),
        (TRACE.replace('"um"', '"um", resolution = 1e-320'), ["displacement.resolution", "at least 1e-18 m"]),
        (TRACE.replace('"um"', '"um", resets = "1 s"'), ["displacement.resets", "list of times"]),
        (TRACE.replace('{ column = "x", unit', '{ unit'), ["displacement.column", "is missing"]),
        (TRACE.replace('column = "x"', "column = true"), ["not a column"]),
        (TRACE.splitlines()[0], ["no signal is given", "displacement, velocity, spring_force"]),
        ("\n".join(TRACE.splitlines()[:2]), ["the drive is not given", "drive_velocity"]),
        ("\n".join(TRACE.splitlines()[1:]), ["neither 'time' nor 'sampling_rate'", "sampling_rate"]),
        (TRACE.replace("drive_velocity", "#") + "drive = []", ["drive", "at least 1 item"]),
        (
            TRACE.replace("drive_velocity", "#")
            + 'drive = [{ until = "2 s", velocity = 1 }, { until = "1 s", velocity = 1 }]',
            ["do not increase"],
        ),
    ],
)  # fmt: skip
def test_faults_of_a_trace(campaign, refuses, trace, words):
    refuses(lambda: load_campaign(campaign(trace, rows=ROWS)), "c.toml", *words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("schema = 1\n[rig\n", ["not valid TOML", "line 2"]),
        ("schema = 1\nschema = 2\n", ["not valid TOML"]),
        ("[[trace]]\n", ["schema"]),
        ("schema = 2\n", ["schema", "1"]),
        ("schema = 1\n", ["'trace' is missing", "[[trace]]"]),
        ("schema = 1\ntrace = []\n", ["trace", "at least 1 item"]),
        (
            "schema = 1\n[rigg]\nmass = 1\n[[trace]]\n",
            ["line 2", "unknown key 'rigg'", "did you mean 'rig'", "more fault"],
        ),
        ("schema = 1\nrig = 3\n[[trace]]\n", ["rig"]),
        ('schema = 1\n[[trace]]\nfile = ""\nsampling_rate = 1\n', ["file", "at least 1 character"]),
    ],
)
def test_faults_of_the_file(tmp_path, refuses, text, words):
    path = tmp_path / "c.toml"
    path.write_text(text)
    refuses(lambda: load_campaign(path), "c.toml", *words)


def test_files_that_are_no_campaign(tmp_path, refuses):
    refuses(lambda: load_campaign(tmp_path / "none.toml"), "none.toml", "not there")
    refuses(lambda: load_campaign(tmp_path), "folder")
    (tmp_path / "b.toml").write_bytes(b"schema = 1\n\xff\xfe\x00")
    refuses(lambda: load_campaign(tmp_path / "b.toml"), "line 2", "UTF-8")
    with (tmp_path / "big.toml").open("wb") as stream:
        stream.truncate(20_000_000)
    refuses(lambda: load_campaign(tmp_path / "big.toml"), "too large")
    (tmp_path / "s.toml").write_text("schema = 1\n[block]\nmass = 1\n[drive]\nvelocity = 1\n")
    refuses(lambda: load_campaign(tmp_path / "s.toml"), "a scenario file, where a campaign", "simulate", "new campaign")
    (tmp_path / "run.csv").write_text("time,displacement\n0,0\n")
    refuses(lambda: load_campaign(tmp_path / "run.csv"), "not a campaign file", 'file = "run.csv"')
    (tmp_path / "run.mat").write_bytes(b"\x00\xff\xfe")
    refuses(lambda: load_campaign(tmp_path / "run.mat"), "not a campaign file", 'file = "run.mat"')
    refuses(lambda: load_campaign(tmp_path / "c.toml"), "not there", "'s.toml'")


def test_two_traces_of_one_name(campaign, refuses):
    path = campaign(TRACE + '[[trace]]\nfile = "a.csv"\n' + TRACE, rows=ROWS)
    refuses(lambda: load_campaign(path), "traces 1, 2 have the same name 'a'", "trace[2].name")
    path.write_text(path.read_text().replace('file = "a.csv"', 'file = "a.csv"\nname = "first"', 1))
    assert load_campaign(path).names == ["first", "a"]


def test_files_outside_need_leave_and_are_recorded(tmp_path, campaign, refuses):
    inner = tmp_path / "inner"
    inner.mkdir()
    path = campaign(TRACE, rows=ROWS)
    text = path.read_text()
    (inner / "c.toml").write_text(text.replace("a.csv", "../a.csv"))
    refuses(lambda: load_campaign(inner / "c.toml"), "trace[1].file", "outside the campaign's folder", "outside = true")
    (inner / "a.csv").symlink_to(tmp_path / "a.csv")
    (inner / "c.toml").write_text(text)
    refuses(lambda: load_campaign(inner / "c.toml"), "outside the campaign's folder")
    (inner / "c.toml").write_text(text.replace('"a.csv"', '"a.csv"\noutside = true'))
    (trace,) = load_traces(load_campaign(inner / "c.toml"))
    assert "outside the campaign folder" in trace.provenance.notes
    (trace,) = load_traces(load_campaign(path))
    assert "outside the campaign folder" not in trace.provenance.notes


def test_missing_files_and_loops(tmp_path, campaign, refuses):
    path = campaign(TRACE, rows=ROWS)
    text = path.read_text()
    path.write_text(text.replace("a.csv", "b.csv"))
    refuses(lambda: load_campaign(path), "trace[1].file", "not there", "did you mean 'a.csv'")
    path.write_text(text.replace('"a.csv"', '"."'))
    refuses(lambda: load_campaign(path), "not a file")
    (tmp_path / "loop.csv").symlink_to(tmp_path / "loop.csv")
    path.write_text(text.replace("a.csv", "loop.csv"))
    refuses(lambda: load_campaign(path), "trace[1].file")
    path.write_text(text.replace('"a.csv"', '"a\\u0000.csv"'))
    refuses(lambda: load_campaign(path), "trace[1].file")


def test_the_template_is_valid(tmp_path):
    np.savetxt(tmp_path / "run1.csv", ROWS, delimiter=",", header="time,displacement", comments="")
    (tmp_path / "c.toml").write_text(campaign_template())
    loaded = load_campaign(tmp_path / "c.toml")
    assert loaded.rig.spring_stiffness == Unmeasured(1000.0, 200.0, 5000.0)
    (trace,) = load_traces(loaded)
    assert trace.virgin
    assert trace.resolution == pytest.approx(8e-9)
    # what is commented out is valid too
    text = campaign_template()
    for key in (
        "springs",
        "temperature",
        "name",
        "normal_load",
        "role",
        "start",
        "stop",
        "clock_error",
        "spikes",
        "spring_stiffness",
    ):
        assert f"# {key} = " in text
        text = text.replace(f"# {key} = ", f"{key} = ")
    (tmp_path / "c.toml").write_text(text.replace('column = "N"', "column = 2"))
    loaded = load_campaign(tmp_path / "c.toml")
    assert loaded.rig.springs == 4096
    assert loaded.rig_of("run1").spring_stiffness == 168.0
    assert loaded.entry("run1").clock_error == pytest.approx(25e-6)


def test_lines_of_keys():
    lines = key_lines('a = 1\n[b.c]\n"d e" = 2\n[[t]]\nx.y = 1\n[[t]]\n# no = 3\nz = 4\n[t.sub]\nw = 5\n')
    assert lines[("a",)] == 1
    assert lines[("b", "c", "d e")] == 3
    assert lines[("t", 0, "x", "y")] == 5
    assert lines[("t", 1, "z")] == 8
    assert lines[("t", 1, "sub", "w")] == 10
    assert ("t", 1, "no") not in lines
    assert math.prod(lines.values()) > 0
