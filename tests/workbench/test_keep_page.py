"""What is kept, without a browser."""

from __future__ import annotations

import json
import shlex

import pytest

from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.objects import experiments
from stickslip.objects.experiments import Setting
from stickslip.objects.fitted_run import load_run
from stickslip.system.units import shown_with
from stickslip.workbench import folders_view, history_text, keep_page, run_folders, simulation_folders
from stickslip.workbench.background_work import background
from stickslip.workbench.rivals_view import Rivals
from stickslip.workbench.simulated_view import SimulatedView
from stickslip.workbench.simulation_form import SimulationForm
from stickslip.workbench.sweep_view import SweepView

from .conftest import numbers

pytestmark = pytest.mark.slow

SCRIPT = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def saved(campaign, base):
    return run_folders.save(base, campaign, "first")


def _plain(path):
    result = json.loads((path / "result.json").read_text())
    return {k: v for k, v in result.items() if k not in ("seconds", "free_seconds")}


def test_saving_writes_what_fit_save_writes(saved, base, folder, tmp_path):
    assert saved == folder / "first"
    base.save(tmp_path / "same")
    assert _plain(saved) == _plain(tmp_path / "same")
    assert {p.name for p in saved.iterdir()} == {p.name for p in (tmp_path / "same").iterdir()}


def test_the_command_writes_the_same_numbers(saved, folder, tmp_path):
    out = tmp_path / "by the command"
    assert run(["fit", str(folder / "campaign.toml"), "--model", "inertial", "--out", str(out)]) == 0
    mine, its = numbers(_plain(saved)), numbers(_plain(out))
    assert len(mine) > 300 and mine == pytest.approx(its, rel=1e-9, abs=1e-15, nan_ok=True)


@pytest.mark.parametrize("name", ["../out", "/tmp/out", "a/b", "a\\b", "", "..", ".git", "first", "v050.csv", SCRIPT])
def test_a_folder_elsewhere_or_one_that_is_there_is_refused(saved, base, campaign, folder, name):
    before = sorted(p.name for p in folder.iterdir())
    with pytest.raises(InputError):
        run_folders.save(base, campaign, name)
    assert sorted(p.name for p in folder.iterdir()) == before


def test_what_was_saved_is_listed_with_its_error(saved, base, folder):
    own = next(k for k in run_folders.listed(folder) if k.name == "first")
    assert own.kind == "fit" and own.report and own.folder == saved
    assert f"error {shown_with(base.error, base.error_std)}" in own.words and "±" in own.words
    assert f"on unseen runs {shown_with(base.unseen_error, base.unseen_error_std)}" in own.words
    assert "<html" in run_folders.report(own).lower()


def test_a_folder_that_is_damaged_or_leads_elsewhere_is_left_out(tmp_path, saved):
    home = tmp_path / "home"
    for name in ("good", "bad", ".hidden", "odd"):
        (home / name).mkdir(parents=True)
    (home / "good" / "result.json").write_text('{"kind": "diagnose", "verdict": {"kind": "missing", "effects": ["a"]}}')
    (home / "odd" / "result.json").write_text('{"kind": "fit", "verdict": 3, "ladder": 4}')
    (home / "bad" / "result.json").write_text("{")
    (home / ".hidden" / "result.json").write_text("{}")
    (home / "link").symlink_to(saved)
    assert {k.name: k.words for k in run_folders.listed(home)} == {"good": "missing: a", "odd": "of another form"}


def test_a_report_is_shown_in_a_frame_that_runs_nothing(tmp_path):
    shown = folders_view.framed(f'"><h1>{SCRIPT}</h1>')
    assert shown.startswith("<iframe sandbox srcdoc=") and SCRIPT not in shown and '"><h1>' not in shown
    page = folders_view.framed("<html><head><title>t</title></head><body><img src='http://a/b.png'></body></html>")
    assert page.index("Content-Security-Policy") < page.index("title&gt;")  # so that nothing is asked of the network


def test_the_page_saves_lists_and_shows(session, folder):
    keep_page.page(session)
    made = folders_view.Folders(session)
    made.name.value = "by the page"
    made.save()
    assert background(session, "saving").said == "saved as by the page"
    names = [row[0] for row in made._table.rows]
    assert "by the page" in names
    told = json.loads((folder / "by the page" / "result.json").read_text())["history"]
    assert [row["step"] for row in told["steps"]] == ["the base model"]
    assert told["python"] == session.code().splitlines()
    assert told["commands"] == history_text.commands(session).splitlines()
    made._table._handle_msg({"kind": "row", "row": names.index("by the page")})
    assert "<iframe" in made._frame.object and made._tab.visible
    made.save()
    assert "already" in background(session, "saving").said
    made.what.value = folders_view.DIAGNOSIS
    made.save()
    assert "not there yet" in background(session, "saving").said
    for message in ({"kind": "row", "row": 10**6}, {"kind": "row", "row": "x"}, {"row": 0}, {}):
        made._table._handle_msg(message)


def test_the_lines_of_python_come_to_the_same_error(session, base, folder, monkeypatch):
    session.by_hand({"weakening.drop": base.values["weakening.drop"] * 1.01})
    monkeypatch.chdir(folder)
    names: dict = {}
    exec(session.code(), names)  # noqa: S102
    assert names["fit"].error == pytest.approx(session.fit.error, rel=1e-9)
    assert session.fit.error != pytest.approx(base.error, rel=1e-6)
    text = history_text.commands(session)
    assert "stickslip fit campaign.toml --out fit" in text and "by hand" in text


def test_any_step_can_be_gone_back_to(session, base):
    session.by_hand({"weakening.drop": base.values["weakening.drop"] * 1.01})
    session.by_hand({"weakening.drop": base.values["weakening.drop"] * 1.02})
    made = keep_page._history(session)[1]
    assert [row[-1] for row in made.rows] == ["", "", "shown"] and made.chosen == 2
    assert all(row[2] for row in made.rows) and made.rows[1][1].startswith("by hand")
    made._handle_msg({"kind": "row", "row": 0})
    assert session.fit is base and [row[-1] for row in made.rows] == ["shown", "undone", "undone"]
    made._handle_msg({"kind": "row", "row": 7})
    made._handle_msg("row")
    assert session.fit is base


def _saved_by_the_page(session, folder, what, name):
    made = folders_view.Folders(session)
    made.what.value, made.name.value = what, name
    made.save()
    assert background(session, "saving").said == f"saved as {name}"
    return json.loads((folder / name / "result.json").read_text())


def _by_command(told, folder, monkeypatch):
    """What the command that a run folder names writes, and that folder."""
    monkeypatch.chdir(folder)
    words = shlex.split(told["history"]["commands"][0])
    assert words[:2] == ["stickslip", "simulate"] and run(words[1:]) == 0
    out = folder / words[-1]
    return json.loads((out / "result.json").read_text()), out


def _the_same(mine, its, keys):
    for key in keys:
        assert numbers(mine[key]) == pytest.approx(numbers(its[key]), rel=1e-9, abs=1e-15, nan_ok=True), key


def _by_python(told, folder, monkeypatch):
    monkeypatch.chdir(folder)
    names: dict = {}
    exec("\n".join(told["history"]["python"]), names)  # noqa: S102
    return names


def test_a_simulation_is_kept_as_the_command_keeps_it(session, folder, monkeypatch):
    """Of a model that was moved by hand, with a hold, a heavier block and twice the load."""
    session.by_hand({"weakening.drop": session.fit.values["weakening.drop"] * 1.01})
    asked = SimulationForm(session)
    asked.run.value, asked.hold.value, asked.mass.value, asked.load.value = "v400", "1 s", "1.3 kg", "2"
    SimulatedView(session, asked).start()
    recording = background(session, "simulation").found.recording
    told = _saved_by_the_page(session, folder, "the simulation", "one run")
    its, out = _by_command(told, folder, monkeypatch)
    _the_same(told, its, ("events", "facts", "scenario"))
    assert len(told["events"]) == recording.sizes["event"] > 2 and told["kind"] == its["kind"] == "simulate"
    assert told["scenario"]["block"]["mass"] == 1.3 and told["inputs"] == session.campaign.inputs()
    made = {p.name: p for p in (folder / "one run").iterdir()}
    assert set(made) == {p.name for p in out.iterdir()}
    for name in ("trace.png", "static_vs_inertial.png"):
        assert made[name].stat().st_size > 10_000
    again = _by_python(told, folder, monkeypatch)["recording"]
    assert again["onset"].values == pytest.approx(recording["onset"].values, rel=1e-9)
    assert load_run(folder / "one run").fitted.values == pytest.approx(session.fit.fitted.values, rel=1e-12)
    text = history_text.python(session)
    assert "recording = ss.simulate(scenario)" in text and "saved as a run folder" in history_text.commands(session)


def test_a_sweep_is_kept_as_the_command_keeps_it(session, folder, monkeypatch):
    made = SweepView(session, SimulationForm(session))
    made.low.value, made.high.value, made.points.value = "200 um/s", "800 um/s", 2
    made.start()
    told = _saved_by_the_page(session, folder, "the sweep", "a sweep")
    its, out = _by_command(told, folder, monkeypatch)
    mine, asked = told["scenario"].pop("sweep"), its["scenario"].pop("sweep")
    _the_same(told, its, ("runs", "table", "scenario"))
    assert [float(asked[key]) for key in ("start", "stop")] == [mine[key] for key in ("start", "stop")]
    assert told["kind"] == its["kind"] == "series" and len(told["runs"]) == 2
    assert {p.name for p in (folder / "a sweep").iterdir()} == {p.name for p in out.iterdir()}
    assert (folder / "a sweep" / "series.csv").read_text() == (out / "series.csv").read_text()
    recordings = _by_python(told, folder, monkeypatch)["recordings"]
    assert [len(r["slip"]) for r in recordings] == [len(r["events"]) for r in told["runs"]]
    assert "stickslip simulate fit --trace" in history_text.commands(session)


def test_rivals_are_kept_each_in_every_experiment(session, base, aged, folder, monkeypatch):
    fits = {"contact-ageing": aged, "nothing": base}
    options = {"as driven": Setting("v400", "400 um/s", events=3, load="2"), "wrong": Setting("v400", mass="0 kg")}
    made = Rivals(session, SimulationForm(session))
    found = experiments.simulate_rivals(base, fits, options, _silent, code=session.code())
    background(session, "rivals").found = found
    assert made._table.rows[0][0] == "as driven"
    folders = folders_view.Folders(session)
    folders.what.value, folders.name.value = "the experiments", "experiments"
    folders.save()
    assert background(session, "saving").said == "saved as experiments"
    told = json.loads((folder / "experiments" / "result.json").read_text())
    first, failed = told["experiments"]
    assert first["experiment"] == "as driven" and first["margin"] >= 0.0 and "mass" in failed["note"]
    assert told["verdict"].startswith("contact-ageing or nothing: after as driven the true one is expected to be ")
    for tag, fit in fits.items():
        inner = json.loads((folder / "experiments" / first["folders"][tag] / "result.json").read_text())
        assert inner["kind"] == "simulate" and inner["fitted_model"]["parts"] == list(fit.parts)
        its, _ = _by_command(inner, folder, monkeypatch)
        _the_same(inner, its, ("events", "facts"))
    again = _by_python(told, folder, monkeypatch)["recordings"]
    for tag, recording in found[0].recordings.items():
        assert again[tag]["onset"].values == pytest.approx(recording["onset"].values, rel=1e-7), tag
    assert [k.name for k in run_folders.listed(folder) if k.name.startswith("experiments")][-1] == "experiments"
    own = next(k for k in run_folders.listed(folder) if k.name == "experiments")
    assert run_folders.report(own).count("<img") == 4 and "trace.png" in run_folders.report(own)


def test_what_was_not_simulated_cannot_be_saved(session, folder):
    made = folders_view.Folders(session)
    for what in folders_view.SIMULATED:
        made.what.value, made.name.value = what, "nothing there"
        made.save()
        assert "not there yet" in background(session, "saving").said
    wrong = [experiments.SimulatedExperiment("a", Setting("v400"), session.fit, {}, {}, note="no")]
    with pytest.raises(InputError, match="no experiment"):
        simulation_folders.save(wrong, session.campaign, "nothing there", _silent)
    assert not (folder / "nothing there").exists()


def _silent(text, share):
    assert 0.0 <= share <= 1.0
