"""What is kept, without a browser."""

from __future__ import annotations

import json

import pytest

from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.workbench import keep_page, kept
from stickslip.workbench.beside import beside
from stickslip.workbench.session import Session

SCRIPT = "<script>alert(1)</script>"


@pytest.fixture
def session(campaign, base):
    made = Session(campaign=campaign)
    made.first(base)
    return made


@pytest.fixture(scope="module")
def saved(campaign, base):
    return kept.save(base, campaign, "first")


def _plain(path):
    result = json.loads((path / "result.json").read_text())
    return {k: v for k, v in result.items() if k not in ("seconds", "free_seconds")}


def test_saving_writes_what_fit_save_writes(saved, base, folder, tmp_path):
    assert saved == folder / "first"
    base.save(tmp_path / "same")
    assert _plain(saved) == _plain(tmp_path / "same")
    assert {p.name for p in saved.iterdir()} == {p.name for p in (tmp_path / "same").iterdir()}


def _numbers(thing, where=""):
    """Every number of a result, by the way to it."""
    if isinstance(thing, dict):
        return {k: v for key, value in thing.items() for k, v in _numbers(value, f"{where}/{key}").items()}
    if isinstance(thing, list):
        return {k: v for i, value in enumerate(thing) for k, v in _numbers(value, f"{where}/{i}").items()}
    return {where: thing} if isinstance(thing, (int, float)) else {}


def test_the_command_writes_the_same_numbers(saved, folder, tmp_path):
    out = tmp_path / "by the command"
    assert run(["fit", str(folder / "campaign.toml"), "--model", "inertial", "--out", str(out)]) == 0
    mine, its = _numbers(_plain(saved)), _numbers(_plain(out))
    assert len(mine) > 300 and mine == pytest.approx(its, rel=1e-9, abs=1e-15, nan_ok=True)


@pytest.mark.parametrize("name", ["../out", "/tmp/out", "a/b", "a\\b", "", "..", ".git", "first", "v050.csv", SCRIPT])
def test_a_folder_elsewhere_or_one_that_is_there_is_refused(saved, base, campaign, folder, name):
    before = sorted(p.name for p in folder.iterdir())
    with pytest.raises(InputError):
        kept.save(base, campaign, name)
    assert sorted(p.name for p in folder.iterdir()) == before


def test_what_was_saved_is_listed_with_its_error(saved, base, folder):
    own = next(k for k in kept.listed(folder) if k.name == "first")
    assert own.kind == "fit" and own.report and own.folder == saved
    assert f"error {base.error:.3f}" in own.words and f"on unseen runs {base.unseen_error:.3f}" in own.words
    assert "<html" in kept.report(own).lower()


def test_a_folder_that_is_damaged_or_leads_elsewhere_is_left_out(tmp_path, saved):
    home = tmp_path / "home"
    for name in ("good", "bad", ".hidden", "odd"):
        (home / name).mkdir(parents=True)
    (home / "good" / "result.json").write_text('{"kind": "diagnose", "verdict": {"kind": "missing", "effects": ["a"]}}')
    (home / "odd" / "result.json").write_text('{"kind": "fit", "verdict": 3, "ladder": 4}')
    (home / "bad" / "result.json").write_text("{")
    (home / ".hidden" / "result.json").write_text("{}")
    (home / "link").symlink_to(saved)
    assert {k.name: k.words for k in kept.listed(home)} == {"good": "missing: a", "odd": "of another form"}


def test_a_report_is_shown_in_a_frame_that_runs_nothing(tmp_path):
    shown = keep_page.framed(f'"><h1>{SCRIPT}</h1>')
    assert shown.startswith("<iframe sandbox srcdoc=") and SCRIPT not in shown and '"><h1>' not in shown
    page = keep_page.framed("<html><head><title>t</title></head><body><img src='http://a/b.png'></body></html>")
    assert page.index("Content-Security-Policy") < page.index("title&gt;")  # so that nothing is asked of the network


def test_the_page_saves_lists_and_shows(session, folder):
    keep_page.page(session)
    made = keep_page._Folders(session)
    made.name.value = "by the page"
    made.save()
    assert beside(session, "saving").said == "saved as by the page"
    names = [row[0] for row in made._table.rows]
    assert "by the page" in names
    history = json.loads((folder / "by the page" / "result.json").read_text())["history"]
    assert [row["step"] for row in history["steps"]] == ["the base model"]
    assert history["python"] == session.code().splitlines()
    assert history["commands"] == keep_page.commands(session).splitlines()
    made._heard({"kind": "row", "row": names.index("by the page")})
    assert "<iframe" in made._frame.object and made._tab.visible
    made.save()
    assert "already" in beside(session, "saving").said
    made.what.value = keep_page.DIAGNOSIS
    made.save()
    assert "not there yet" in beside(session, "saving").said
    for message in ({"kind": "row", "row": 10**6}, {"kind": "row", "row": "x"}, {"row": 0}, {}):
        made._heard(message)


def test_the_lines_of_python_come_to_the_same_error(session, base, folder, monkeypatch):
    session.by_hand({"weakening.drop": base.values["weakening.drop"] * 1.01})
    monkeypatch.chdir(folder)
    names: dict = {}
    exec(session.code(), names)  # noqa: S102
    assert names["fit"].error == pytest.approx(session.fit.error, rel=1e-9)
    assert session.fit.error != pytest.approx(base.error, rel=1e-6)
    text = keep_page.commands(session)
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
