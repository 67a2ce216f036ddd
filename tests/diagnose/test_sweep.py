"""The stages of a sweep, with candidates whose costs are invented: who is followed, what is kept, what comes back."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.diagnose import sweep as module
from stickslip.diagnose.candidate import Candidate, forms_of
from stickslip.diagnose.refit import FEW, MORE
from stickslip.diagnose.sweep import EXPLAINING, FOLLOWED, FORMS, LIKE, PROMISING, SWEPT, Ground, Sweep, best_forms
from stickslip.effects import catalogue
from stickslip.fit.inertial import Fit
from stickslip.residual import Misfit

FINAL = {"contact-ageing": 100.0, "wear": 110.0}  # where a fit to the end arrives; elsewhere it stays
AFAR = {"sensor-gain": 50.0, "tilt": 60.0, "adhesion": 990.0}  # where a fit begun at a plausible amplitude arrives
LITTLE, MUCH = 0.5, 5.0  # floors
REST = [LITTLE]  # error of what is fitted to the end


def invented(effect, cost: float, promise: float, note: str = "") -> Candidate:
    shape = (1, 1, 1)
    fit = Fit(np.zeros(1), np.zeros((1, 1, 2)), cost, cost, np.zeros(shape), np.zeros(shape), np.eye(1), (),
              np.zeros((*shape, 1)), np.ones((1, 1), bool), 1, 1)  # fmt: skip
    form = {k: str(v) for k, v in vars(effect).items() if isinstance(v, str)}
    return Candidate(effect.tag, form, effect, promise / 2, promise, fit=fit, note=note)


def described(error: float = LITTLE) -> Misfit:
    return Misfit(error, {"slip": error}, {})


@pytest.fixture
def calls(monkeypatch):
    done: list[tuple[str, str]] = []
    order = catalogue.tags()

    def score(effect, *rest):
        done.append(("score", effect.tag))
        promise = 0.9 if effect.tag in FINAL else 0.5 / (1 + order.index(effect.tag))
        return invented(effect, 1000.0, promise, "not refitted")

    def refine(candidate, data, floor, train, evaluations):
        done.append((f"refine {evaluations}", candidate.tag))
        cost = 150.0 if candidate.tag in FINAL else 900.0
        return replace(invented(candidate.effect, cost, candidate.promise), score=candidate.score)

    def settle(candidate, data, floor, train, worth):
        assert worth == FOLLOWED * 1000.0
        done.append(("settle", candidate.tag))
        found = invented(candidate.effect, FINAL.get(candidate.tag, candidate.cost), candidate.promise)
        return replace(found, train=described(REST[0]), settled=True)

    def afar(candidate, optimum, data, floor, train):
        done.append(("afar", candidate.tag))
        better = candidate.tag in AFAR
        return invented(candidate.effect, AFAR[candidate.tag], candidate.promise) if better else candidate

    REST[0] = LITTLE
    monkeypatch.setattr(module, "score", score)
    monkeypatch.setattr(module, "refine", refine)
    monkeypatch.setattr(module, "settle", settle)
    monkeypatch.setattr(module, "afar", afar)
    monkeypatch.setattr(module, "candidate_from", lambda kept, *rest: kept)
    monkeypatch.setattr(module, "candidate_arrays", lambda candidate: candidate)
    return done


def wider(tag: str) -> set[str]:
    """Tags whose law contains that of ``tag``."""
    return {other for other in catalogue.tags() if tag in catalogue.get(other).generalises}


class Memory(dict):
    def load(self, key):
        return self.get(key)

    def save(self, key, piece):
        self[key] = piece


def run(store=None, tags=None):
    told: list[float] = []
    ground = Ground(None, SimpleNamespace(cost=1000.0), None, None, None)  # type: ignore[arg-type]
    sweep = Sweep(ground, 1, store, "round1", lambda text, share: told.append(share))
    return *sweep.run(tags or catalogue.tags()), told


def test_every_tag_comes_back_and_the_leaders_are_followed_to_the_end(calls):
    best, every, told = run()
    assert [c.tag for c in best] == catalogue.tags()
    costs = {c.tag: c.cost for c in best if not c.note}
    assert min(costs, key=costs.get) == "contact-ageing"
    assert costs["contact-ageing"] == 100.0
    settled = {tag for what, tag in calls if what == "settle"}
    assert set(FINAL) <= settled
    # and two of those that the leader may be taken for, however far from it they seem
    assert len(settled - set(FINAL)) == LIKE
    assert settled - set(FINAL) <= set(catalogue.alike("contact-ageing")) | wider("contact-ageing")
    followed = {tag for what, tag in calls if what.startswith("refine")}
    like = {tag for tag in catalogue.tags() if tag in catalogue.alike("contact-ageing")}
    assert like <= followed  # what the leader may be taken for, whatever its own score promised
    assert len(followed - like) <= PROMISING + EXPLAINING
    assert all(c.note == "not refitted" for c in best if c.tag not in followed)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(SWEPT)  # the comparison of what may get a name is still to come
    assert len({(c.tag, *c.form.values()) for c in every}) == len(every)


def test_where_nothing_describes_the_data_everything_is_begun_far_from_an_amplitude_of_zero(calls):
    REST[0] = MUCH
    best, every, told = run()
    begun = [tag for what, tag in calls if what == "afar"]
    settled = [tag for what, tag in calls if what == "settle"]
    assert sorted(begun) == sorted(set(catalogue.tags()) - set(settled[: settled.index("sensor-gain")]))
    # what leads then is followed to the end, and only that
    assert set(settled[settled.index("sensor-gain") :]) == {"sensor-gain", "tilt"}
    costs = {c.tag: c.cost for c in best if not c.note}
    assert costs["sensor-gain"] == 50.0
    assert costs["adhesion"] == 990.0
    assert told == sorted(told)
    assert told[-1] == pytest.approx(SWEPT)
    assert len({(c.tag, *c.form.values()) for c in every}) == len(every)


def test_what_was_fitted_to_the_end_but_not_followed_is_begun_afar_too(calls, monkeypatch):
    """Where no effect takes 5 % off, those nearest to it are not followed; the right one may be among them."""
    REST[0] = MUCH

    def refine(candidate, data, floor, train, evaluations):
        cost = 955.0 + catalogue.tags().index(candidate.tag) if candidate.tag not in AFAR else 951.0
        return replace(invented(candidate.effect, cost, candidate.promise), score=candidate.score)

    monkeypatch.setattr(module, "refine", refine)
    monkeypatch.setitem(FINAL, "contact-ageing", 960.0)
    monkeypatch.setitem(FINAL, "wear", 961.0)
    best, _, _ = run()
    assert ("settle", "sensor-gain") in calls[: calls.index(("afar", "sensor-gain"))]
    assert next(c.cost for c in best if c.tag == "sensor-gain") == AFAR["sensor-gain"]


def test_where_something_describes_the_data_nothing_is_begun_afar(calls):
    run()
    assert "afar" not in {what for what, _ in calls}


def test_other_forms_are_tried_for_those_that_lead(calls):
    _, every, _ = run()
    tried = [tuple(c.form.values()) for c in every if c.tag == "wear"]
    assert len(tried) == len(forms_of("wear")) > 1
    assert sum(1 for what, tag in calls if (what, tag) == ("score", "wear")) == len(forms_of("wear"))


def test_finished_pieces_are_not_done_again(calls):
    store = Memory()
    first = run(store)[0]
    count = len(calls)
    assert count == len(store)
    again = run(store)[0]
    assert len(calls) == count
    assert [(c.tag, c.cost) for c in again] == [(c.tag, c.cost) for c in first]
    lost = next(key for key in store if "settle" in key)
    del store[lost]
    run(store)
    assert len(calls) == count + 1


def test_what_the_leader_may_be_taken_for_is_tried_in_its_two_most_promising_forms(calls):
    _, every, _ = run(tags=["wear", "position-dependent-friction"])
    assert "position-dependent-friction" in catalogue.alike("wear")
    forms = [c for c in every if c.tag == "position-dependent-friction" and not c.note]
    assert len(forms) == len(forms_of("position-dependent-friction")) == FORMS
    assert calls.count(("settle", "position-dependent-friction")) == len(forms)


NAMED = "position-dependent-friction"


def compared(calls, costs, store=None, settled=(), told=None):
    """What `rivals` does to everything fitted, with these costs before it; the rest was scored only."""

    def known(effect):
        made = invented(effect, costs.get(effect.tag, 1000.0), 0.5, "" if effect.tag in costs else "not refitted")
        return replace(made, settled=effect.tag in settled)

    every = [known(form) for tag in catalogue.tags() for form in forms_of(tag)]
    ground = Ground(None, SimpleNamespace(cost=1000.0), None, None, None)
    told = [] if told is None else told
    sweep = Sweep(ground, 1, store, "round1", lambda text, share: told.append(share))
    calls.clear()
    after = sweep.rivals(next(c for c in every if c.tag == NAMED), every)
    assert {(c.tag, *c.form.values()) for c in after} == {(c.tag, *c.form.values()) for c in every}
    return {c.tag: c for c in best_forms(catalogue.tags(), after)}


def test_what_is_to_be_named_is_compared_with_what_it_may_be_taken_for(calls):
    """Also where it is not the cheapest: all that was not refitted is, and the near ones are followed to the end."""
    like = set(catalogue.alike(NAMED)) | wider(NAMED)
    assert "wear" in like
    told: list[float] = []
    after = compared(calls, {NAMED: 800.0}, told=told)
    assert told == sorted(told)
    assert told[0] > SWEPT
    assert told[-1] == pytest.approx(1.0)
    assert {tag for what, tag in calls if what == f"refine {MORE}"} == like
    assert not any(after[tag].note for tag in like)
    assert {tag for what, tag in calls if what == "settle"} == like | {NAMED}  # 900 is near 800, and 150 is less
    compared(calls, {NAMED: 600.0})
    assert {tag for what, tag in calls if what == "settle"} == (like & set(FINAL)) | {NAMED}  # 900 is far from 600


def test_effects_near_what_is_to_be_named_are_on_equal_terms(calls):
    """What got a few steps only goes on as well, and what arrived does not go on again."""
    costs = dict.fromkeys(catalogue.alike(NAMED), 410.0) | {NAMED: 400.0, "curvature": 300.0}
    compared(calls, costs)
    assert {tag for what, tag in calls} == set(costs) - {"curvature"}
    assert {what for what, _ in calls} == {"settle"}
    compared(calls, costs, settled=(NAMED,))
    assert ("settle", NAMED) not in calls


def test_a_comparison_goes_on_from_what_was_kept_and_a_failure_takes_no_place(calls, monkeypatch):
    store = Memory()
    first = compared(calls, {NAMED: 800.0}, store)
    assert {tag: c.cost for tag, c in compared(calls, {NAMED: 800.0}, store).items()} == {
        tag: c.cost for tag, c in first.items()
    }
    assert calls == []
    store["round1-settle-wear-friction-linear"] = "of the sweep"  # which began elsewhere
    compared(calls, {NAMED: 800.0}, store)
    failing = lambda candidate, *rest: replace(candidate, note="the solver failed")  # noqa: E731
    monkeypatch.setattr(module, "settle", failing)
    after = compared(calls, {NAMED: 800.0})
    assert after["wear"].cost == 150.0
    assert after["wear"].note == ""


def test_where_nothing_promised_leads_all_others_get_a_few_steps(calls, monkeypatch):
    """An effect that promised least is found by refitting it, and no more go on than otherwise."""
    hidden = min(catalogue.tags(), key=lambda tag: (tag in FINAL, -catalogue.tags().index(tag)))

    def refine(candidate, data, floor, train, evaluations):
        calls.append((f"refine {evaluations}", candidate.tag))
        cost = 700.0 if candidate.tag == hidden else 950.0 + catalogue.tags().index(candidate.tag)
        return replace(invented(candidate.effect, cost, candidate.promise), score=candidate.score)

    monkeypatch.setattr(module, "refine", refine)
    monkeypatch.setattr(module, "settle", lambda candidate, *rest: replace(candidate, train=described()))
    best, _, told = run()
    assert {tag for what, tag in calls if what == f"refine {FEW}"} == set(catalogue.tags())
    assert min(best, key=lambda c: c.cost).tag == hidden
    assert not any(c.note for c in best)
    own = {hidden} | set(catalogue.alike(hidden)) | wider(hidden)
    more = {tag for what, tag in calls if what == f"refine {MORE}"}
    assert hidden in more
    assert len(more - own) < PROMISING + EXPLAINING
    assert told == sorted(told)
