"""The rules by which a diagnosis names an effect, on made-up outcomes of refits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from stickslip.inference.diagnose.decide import (
    CHANCE,
    DISPERSION,
    ERRORS,
    Judged,
    best_forms,
    held_back,
    named,
    odd,
    standard_error,
)
from stickslip.inference.diagnose.search_round import Round
from stickslip.inference.diagnose.summary import FARTHER, failures, nearest_text
from stickslip.inference.fit.parameters import effect_parameters
from stickslip.inference.force.candidates import Candidate
from stickslip.physics.effects import catalogue

EVENTS = 40


def judged(
    tag: str, gain: float, each: float, *, spread: float = 1.0, chance: float = 1e-9,
    form: dict[str, str] | None = None, parameters: int = 8, far: dict[str, float] | None = None, nearer: float = 1.0,
) -> Judged:  # fmt: skip
    """An effect whose gain on every unseen event is ``each``, give or take ``spread``."""
    swing = spread * np.where(np.arange(EVENTS) % 2, 1.0, -1.0)
    fit: Any = SimpleNamespace(free=range(parameters))
    return Judged(
        fit, gain, chance, each + swing, nearer + swing, Candidate(tag, form or {}, gain, None), 0.01, 0.001, far or {}
    )  # fmt: skip


def test_what_predicts_unseen_runs_best_is_named():
    close = named([judged("wear", 300.0, 4.0), judged("tilt", 320.0, 8.0), judged("inertia", 50.0, 1.0)])
    assert [j.tag for j in close] == ["tilt"]


@pytest.mark.parametrize("change", [{"chance": 2.0 * CHANCE}, {"spread": 100.0}], ids=["chance", "scatter"])
def test_each_condition_of_being_seen_is_needed(change):
    assert judged("wear", 300.0, 4.0).seen
    assert not judged("wear", 300.0, 4.0, **change).seen
    assert named([judged("wear", 300.0, 4.0, **change)]) == []


def test_the_error_of_unseen_runs_may_not_rise_beyond_its_standard_error():
    error = 1.0 / np.sqrt(EVENTS)
    assert judged("wear", 300.0, 4.0, nearer=-0.9 * error).seen
    assert not judged("wear", 300.0, 4.0, nearer=-1.1 * error).seen


def test_so_many_standard_errors_over_the_events():
    error = judged("wear", 300.0, 1.0).error
    assert error == pytest.approx(np.sqrt(EVENTS) * np.std(np.tile([1.0, -1.0], EVENTS // 2), ddof=1))
    just = ERRORS * error / EVENTS
    assert judged("wear", 300.0, 1.01 * just).seen
    assert not judged("wear", 300.0, 0.99 * just).seen


def test_what_predicts_as_well_event_by_event_is_a_set():
    close = named([judged("wear", 300.0, 8.0), judged("sensor-gain", 290.0, 7.9), judged("tilt", 100.0, 3.0)])
    assert [j.tag for j in close] == ["wear", "sensor-gain"]


def test_of_a_law_and_its_special_case_the_special_case_stays():
    both = [judged("rate-and-state", 304.0, 8.05, parameters=9), judged("contact-ageing", 300.0, 8.0)]
    assert [j.tag for j in named(both)] == ["contact-ageing"]
    paid = [judged("rate-and-state", 312.0, 8.05, parameters=9), judged("contact-ageing", 300.0, 8.0)]
    assert [j.tag for j in named(paid)] == ["rate-and-state", "contact-ageing"]
    alone = [judged("rate-and-state", 410.0, 12.0), judged("contact-ageing", 300.0, 8.0)]
    assert [j.tag for j in named(alone)] == ["rate-and-state"]


def test_what_lies_far_from_where_such_effects_lie_is_not_seen():
    far = np.sqrt(400.0 / DISPERSION)  # at a price of more than it gains
    pair = [judged("velocity-weakening", 300.0, 8.5, far={"velocity-weakening.drop": far}), judged("wear", 300.0, 8.0)]
    assert [j.tag for j in named(pair)] == ["wear"]
    assert named(pair[:1]) == []


@pytest.mark.parametrize(("amplitude", "quarters"), [(-0.02, 0.2), (0.1, 0.0), (0.6, 2.0)])
def test_parameters_beyond_their_usual_range_have_a_price(amplitude, quarters):
    (free, *_) = effect_parameters(catalogue.get("velocity-weakening")())
    assert free.usual == (0.0, 0.4)
    fit: Any = SimpleNamespace(free=(free,), point=SimpleNamespace(z=np.array([free.inward(amplitude)])))
    found = odd(fit, "velocity-weakening")
    assert found == (pytest.approx({"velocity-weakening.drop": quarters}) if quarters else {})
    dear = judged("velocity-weakening", 300.0, 8.5, far=found)
    assert dear.price == pytest.approx(DISPERSION * quarters**2)
    assert dear.better == pytest.approx(float(dear.unseen.sum()) - dear.price)


@pytest.mark.parametrize("amplitude, seen", [(-0.0185, True), (-0.0195, False), (-0.02, False), (0.0995, False)])
def test_an_amplitude_at_its_bound_is_not_seen(amplitude, seen):
    """Rate-and-state goes from -0.02 to 0.1."""
    found = replace(judged("rate-and-state", 300.0, 4.0), amplitude=amplitude, std=0.001)
    assert found.seen == seen
    assert not replace(found, std=0.0).seen  # what the fit holds at a bound has no deviation


def test_what_only_its_bound_keeps_from_being_seen_stops_a_name():
    bound = replace(judged("rate-and-state", 600.0, 12.0), amplitude=-0.02, std=0.0)
    right = judged("wear", 300.0, 8.0)
    assert held_back([right, bound]) is bound
    assert named([right, bound]) == []
    assert held_back([bound]) is bound


def test_and_the_answer_says_what_keeps_each_from_being_named():
    bound = replace(judged("rate-and-state", 600.0, 12.0), amplitude=-0.02, std=0.0)
    right, base = judged("wear", 300.0, 8.0), cast("Any", None)
    done = Round(base, (right, bound), (), ())
    assert done.beyond is bound
    assert failures(right, done) == ["rate-and-state makes unseen runs more likely, but at its bound"]
    assert "not inside its bounds" in failures(bound, done)[0]
    assert Round(base, (right,), (), (right,)).beyond is None


def test_the_answer_says_which_law_comes_nearest_and_with_which_amplitude():
    text = nearest_text(replace(judged("sensor-drift", 600.0, 12.0), amplitude=2e-8, std=0.0))
    assert "sensor-drift comes nearest, with sensor-drift.rate = 20 nm/s, at a bound" in text


def test_what_only_the_error_of_events_keeps_from_being_seen_stops_a_name_as_well():
    """Damping of the contact beside a fixture that gives: 484 +- 41 on unseen runs, and another law gains 149 +- 29."""
    farther = judged("wear", 600.0, 12.0, nearer=-1.0)
    other, base = judged("tilt", 300.0, 3.0), cast("Any", None)
    assert not farther.seen and held_back([other, farther]) is farther
    assert named([other, farther]) == []
    done = Round(base, (other, farther), (), ())
    assert done.beyond is farther
    assert failures(other, done) == ["wear makes unseen runs more likely, but " + FARTHER]
    assert failures(farther, done) == [FARTHER]
    assert "predicts left-out events worse" in nearest_text(farther) and "wear comes nearest" in nearest_text(farther)


def test_and_does_not_stop_what_predicts_them_as_well():
    farther, right = judged("wear", 600.0, 8.0, nearer=-1.0), judged("tilt", 590.0, 7.99)
    assert [j.tag for j in named([right, farther])] == ["tilt"]


@pytest.mark.parametrize("change", [{"chance": 2.0 * CHANCE}, {"spread": 100.0}, {"nearer": -1.0}])
def test_but_only_if_it_would_be_seen_otherwise(change):
    bound = replace(judged("rate-and-state", 600.0, 12.0, **change), amplitude=-0.02, std=0.0)
    right = judged("wear", 300.0, 8.0)
    assert held_back([right, bound]) is None
    assert named([right, bound]) == [right]


def test_and_only_if_it_predicts_better():
    bound = replace(judged("rate-and-state", 600.0, 8.1), amplitude=-0.02, std=0.0)
    right = judged("wear", 300.0, 8.0)
    assert held_back([right, bound]) is None
    assert named([right, bound]) == [right]


def test_a_few_events_that_say_all_are_enough():
    """After two holds of forty sticks one law is right by 130 each, and elsewhere both are."""
    difference = np.zeros(EVENTS)
    difference[[10, 20]] = 130.0
    assert standard_error(difference) == pytest.approx(np.sqrt(4.0 * DISPERSION * 260.0))
    assert difference.sum() > ERRORS * standard_error(difference)


def test_every_effect_stands_once_in_its_best_form():
    forms = [
        judged("wear", 300.0, 8.0, form={"course": "linear"}),
        judged("wear", 303.0, 6.0, form={"course": "logarithmic"}),
        judged("wear", 200.0, 9.0, form={"course": "saturating"}),
    ]
    found = best_forms(forms)
    assert [j.candidate.form["course"] for j in found] == ["linear"]
