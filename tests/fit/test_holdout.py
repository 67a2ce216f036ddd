"""``stickslip fit --holdout``: a run is kept from the fit, and every model is tried on it."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.cli import run
from stickslip.cli._inertial import _training
from stickslip.trace import Trace

from . import synthetic


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Two short runs of the model under noise of 30 nm."""
    folder = tmp_path_factory.mktemp("campaign")
    text = 'schema = 1\n[rig]\nmass = "89.4 g"\ncontacts = 4\nnormal_force = "0.31 N"\n'
    text += f'friction_coefficient = {0.26 / 1.24}\nspring_stiffness = "1000 N/m"\n'
    for name, trace in zip("ab", synthetic.traces((1e-4, 2e-4), slips=2.6), strict=True):
        um = 1e6 * np.asarray(trace.displacement) + 0.03 * np.random.default_rng(3).standard_normal(trace.time.size)
        np.savetxt(folder / f"{name}.csv", np.column_stack([trace.time, um]), delimiter=",", fmt="%.10g")
        text += f"""
[[trace]]
file = "{name}.csv"
time = {{ column = 1, unit = "s" }}
displacement = {{ column = 2, unit = "um" }}
drive_velocity = "{100 if name == "a" else 200} um/s"
virgin = true
"""
    (folder / "c.toml").write_text(text)
    return folder / "c.toml"


def fitted(campaign, *more):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert run(["fit", str(campaign), "--starts", "1", "--most-events", "2", "--json", *more]) == 0
    return json.loads(out.getvalue())


@pytest.mark.parametrize("how", ["flag", "role"])
def test_a_run_is_kept_aside_and_tried(campaign, how):
    if how == "role":
        roles = campaign.with_name("roles.toml")
        roles.write_text(campaign.read_text() + 'role = "held-out"\n')
        campaign = roles
    found = fitted(campaign, *(["--holdout", "b"] if how == "flag" else []))
    assert found["fit"]["cycles"] == 2
    assert found["misfit"]["unseen"] == ["b"]
    static, dynamic = found["ladder"]
    assert static["heldout_error"] > 10 * dynamic["heldout_error"]
    assert not any("--holdout" in note for note in found["notes"])


def test_what_is_wrong_with_a_run_held_out_shows_there_alone(campaign):
    """Another gauge in that run; only the floors, which all runs have in common, carry a little of it over."""
    right = fitted(campaign, "--holdout", "b")["ladder"][1]
    rows = np.loadtxt(campaign.with_name("b.csv"), delimiter=",")
    rows[:, 1] *= 1.05
    np.savetxt(campaign.with_name("d.csv"), rows, delimiter=",", fmt="%.10g")
    wrong = campaign.with_name("wrong.toml")
    wrong.write_text(campaign.read_text().replace('"b.csv"', '"d.csv"'))
    found = fitted(wrong, "--holdout", "d.csv")["ladder"][1]
    assert found["heldout_error"] > 3 * right["heldout_error"]
    assert found["train_error"] == pytest.approx(right["train_error"], rel=0.05)


def test_the_cycles_of_a_run_held_out_are_not_fitted():
    cycles = SimpleNamespace(used=np.array([[True, True], [True, False], [True, True]]))
    m = SimpleNamespace(cycles=cycles, names=("a", "b", "c"))
    traces = [Trace(name, np.arange(2.0), displacement=np.zeros(2)) for name in m.names]
    held = [replace(t, role="held-out") if t.name == "c" else t for t in traces]
    seen = np.array([[1, 1], [1, 0], [0, 0]], bool)
    np.testing.assert_array_equal(_training(m, held, ()), seen)
    np.testing.assert_array_equal(_training(m, traces, ("c",)), seen)
    np.testing.assert_array_equal(_training(m, held, ("b.csv",)), [[1, 1], [0, 0], [1, 1]])
    np.testing.assert_array_equal(_training(m, traces, ()), cycles.used)


def test_without_one_nothing_is_known_of_unseen_runs_and_how_to_mend_it_is_said(campaign):
    found = fitted(campaign)
    assert found["fit"]["cycles"] == 4
    assert [step["heldout_error"] for step in found["ladder"]] == [None, None]
    assert any("--holdout RUN" in note for note in found["notes"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--holdout", "c"], "no run of this name to hold out"),
        (["--holdout", "a", "--holdout", "b"], "every run is held out"),
        (["--holdout", "a", "--model", "static"], "--holdout belongs to the dynamic model"),
    ],
)
def test_what_cannot_be_held_out_is_said(campaign, capsys, arguments, words):
    assert run(["fit", str(campaign), *arguments]) == 2
    assert words in capsys.readouterr().err
