"""``stickslip fit --holdout``: a run is kept from the fit, and every model is tried on it."""

from __future__ import annotations

import contextlib
import io
import json

import numpy as np
import pytest

from stickslip.cli import run

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


def test_a_fit_does_not_see_what_is_held_out(campaign):
    """Another gauge in the run that is held out changes the error there; of the fit only what all runs' floors do."""
    right = fitted(campaign, "--holdout", "b")
    rows = np.loadtxt(campaign.with_name("b.csv"), delimiter=",")
    rows[:, 1] *= 1.05
    np.savetxt(campaign.with_name("d.csv"), rows, delimiter=",", fmt="%.10g")
    wrong = campaign.with_name("wrong.toml")
    wrong.write_text(campaign.read_text().replace('"b.csv"', '"d.csv"'))
    found = fitted(wrong, "--holdout", "d.csv")
    assert found["ladder"][1]["heldout_error"] > 3 * right["ladder"][1]["heldout_error"]
    for name, p in right["parameters"].items():
        assert found["parameters"][name]["value"] == pytest.approx(p["value"], abs=0.1 * p["std"]), name


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
