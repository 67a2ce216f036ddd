"""What windows show besides the model, and that it comes back."""

from __future__ import annotations

from contextlib import closing

import pytest

from stickslip.workbench import app
from stickslip.workbench.catalogue_view import Listed
from stickslip.workbench.history_file import HistoryFile
from stickslip.workbench.residual_view import Residual
from stickslip.workbench.rivals_view import Rivals
from stickslip.workbench.session import Session
from stickslip.workbench.signals import Signals
from stickslip.workbench.simulation_form import SimulationForm
from stickslip.workbench.sweep_view import SweepView

FIELDS = {"velocity": "70 um/s", "hold": "3 s", "mass": "0.2 kg", "load": "2", "events": 4, "back": True}


class Shown:
    """Pages as a window makes them."""

    def __init__(self, session: Session) -> None:
        self.tabs = app.tabs(session)
        self.signals, self.residual = Signals(session), Residual(session)
        self.listed = Listed(session, self.residual)
        self.asked = SimulationForm(session)
        self.sweep, self.rivals = SweepView(session, self.asked), Rivals(session, self.asked)

    def fill(self) -> None:
        """As a user would."""
        self.tabs.active = 2
        self.signals.range.update(start=1.5, end=2.5)
        self.signals._later()
        self.residual.against.value, self.residual.period.value = "place", "100 um"
        self.listed._heard({"kind": "choose", "tag": "contact-ageing"})
        for name, value in FIELDS.items():
            self.asked.fields[name].value = value
        self.asked.run.value = "v200"
        self.sweep.low.value, self.sweep.points.value = "33 um/s", 9
        self.rivals.effects.value = ["wear", "tilt"]

    def told(self) -> list:
        """What is filled in."""
        return [
            self.tabs.active, self.signals.range.start, self.signals.range.end, self.residual.against.value,
            self.residual.period.value, self.residual.chosen, [f.value for f in self.asked.fields.values()],
            self.sweep.low.value, self.sweep.points.value, self.rivals.effects.value,
        ]  # fmt: skip


@pytest.fixture
def session(campaign, base, monkeypatch):
    monkeypatch.setattr(Session, "list_promises", lambda self: None)
    made = Session(campaign=campaign)
    made.first(base)
    made._keeper.journal = HistoryFile(campaign)
    return made


@pytest.mark.slow
def test_fields_page_zoom_and_the_chosen_effect_come_back(campaign, session):
    before = Shown(session)
    untouched = before.told()
    before.fill()
    told = before.told()
    assert told[0] == 2 and told[5] == "contact-ageing" and told != untouched
    assert Shown(session).told() == told  # a reload of the page
    with closing(Session(campaign=campaign)) as again:  # a restart: pages are made before the history is read
        made = Shown(again)
        assert made.told() != told
        again.begin()
        assert made.told() == told
        assert again.view == session.view


@pytest.mark.slow
def test_who_turns_to_a_page_before_the_history_is_read_stays_there(campaign, session):
    app.tabs(session).active = 2
    session.keep()
    with closing(Session(campaign=campaign)) as again:
        first, turned = app.tabs(again), app.tabs(again)
        turned.active = 3
        again.begin()
        assert (first.active, turned.active) == (2, 3)


@pytest.mark.slow
def test_what_nobody_filled_in_is_not_kept(session):
    Shown(session)
    session.run, session.event = "v400", 2
    assert not set(session.view) & {"simulate", "sweep", "rivals", "residual", "page"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "damage",
    [
        {"page": 7, "zoom": {"run": "v050", "from": "x", "to": None}, "residual": {"against": "none"}},
        {"page": "nowhere", "zoom": 3, "simulate": {"run": "no such run", "events": "many", "hold": 5}, "effect": 4},
        {"residual": [], "rivals": {"effects": ["no such effect"]}, "sweep": {"points": 10**9, "low": None}},
    ],
)
def test_what_is_damaged_or_of_another_version_is_left_alone(session, damage):
    plain = Shown(session).told()
    session.view = damage
    assert Shown(session).told() == plain


@pytest.mark.slow
def test_nothing_is_written_over_a_history_that_was_not_read_yet(campaign, session):
    session.remember("page", "keep_page")
    again = Session(campaign=campaign)
    again._keeper.journal = HistoryFile(campaign)
    again.remember("page", "model_page")
    assert HistoryFile(campaign).read()[2]["view"] == {"page": "keep_page"}
