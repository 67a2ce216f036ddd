"""The state of a workbench: steps, undo, what is kept, and what happens to mistakes."""

from __future__ import annotations

import json
from contextlib import closing
from functools import partial

import numpy as np
import pytest

import stickslip as ss
from stickslip.system.progress import Cancelled
from stickslip.workbench import search_process
from stickslip.workbench.history_file import FOLDER, HistoryFile
from stickslip.workbench.history_steps import Step, complete, fewer, moved
from stickslip.workbench.selection import choose, cycles, follow, selected, worst
from stickslip.workbench.session import Session

pytestmark = pytest.mark.slow  # of a fit that takes a quarter of a minute

DROP = "weakening.drop"


def test_a_drag_is_one_step_and_undo_goes_before_it(session, base):
    value = base.values[DROP]
    session.by_hand({DROP: value * 1.01})
    for share in (1.02, 1.03):
        session.by_hand({DROP: value * share}, over=True)
    assert len(session.steps) == 2
    assert session.fit.values[DROP] == pytest.approx(1.03 * value)
    session.by_hand({DROP: value * 1.04})  # another drag
    assert [s.changed.get(DROP) for s in session.steps[1:]] == pytest.approx([1.03 * value, 1.04 * value])
    session.undo()
    assert session.fit.values[DROP] == pytest.approx(1.03 * value)
    session.back()
    assert session.fit is base
    session.redo()
    session.by_hand({DROP: value})
    assert len(session.steps) == 3  # what came after is forgotten


def test_the_first_move_of_a_drag_is_not_laid_over_a_fit(session, base):
    session.by_hand({DROP: base.values[DROP] * 1.01}, over=True)
    assert len(session.steps) == 2


def test_a_step_says_how_it_is_done_in_python(session, base):
    session.by_hand({DROP: "0.2"})
    name = {"fit": base}
    exec(session.taken[-1].code, name)  # noqa: S102
    assert name["fit"].values[DROP] == pytest.approx(0.2)
    assert session.code().splitlines()[:2] == [
        "import stickslip as ss",
        "campaign = ss.load_campaign('campaign.toml')",
    ]


def test_the_keyboard_goes_on_from_the_cycle_that_is_shown(session, campaign):
    name, event = selected(session)
    assert event > 0 and session.event == 0
    follow(session, "ArrowRight")
    assert selected(session) == (name, event + 1)
    follow(session, "ArrowDown")
    assert selected(session) == ("v100", event + 1)
    bare = Session(campaign=campaign)  # before there is a model the data are gone through
    follow(bare, "ArrowUp")
    assert bare.run == campaign.names[-1]
    follow(bare, "ArrowLeft")
    assert bare.event == len(campaign.events[0].events) // 2 - 1


@pytest.mark.parametrize("value", [5.0, "3 apples", float("nan")])
def test_a_wrong_value_is_told_and_changes_nothing(session, base, value):
    session.by_hand({DROP: value})
    assert session.fit is base
    assert DROP in session.said


def test_an_effect_that_is_none_is_told(session, base):
    session.add("contact-ageeing")
    assert session.fit is base and "contact-ageing" in session.said
    assert session.busy == ""


def test_moved_by_hand_the_last_fit_is_still_at_hand(session, base):
    session.by_hand({DROP: base.values[DROP] * 1.02})
    assert session.fitted is base
    assert session.fit.error > 2.0 * base.error


def test_what_was_open_comes_back(campaign, base, session, monkeypatch):
    session._keeper.journal = HistoryFile(campaign)
    session.by_hand({DROP: base.values[DROP] * 1.02})
    session.lock(DROP, True)
    choose(session, "v200", 3)
    with closing(Session(campaign=campaign)) as again:
        again.begin()
        assert [s.text for s in again.steps] == [s.text for s in session.steps]
        assert again.locked == {DROP} and (again.run, again.event) == ("v200", 3)
        assert again.fit.by_hand and again.fit.values[DROP] == pytest.approx(base.values[DROP] * 1.02)
        np.testing.assert_allclose(again.fit.force.residual, session.fit.force.residual, rtol=1e-9)
        assert again.fit.error == pytest.approx(session.fit.error, rel=1e-6)
        assert again.fitted.unseen_error == pytest.approx(base.unseen_error, rel=1e-3)
        third = Session(campaign=campaign)
        monkeypatch.setattr(type(campaign), "fit", lambda self: base)
        third.begin()
        assert "another workbench" in third.said and len(third.steps) == 1
    again.undo()
    assert again.fit.error == pytest.approx(base.error, rel=1e-6)
    assert again.code() == session.code().rsplit("\n", 1)[0]


def test_a_history_does_not_depend_on_how_its_path_is_written(campaign, base, session, folder, monkeypatch):
    session._keeper.journal = HistoryFile(campaign)
    session.by_hand({DROP: base.values[DROP] * 1.02})
    monkeypatch.chdir(folder)
    assert len(HistoryFile(ss.load_campaign("campaign.toml")).read()[0]) == 2


def _elsewhere(kept):
    kept["steps"][0]["fit"]["rungs"][0]["arrays"] = "../../etc/passwd"
    return kept


@pytest.mark.parametrize("damage", [_elsewhere, lambda kept: [], lambda kept: {**kept, "event": None}])
def test_a_damaged_history_is_told_and_begun_anew(campaign, base, session, monkeypatch, damage):
    session._keeper.journal = HistoryFile(campaign)
    session.by_hand({DROP: base.values[DROP] * 1.02})
    path = session._keeper.journal.file
    path.write_text(json.dumps(damage(json.loads(path.read_text()))))
    monkeypatch.setattr(type(campaign), "fit", lambda self: base)
    with closing(Session(campaign=campaign)) as again:
        again.begin()
    assert "begins again" in again.said and again.fit is base


def test_a_history_of_other_data_is_left_alone(campaign, base, session, folder):
    session._keeper.journal = HistoryFile(campaign)
    session.by_hand({DROP: base.values[DROP] * 1.02})
    file = folder / "campaign.toml"
    text = file.read_text()
    try:
        file.write_text(text + "# another day\n")
        other = HistoryFile(ss.load_campaign(file))
        assert other.read() == ([], [], {})
        other.write([{"text": "base"}], [base], {})
        assert len(other.read()[0]) == 1
    finally:
        file.write_text(text)
    assert len(HistoryFile(campaign).read()[0]) == 2


def test_a_base_that_was_cancelled_can_be_fitted(campaign, base, monkeypatch):
    def cancelled(self):
        raise Cancelled

    session = Session(campaign=campaign)
    monkeypatch.setattr(type(campaign), "fit", cancelled)
    session.begin(keep=False)
    assert session.fit is None and "cancelled" in session.said
    monkeypatch.setattr(type(campaign), "fit", lambda self: base)
    session.refit()
    assert session.fit is base


def test_a_fit_of_a_campaign_that_is_not_open_any_more_is_no_step(base, session):
    def slow(fit):
        session.campaign = None
        return Step("text", fit, "code")

    session._change("fitting", slow)
    assert len(session.steps) == 1


def test_steps_that_are_dropped_leave_their_lines(base, session, monkeypatch):
    monkeypatch.setattr("stickslip.workbench.history_steps.MOST", 3)
    for share in (1.01, 1.02, 1.03, 1.04):
        session.by_hand({DROP: base.values[DROP] * share})
    assert len(session.steps) == 4
    assert [line.count("with_values") for line in session.code().splitlines()] == [0, 0, 0, 1, 1, 1, 1]


def test_models_of_forgotten_steps_are_removed(campaign, base, session, folder):
    session._keeper.journal = HistoryFile(campaign)
    for share in (1.01, 1.02, 1.03):
        session.by_hand({DROP: base.values[DROP] * share})
    count = len(list((folder / FOLDER).glob("*.npz")))
    session.back()
    session.by_hand({DROP: base.values[DROP] * 1.04})
    assert len(list((folder / FOLDER).glob("*.npz"))) == count - 2


def test_the_keyboard_goes_through_cycles_and_runs(session):
    assert selected(session)[0] == "v050"
    choose(session, "v050", 0)
    follow(session, "ArrowLeft")
    assert session.event == 0
    follow(session, "ArrowRight")
    assert selected(session) == ("v050", 1)
    follow(session, "ArrowUp")
    assert session.run == "holds"
    choose(session, "holds", 99)
    assert session.event == cycles(session)["holds"] - 1
    follow(session, "x")


def test_the_worst_cycle_of_a_phase(base):
    name, event = worst(base, "v100", "nucleation")
    assert name == "v100"
    data = base.force
    z = (data.residual / data.floor).values
    use = (data.run.values == "v100") & (data.phase.values == "nucleation") & ~data.left_out.values
    mean = {e: np.mean(z[use & (data.event.values == e)] ** 2) for e in np.unique(data.event.values[use])}
    assert event == max(mean, key=mean.get)
    assert worst(base, "nowhere", "all") is None


def test_a_refit_leaves_what_is_locked(session, base):
    moved = base.values[DROP] * 1.02
    session.by_hand({DROP: moved})
    session.lock(DROP, True)
    session.refit()
    assert session.fit.values[DROP] == pytest.approx(moved, rel=1e-3)
    assert not session.fit.by_hand


def test_a_campaign_can_be_begun_again(campaign, base, monkeypatch):
    monkeypatch.setattr(type(campaign), "fit", lambda self: base)
    with closing(Session(campaign=campaign)) as session:
        session.begin()
        session.begin()
        assert session._keeper.journal is not None and "another workbench" not in session.said


def test_a_second_window_leaves_the_listing_that_goes_on(session, base, monkeypatch):
    begun, cancelled = [], []

    class Fake:
        def cancel(self):
            cancelled.append(self)

    monkeypatch.setattr(search_process, "promises", lambda fit, *rest: begun.append((fit, rest[1])) or Fake())
    session.list_promises()
    begun[0][1](["one"], 0.5)
    session.list_promises()
    assert len(begun) == 1 and session.promises == ("one",) and not cancelled
    begun[0][1]([], 1.0)
    session.list_promises()
    assert len(begun) == 1 and session.promises == ("one",)
    session.loaded = 1
    session.list_promises()
    session.loaded = 2
    session.list_promises()
    assert len(begun) == 3 and session.promises == () and len(cancelled) == 2


def test_old_steps_hold_no_more_than_they_must(base):
    """A model keeps what was found when asked for, some 20 MB; when a step is shown again it is found again."""
    found = complete(base)
    name = found.free[0].name
    steps = tuple(moved(found, {name: found.values[name] * (1.0 + 1e-3 * i)}, {}) for i in range(8))
    told = [complete(step.fit).error for step in steps]
    kept = fewer(steps)
    assert len(kept) == 8
    assert kept[-1].fit is steps[-1].fit
    assert "_system" in vars(steps[0].fit.force_fit)
    assert "_system" not in vars(kept[0].fit.force_fit)
    assert [step.fit.error for step in kept] == told


def test_a_fit_tells_how_far_it_is(session):
    shares: list[float] = []
    session.param.watch(lambda event: shares.append(event.new), "share")
    session.add("viscous-drag")
    assert len(shares) > 3
    assert shares == sorted(shares)
    assert 0.5 < shares[-1] <= 1.0


@pytest.mark.parametrize("foreign", [True, False])
def test_a_law_of_ones_own_that_fails_does_not_end_the_listing(base, monkeypatch, foreign):
    told: list[str] = []

    def fails(fit, explained, tag, form):
        if tag == "wear":
            raise ValueError("of the law")
        return tag

    monkeypatch.setattr(search_process, "promise", fails)
    monkeypatch.setattr(search_process, "blamed", lambda error: ss.InputError("its law failed") if foreign else None)
    listing = partial(search_process._promises, base.force_fit, ["tilt", "wear"], lambda tag, share: told.append(tag))
    if foreign:
        listing()
        assert set(told) == {"tilt"}
    else:
        with pytest.raises(ValueError, match="of the law"):
            listing()
