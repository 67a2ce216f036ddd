"""Scenario files: what is read, and the one message for whatever cannot be."""

from __future__ import annotations

import pickle

import pytest

from stickslip.errors import InputError
from stickslip.simulation.scenario import load_scenario, make_scenario
from stickslip.simulation.scenario.overrides import parse_assignment, parse_sweep, series, sweep_values
from stickslip.simulation.scenario.template import scenario_template

from .conftest import as_toml, rig


def write(tmp_path, content) -> str:
    path = tmp_path / "rig.toml"
    path.write_text(content if isinstance(content, str) else as_toml(content), encoding="utf-8")
    return str(path)


def test_quantities_are_read_in_si(tmp_path):
    file = load_scenario(write(tmp_path, rig())).file
    assert file.block.mass == pytest.approx(0.0894, rel=1e-12)
    assert file.drive.velocity == pytest.approx(2e-4, rel=1e-12)
    assert file.contact.u_max == pytest.approx(0.95e-6, rel=1e-12)
    assert file.output.sampling_rate == 5000.0


BAD = {
    "missing unit": (rig(block__mass="89.4"), "block.mass", ["89.4", "kg"]),
    "mass zero": (rig(block__mass=0), "block.mass", ["got 0", "above 0 kg"]),
    "negative load": (rig(contact__normal_force="-0.3 N"), "contact.normal_force", ["-0.3 N", "above 0 N"]),
    "unknown key": (rig(block__mas="89.4 g"), "block.mas", ["did you mean 'mass'"]),
    "unknown table": (rig(blok={"mass": 1}), "blok", ["did you mean 'block'"]),
    "unknown kind": (rig(contact__kind="rough-lin"), "contact.kind", ["rough-lin", "did you mean 'rough-line'"]),
    "key of another kind": (rig(contact__radius="5 mm"), "contact.radius", ["unknown key"]),
    "wrong dimension": (rig(drive__velocity="50 um"), "drive.velocity", ["50 um", "m/s"]),
    "H too large": (
        rig(contact={"kind": "rough-line", "normal_force": 0.3, "friction_coefficient": 0.2, "H": 1.0, "h_rms": 1e-6}),
        "contact.H",
        ["got 1.0", "above 0, below 1"],
    ),
    "H zero": (
        rig(contact={"kind": "rough-line", "normal_force": 0.3, "friction_coefficient": 0.2, "H": 0, "h_rms": 1e-6}),
        "contact.H",
        ["above 0, below 1"],
    ),
    "missing key": (
        rig(contact={"kind": "sphere", "normal_force": 0.3, "friction_coefficient": 0.2}),
        "contact",
        ["'radius' is missing"],
    ),
    "no kind": (rig(contact={"normal_force": 0.3, "friction_coefficient": 0.2}), "contact", ["'kind' is missing"]),
    "two drives": (rig(drive__piece=[{"velocity": 1e-4, "duration": 1}]), "drive", ["more than once", "velocity"]),
    "no end": (rig(drive={"velocity": 1e-4}), "drive", ["neither 'duration' nor 'events'"]),
    "standing drive": (rig(drive={"velocity": 0, "events": 2}), "drive", ["no slip"]),
    "unknown effect": (rig(effect=[{"type": "contact-agein"}]), "effect.1.type", ["did you mean 'contact-ageing'"]),
    "unknown parameter": (
        rig(effect=[{"type": "contact-ageing", "rat": 0.01}]),
        "effect.1.rat",
        ["did you mean 'rate'"],
    ),
    "parameter out of range": (rig(effect=[{"type": "contact-ageing", "rate": 7}]), "effect.1.rate", ["7", "0.05"]),
    "parameter with a wrong unit": (
        rig(effect=[{"type": "contact-ageing", "slip_distance": "1 s"}]),
        "effect.1.slip_distance",
        ["1 s"],
    ),
    "trace with a folder": (rig(output__trace="../x.csv"), "output", ["without folders"]),
    "trace of no known kind": (rig(output__trace="x.xls"), "output", [".csv", "x.xls"]),
    "differing numbers of contacts": (rig(contact__each=[{}, {}]), "contact", ["differ", "2"]),
    "half a series": (rig(sweep={"key": "drive.velocity", "start": 1e-5}), "sweep", ["start, stop and points"]),
    "schema of the future": (rig(schema=2), "schema", ["1"]),
    "not a number": (rig(block__mass=float("nan")), "block.mass", ["finite"]),
    "a list for a quantity": (rig(block__mass=[1, 2]), "block.mass", ["not a quantity"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_message_with_file_key_value_and_what_is_allowed(tmp_path, case):
    content, key, words = BAD[case]
    path = write(tmp_path, content)
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    text = str(caught.value)
    assert caught.value.exit_code == 2
    assert text.startswith(path)
    assert key in text
    for word in words:
        assert word in text
    assert caught.value.__cause__ is None


def test_the_line_of_a_fault_is_named(tmp_path):
    path = write(tmp_path, rig(block__mass="89.4"))
    line = as_toml(rig(block__mass="89.4")).splitlines().index('mass = "89.4"') + 1
    with pytest.raises(InputError, match=f"line {line}: block.mass"):
        load_scenario(path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.toml", None, "not there"),
        ("broken.toml", b"mass = = 3", "not valid TOML"),
        ("binary.toml", b"\xff\xfe\x00schema", "UTF-8"),
        ("empty.toml", b"", "'schema'"),
        ("campaign.toml", b"schema = 1\n[[trace]]\nfile = 'a.csv'\n", "a campaign file, where a scenario file"),
        ("run.csv", b"time,displacement\n", "not a scenario file"),
    ],
)
def test_files_that_cannot_be_read(tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=words):
        load_scenario(tmp_path / name)


def test_a_missing_file_names_the_nearest_one(tmp_path):
    (tmp_path / "sphere.toml").write_text("")
    with pytest.raises(InputError, match=r"did you mean 'sphere\.toml'"):
        load_scenario(tmp_path / "spere.toml")
    with pytest.raises(InputError, match="stickslip new scenario FILE"):  # all such files have one ending
        load_scenario(tmp_path / "rig.toml")


def test_a_bare_number_out_of_range_is_told_its_unit(tmp_path):
    path = write(tmp_path, rig())
    with pytest.raises(InputError, match="at most 10 m/s\\n  to fix: a number alone is in m/s"):
        load_scenario(path, ["drive.velocity=50"])
    with pytest.raises(InputError) as told:
        load_scenario(path, ["drive.velocity=50 m/s"])
    assert told.value.hint is None


def test_a_folder_is_no_scenario(tmp_path):
    with pytest.raises(InputError, match="folder"):
        load_scenario(tmp_path)


def test_overrides_reach_tables_lists_and_effects(tmp_path):
    path = write(tmp_path, rig(effect=[{"type": "contact-ageing", "rate": 0.01}]))
    changed = load_scenario(
        path,
        [
            "contact.u_max=2um",
            "drive.velocity=1e-4",
            "effect.contact-ageing.rate=0.02",
            "effect.1.onset_time=0.5 s",
            "effect.sensor-drift.rate=3nm/s",
            "sensor.resolution=8 nm",
            "title=changed",
        ],
    )
    assert changed.file.contact.u_max == pytest.approx(2e-6)
    assert changed.file.drive.velocity == 1e-4
    assert changed.file.effect[0].parameters == {"rate": 0.02, "onset_time": "0.5 s"}
    assert changed.file.effect[1].type == "sensor-drift"
    assert changed.file.sensor.resolution == pytest.approx(8e-9)
    assert changed.title == "changed"
    assert load_scenario(path).file.drive.velocity == pytest.approx(2e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("contact.u_max", "not an assignment"),
        ("contact.=3", "not an assignment"),
        ("contact.umax=3um", "did you mean 'u_max'"),
        ("contact.u_max=-3um", "above 0 m"),
        ("title.x=3", "not a table"),
        ("effect.5.rate=1", "no such entry"),
    ],
)
def test_a_fault_in_an_override_is_placed_on_the_command_line(tmp_path, change, words):
    path = write(tmp_path, rig())
    with pytest.raises(InputError, match="--set") as caught:
        load_scenario(path, [change])
    assert words in str(caught.value)


def test_a_single_override_may_stand_by_itself(tmp_path):
    """Taken letter by letter it was 'not an assignment (got 'd')'."""
    path = write(tmp_path, rig())
    assert load_scenario(path, "drive.velocity=1e-4").file.drive.velocity == 1e-4


def test_values_of_overrides_are_toml_or_text():
    assert parse_assignment("a.b=3") == ("a.b", 3)
    assert parse_assignment("a.b = true") == ("a.b", True)
    assert parse_assignment('a.b="3 um"') == ("a.b", "3 um")
    assert parse_assignment("a.b=3 um") == ("a.b", "3 um")
    assert parse_assignment("a.b=[1, 2]") == ("a.b", [1, 2])


def test_series_are_logarithmic_between_positive_ends():
    table = parse_sweep("drive.velocity=20um/s:2mm/s:3")
    values = sweep_values(table["key"], table["start"], table["stop"], table["points"], None)
    assert values == pytest.approx([2e-5, 2e-4, 2e-3], rel=1e-12)
    assert series(-1.0, 1.0, 3) == [-1.0, 0.0, 1.0]
    table = parse_sweep("contact.H=0.2,0.5")
    assert sweep_values("contact.H", None, None, None, table["values"]) == [0.2, 0.5]


@pytest.mark.parametrize("text", ["drive.velocity", "drive.velocity=1:2", "drive.velocity=1:2:x", "=1:2:3"])
def test_a_series_that_is_none(text):
    with pytest.raises(InputError, match="not a series"):
        parse_sweep(text)


def test_a_series_with_one_unit_is_refused():
    with pytest.raises(InputError, match="has none"):
        sweep_values("drive.velocity", "20", "1 mm/s", 3, None)


def test_the_template_is_a_valid_scenario(tmp_path):
    scenario = load_scenario(write(tmp_path, scenario_template()))
    assert scenario.file.contact.kind == "rough-line"
    assert scenario.file.sensor is not None


def test_python_dictionaries_are_checked_as_files_are():
    with pytest.raises(InputError, match="did you mean 'mass'"):
        make_scenario(rig(block__mas=1))
    assert make_scenario(rig()).changed(drive__velocity="1 mm/s").file.drive.velocity == pytest.approx(1e-3)


def test_a_scenario_shows_what_was_written_and_changed():
    made = make_scenario(rig(effect=[{"type": "contact-ageing", "rate": 0.01}, {"type": "wear"}]))
    text = repr(made.changed(block__mass="50 g"))
    assert text.startswith("<Scenario>") and "Table" not in text and len(text) < 1500
    assert "block: mass: 50 g; " in text and "changed: block.mass" in text and "changed" not in repr(made)
    assert "effect: type: contact-ageing; rate: 0.01\n\neffect: type: wear" in text
    assert "block: mass: 50 g" in made.changed(block__mass="50 g")._repr_html_()


def test_a_scenario_goes_to_another_process(tmp_path):
    made = load_scenario(write(tmp_path, rig(effect=[{"type": "wear"}])), ["block.mass=50g"]).changed(contact__bins=64)
    there = pickle.loads(pickle.dumps(made))  # noqa: S301  (bytes of its own)
    assert there == made and there.changes == made.changes and there.path == made.path
    assert there.file.block.mass == pytest.approx(0.05) and there.changed(block__mass="1 kg").file.block.mass == 1.0
