"""Options from the environment: as on the line, with the variable named where a value is wrong."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from stickslip.cli import COMMANDS, run

ROOT = Path(__file__).parents[1]
RIG = str(ROOT / "scenarios" / "grzemba2014.toml")


def test_an_option_of_the_environment_is_as_one_on_the_line(monkeypatch, capsys):
    assert run(["creep", RIG, "--points", "4", "--set", "contact.H=0.6", "--set", "contact.h_rms=2um"]) == 0
    on_the_line = capsys.readouterr().out
    monkeypatch.setenv("STICKSLIP_CREEP_POINTS", "4")
    monkeypatch.setenv("STICKSLIP_CREEP_SET", "contact.H=0.6 contact.h_rms=2um")
    assert run(["creep", RIG]) == 0
    assert capsys.readouterr().out == on_the_line and on_the_line.count("\n") == 5


def test_an_empty_variable_is_not_set(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STICKSLIP_CREEP_OUT", "")
    assert run(["creep", RIG, "--points", "3"]) == 0
    assert capsys.readouterr().out.count("\n") == 4 and list(tmp_path.iterdir()) == []


def test_the_line_counts_more_than_the_environment(monkeypatch, capsys):
    monkeypatch.setenv("STICKSLIP_CREEP_POINTS", "many")
    assert run(["creep", RIG, "--points", "3"]) == 0
    assert capsys.readouterr().out.count("\n") == 4


WRONG = {
    "no number": ("STICKSLIP_DIAGNOSE_JOBS", "all", ["diagnose", "x.toml"], 'unable to convert "all" into int'),
    "an assignment": ("STICKSLIP_CREEP_SET", "contact.H=7", ["creep", RIG], "STICKSLIP_CREEP_SET: contact.H: "),
    "out of range": ("STICKSLIP_DIAGNOSE_JOBS", "0", ["diagnose", "x.toml"], "out of range (got 0)\n  allowed: 1"),
    "no unit": ("STICKSLIP_FIT_V_LIM", "9", ["fit", "x.toml"], "the unit is missing (got '9')"),
    "no choice": ("STICKSLIP_FIT_MODEL", "slow", ["fit", "x.toml"], 'Choose from: "static", "inertial"'),
    "no switch": ("STICKSLIP_FIT_FORCE", "maybe", ["fit", "x.toml"], 'unable to convert "maybe" into bool'),
    "in a group": ("STICKSLIP_CHALLENGE_MAKE_CASES", "0", ["challenge", "make", "x"], "needs cases (got 0)"),
    "misspelt": ("STICKSLIP_FIT_HOLDOUTS", "v400", ["fit", "x.toml"], "did you mean 'STICKSLIP_FIT_HOLDOUT'?"),
    "no option": ("STICKSLIP_FIT_CAMPAIGN", "y.toml", ["fit", "x.toml"], "the command 'fit' has no such option"),
    "the other way": ("STICKSLIP_OPEN_NO_BROWSER", "1", ["open", "x"], "did you mean 'STICKSLIP_OPEN_BROWSER'?"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_variable_is_named(case, monkeypatch, capsys, tmp_path):
    name, value, line, told = WRONG[case]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(name, value)
    assert run(line) == 2
    out = capsys.readouterr()
    assert name in out.err.splitlines()[0] and told in out.err and out.out == ""
    assert list(tmp_path.iterdir()) == []


def test_an_option_on_the_line_is_named_as_there(monkeypatch, capsys):
    monkeypatch.setenv("STICKSLIP_DIAGNOSE_JOBS", "2")
    assert run(["diagnose", "x.toml", "--jobs", "0"]) == 2
    assert capsys.readouterr().err.startswith("stickslip: --jobs: out of range")


def test_no_variable_of_the_package_is_read_as_an_option():
    sources = [*ROOT.glob("stickslip/**/*.py"), *ROOT.glob("docs/*.py")]
    found = {name for path in sources for name in re.findall(r'"(STICKSLIP_\w+)"', path.read_text(encoding="utf-8"))}
    own = found - {"STICKSLIP_"}
    assert "STICKSLIP_NO_CACHE" in own
    assert not [name for name in own for command in COMMANDS if name.startswith(f"STICKSLIP_{command.upper()}_")]
