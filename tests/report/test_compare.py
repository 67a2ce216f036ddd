"""Two runs side by side: differences in standard deviations, errors by phase, and errors in one message."""

import json
import math

import pytest

from stickslip.cli import run
from stickslip.errors import RunFolderError
from stickslip.show.report.compare import comparison, comparison_figure
from stickslip.system.runstore import json_text


def rung(model, train, held, **phases):
    return {
        "model": model,
        "added": model[-1],
        "train_error": train,
        "heldout_error": held,
        "by_phase": phases,
        "heldout_by_phase": {name: 2 * value for name, value in phases.items()},
    }


def parameter(value, std, unit="1"):
    return {"value": value, "std": std, "unit": unit, "doc": "a parameter"}


def free(name, scale):
    return {"name": name, "scale": scale}


FIRST = {
    "schema": 1,
    "kind": "fit",
    "title": "one",
    "ladder": [rung(["static"], 900.0, None, creep=900.0), rung(["static", "inertia"], 3.0, 4.0, creep=2.0, slip=5.0)],
    "parameters": {
        "contact.p": parameter(3.0, 0.3),
        "contact.u_max": parameter(1e-6, 1e-7, "m"),
        "sensor-drift.rate": parameter(4e-9, 3e-10, "m/s"),
        "start.2": parameter(1e-6, 1e-7, "m"),
    },
    "fitted_model": {
        "free": [free("contact.p", "log"), free("contact.u_max", "log"), free("sensor-drift.rate", 1e-9)],
        "fixed": {"rig.spring_stiffness": 1000.0},
        "mass": 0.0894,
    },
    "inputs": [{"file": "a.csv", "sha256": "1"}, {"file": "campaign.toml", "sha256": "2"}],
}
SECOND = {
    "schema": 1,
    "verdict": {"kind": "missing", "effects": ["contact-ageing"], "text": "The base model lacks contact-ageing."},
    "title": "two",
    "ladder": [rung(["static", "inertia", "contact-ageing"], 0.9, 1.1, creep=0.8, hold=1.0)],
    "parameters": {
        "contact.p": parameter(3.3, 0.33),
        "contact.u_max": parameter(2e-6, 2e-7, "m"),
        "sensor-drift.rate": parameter(0.0, 4e-10, "m/s"),
        "contact-ageing.rate": parameter(0.01, 0.001),
    },
    "fitted_model": FIRST["fitted_model"],
    "inputs": [{"file": "a.csv", "sha256": "1"}, {"file": "campaign.toml", "sha256": "3"}],
}


@pytest.fixture
def folders(tmp_path):
    out = []
    for name, content in (("one", FIRST), ("two", SECOND)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "result.json").write_text(json_text(content), encoding="utf-8")
        out.append(tmp_path / name)
    return out


def test_differences_are_in_standard_deviations(folders):
    rows = {row["name"]: row for row in comparison(*folders)["parameters"]}
    assert "start.2" not in rows
    # both are sought as logarithms, each known to 10 %
    assert rows["contact.u_max"]["deviations"] == pytest.approx(math.log(2.0) / math.hypot(0.1, 0.1))
    assert rows["contact.u_max"]["difference"] == pytest.approx(1e-6)
    # on a linear scale: -4 nm/s against 0.5 nm/s
    assert rows["sensor-drift.rate"]["deviations"] == pytest.approx(-8.0)
    assert rows["contact-ageing.rate"]["value"] == [None, 0.01]
    assert rows["contact-ageing.rate"]["deviations"] is None
    assert rows["rig.mass"]["deviations"] == 0.0
    reverse = {row["name"]: row for row in comparison(*reversed(folders))["parameters"]}
    assert reverse["contact.u_max"]["deviations"] == pytest.approx(-rows["contact.u_max"]["deviations"])


def test_errors_are_those_of_the_last_models(folders):
    found = comparison(*folders)
    rows = {row["phase"]: row for row in found["errors"]}
    assert list(rows) == ["creep", "slip", "hold", "all"]
    assert rows["creep"]["train"] == [2.0, 0.8]
    assert rows["creep"]["heldout"] == [4.0, 1.6]
    assert rows["slip"]["train"] == [5.0, None]
    assert rows["all"] == {"phase": "all", "train": [3.0, 0.9], "heldout": [4.0, 1.1]}
    assert [r["verdict"] for r in found["runs"]] == [None, "missing"]


def test_only_the_measurements_decide_whether_errors_can_be_compared(folders):
    assert "same measurements" in comparison(*folders)["notes"][0]
    other = {**SECOND, "inputs": [{"file": "b.csv", "sha256": "9"}]}
    (folders[1] / "result.json").write_text(json_text(other), encoding="utf-8")
    assert "different measurements" in comparison(*folders)["notes"][0]


def test_the_command_prints_and_writes(folders, tmp_path, capsys):
    names = [str(f) for f in folders]
    assert run(["compare", *names, "--out", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert "static + inertia + contact-ageing" in text
    assert "The base model lacks contact-ageing." in text
    assert "+4.9" in text
    assert "1 µm +- 100 nm" in text
    assert "89.4 g" in text
    assert (tmp_path / "out" / "compare.png").read_bytes()[:4] == b"\x89PNG"
    kept = json.loads((tmp_path / "out" / "result.json").read_text())
    assert kept["kind"] == "compare"
    assert run(["compare", *names, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["parameters"] == kept["parameters"]


def test_the_picture_has_a_bar_for_every_error_and_deviation(folders):
    left, right = comparison_figure(comparison(*folders)).axes
    heights = sorted(p.get_height() for p in left.patches if p.get_height() == p.get_height())
    assert heights == sorted([2.0, 0.8, 4.0, 1.6, 5.0, 10.0, 1.0, 2.0, 3.0, 0.9, 4.0, 1.1])
    assert len(right.containers[0]) == 3


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "not a run folder"),
        ("{", "cannot be read"),
        ('{"kind": "simulate"}', "simulate"),
        ('{"kind": "fit", "model": "static", "ladder": []}', "static"),
        ('{"ladder": [{"model": ["static"]}]}', "does not have the form"),
        ('{"ladder": [{"model": ["a"], "train_error": 1}], "parameters": [1]}', "does not have the form"),
    ],
)
def test_what_cannot_be_compared_is_one_message(folders, capsys, content, words):
    path = folders[1] / "result.json"
    path.unlink() if content is None else path.write_text(content)
    assert run(["compare", *map(str, folders)]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "two" in error
    assert "Traceback" not in error
    with pytest.raises(RunFolderError):
        comparison(*folders)
