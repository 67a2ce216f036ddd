"""What a diagnosis proposes to measure next comes from the fitted models that its data cannot tell apart."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.diagnose import summary
from stickslip.diagnose.menu import Conditions
from stickslip.diagnose.verdict import Verdict

PAIR = ("contact-ageing", "wear")


def diagnosis(kind="ambiguous", tags=PAIR, fits=(True, True)):
    """As much of a diagnosis as the question needs."""
    rivals = tuple(
        SimpleNamespace(tag=tag, composition=object(), fit=object() if f else None)
        for tag, f in zip(tags, fits, strict=True)
    )
    return SimpleNamespace(verdict=Verdict(kind, (), tags), sets=(rivals,), measurement=object())


@pytest.fixture
def asked(monkeypatch):
    """Stands for the simulations; remembers whom it was asked about."""
    calls = []

    def recommend_among(rivals, conditions, *, factor, progress):
        tags = [r.tag for r in rivals]
        calls.append((*tags, factor, progress))
        return {"text": "hold the drive", "separates": tags, "floors": calls_floors[0], "menu": []}

    calls_floors = [8.0]
    monkeypatch.setattr(summary, "recommend_among", recommend_among)
    monkeypatch.setattr(summary, "scatter_factor", lambda m: 0.7)
    monkeypatch.setattr(Conditions, "of", classmethod(lambda cls, m: "conditions"))
    return calls, calls_floors


@pytest.mark.parametrize("tags", [PAIR, (*PAIR, "tilt")])
def test_all_of_the_set_are_simulated(asked, tags):
    calls, _ = asked
    found = summary.next_experiment(diagnosis(tags=tags, fits=(True,) * len(tags)), print)
    assert calls == [(*tags, 1.7, print)]
    assert found["text"] == "hold the drive"


def test_every_set_has_its_own(asked):
    one = diagnosis()
    two = SimpleNamespace(**{**vars(one), "sets": (one.sets[0], diagnosis(tags=("tilt", "nonlinear-spring")).sets[0])})
    found = summary.next_experiment(two)
    assert found["separates"] == list(PAIR)
    assert [other["separates"] for other in found["others"]] == [["tilt", "nonlinear-spring"]]
    assert "others" not in summary.next_experiment(one)


def test_those_that_were_not_fitted_are_left_out(asked):
    summary.next_experiment(diagnosis(tags=(*PAIR, "tilt"), fits=(True, False, True)))
    assert asked[0] == [("contact-ageing", "tilt", 1.7, None)]


def test_where_no_experiment_helps_the_catalogue_speaks_first(asked):
    _, floors = asked
    floors[0] = 0.5
    assert summary.next_experiment(diagnosis())["text"] == "go back over the same track after a hold (hold the drive)"


def test_a_rival_that_was_not_fitted_leaves_the_catalogue(asked):
    found = summary.next_experiment(diagnosis(fits=(True, False)))
    assert found == {"text": "go back over the same track after a hold", "separates": list(PAIR)}
    assert asked[0] == []


@pytest.mark.parametrize("kind", ["complete", "missing", "unknown"])
def test_only_what_cannot_be_told_apart_needs_one(asked, kind):
    assert summary.next_experiment(SimpleNamespace(**{**vars(diagnosis(kind)), "sets": ()})) is None


def test_what_cannot_be_told_apart_needs_one_also_where_more_is_missing(asked):
    found = summary.next_experiment(diagnosis("unknown"))
    assert (found["text"], found["separates"]) == ("hold the drive", list(PAIR))


def test_conditions_are_those_of_the_measurement():
    size = np.zeros((2, 3, 4))
    size[0, :, 1], size[1, :, 1] = 2e-9, 4e-9
    size[..., 0] = 3e-5
    m = SimpleNamespace(
        layout=SimpleNamespace(slices=lambda: {"recurrence": slice(0, 1), "size": slice(1, 2)}),
        cycles=SimpleNamespace(
            used=np.array([[True, True, True], [True, False, False]]), stiffness=np.array([170.0, 170.0])
        ),
        anchors=SimpleNamespace(ring_period=np.full((2, 3), 2e-3)),
        velocities=np.array([2e-4, 5e-5]),
        sensor=size,
    )
    found = Conditions.of(m)
    assert found.velocities == (5e-5, 2e-4)
    assert (found.period, found.stiffness, found.noise, found.clock) == pytest.approx((2e-3, 170.0, 2e-9, 3e-5))
    m.cycles.stiffness = np.array([170.0, np.nan])
    assert np.isnan(Conditions.of(m).stiffness)
