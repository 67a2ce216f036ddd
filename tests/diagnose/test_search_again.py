"""An effect that was named is tried again with those that came after it: kept, exchanged or taken out."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stickslip.inference.diagnose import search as module
from stickslip.inference.diagnose.decide import Compared, Judged, named
from stickslip.inference.diagnose.search_round import Round
from stickslip.inference.force.candidates import Candidate
from stickslip.inference.force.composition import Composition
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.wear import Wear

EVENTS = 30


def judged(tag: str, each: float) -> Judged:
    """An effect that predicts every unseen event better by ``each``."""
    fit: Any = SimpleNamespace(free=range(6), tag=tag)
    return Judged(
        fit, EVENTS * each, 1e-9, np.full(EVENTS, each), np.ones(EVENTS), Candidate(tag, {}, 1.0, fit), 0.01, 0.001
    )  # fmt: skip


class Model(SimpleNamespace):
    """A stand-in for a fit: the tags of its effects, all with one amplitude."""

    def __init__(self, tags: tuple[str, ...], amplitude: float = 0.01, deviation: float = 0.001) -> None:
        composition = SimpleNamespace(shared=(), phases=(), without=self._without)
        problem = SimpleNamespace(composition=composition, with_composition=lambda made: made)
        point = SimpleNamespace(z=np.zeros(0), phases=np.zeros((0, 1)))
        super().__init__(
            tags=tags, problem=problem, point=point, scatter=SimpleNamespace(unbound=dict), dropped=None,
            values=defaultdict(lambda: amplitude), std=lambda: defaultdict(lambda: deviation),
        )  # fmt: skip

    def _without(self, tag: str) -> Model:
        return Model(tuple(t for t in self.tags if t != tag))


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A search whose rounds are looked up by the model they stand on and what is left to try."""
    table: dict[tuple[str, ...], dict[str, float]] = {}

    def one_round(base: Any, tags: Sequence[str], *_: Any) -> Round:
        found = [judged(t, each) for t, each in table[base.tags].items() if t in tags]
        return Round(base, tuple(found), tuple(j.candidate for j in found), tuple(named(found)))

    def replace(made: Any, **changes: Any) -> Any:
        return dataclasses.replace(made, **changes) if isinstance(made, Candidate | Judged | module.Work) else made

    monkeypatch.setattr(module, "one_round", one_round)
    monkeypatch.setattr(module, "replace", replace)
    monkeypatch.setattr(module, "fit", lambda problem, *_, **__: problem)
    worse: list[tuple[str, ...]] = []
    monkeypatch.setattr(module, "predicts_better", lambda before, after: after.tags not in worse)
    monkeypatch.setattr(module, "settled", lambda base, c, *_: Model((*base.tags, c.tag)))
    monkeypatch.setattr(
        module.Rung,
        "of",
        lambda model, added, fit, removed=None: module.Rung(model, added, np.zeros(0), None, fit, removed),
    )
    ladder = [module.Rung.of(("static", "inertia"), "inertia", Model(()))]
    made = module.Search(Model(()), ladder, module.Work())
    made.table, made.worse = table, worse
    return made


def grown(search: Any, tags: Sequence[str]) -> None:
    while (done := search.round([t for t in tags if t not in search.named and t not in search.gone])).close:
        search.add(done)


def test_what_is_still_needed_stays(search):
    search.table |= {
        (): {"wear": 20.0, "tilt": 10.0}, ("wear",): {"tilt": 9.0}, ("tilt",): {"wear": 19.0}, ("wear", "tilt"): {},
    }  # fmt: skip
    grown(search, ["wear", "tilt"])
    assert list(search.named) == ["wear", "tilt"]
    assert search.ladder[-1].model == ("static", "inertia", "wear", "tilt")
    assert search.base.tags == ("wear", "tilt")


def test_what_stood_in_for_another_is_taken_out(search):
    search.table |= {
        (): {"wear": 20.0, "tilt": 15.0}, ("wear",): {"tilt": 9.0}, ("tilt",): {}, ("wear", "tilt"): {},
    }  # fmt: skip
    grown(search, ["wear", "tilt"])
    assert list(search.named) == ["tilt"]
    assert search.ladder[-1].removed == "wear"
    assert search.ladder[-1].model == ("static", "inertia", "tilt")


def test_what_another_replaces_is_exchanged(search):
    search.table |= {
        (): {"sensor-gain": 20.0, "wear": 18.0, "tilt": 10.0}, ("sensor-gain",): {"tilt": 9.0},
        ("tilt",): {"sensor-gain": 5.0, "wear": 25.0}, ("tilt", "wear"): {},
    }  # fmt: skip
    grown(search, ["sensor-gain", "wear", "tilt"])
    assert list(search.named) == ["wear", "tilt"]
    assert (search.ladder[-1].added, search.ladder[-1].removed) == ("wear", "sensor-gain")
    assert set(search.ladder[-1].model) == {"static", "inertia", "tilt", "wear"}


def test_what_takes_the_place_of_another_and_predicts_worse_is_not_kept(search):
    search.table |= {
        (): {"wear": 20.0, "tilt": 15.0}, ("wear",): {"tilt": 9.0, "sensor-gain": 8.0}, ("tilt",): {},
        ("sensor-gain",): {"wear": 19.0}, ("wear", "sensor-gain"): {},
    }  # fmt: skip
    search.worse.append(("tilt",))
    grown(search, ["wear", "tilt", "sensor-gain"])
    assert list(search.named) == ["wear", "sensor-gain"]
    assert [r.model[2:] for r in search.ladder] == [(), ("wear",), ("wear", "sensor-gain")]
    assert search.gone == {"tilt"}
    assert len(search.rounds) == 3  # what the second round tried besides is not tried again


def test_an_effect_that_predicts_worse_once_it_has_settled_is_not_kept(search):
    search.table |= {(): {"wear": 20.0}}
    search.worse.append(("wear",))
    grown(search, ["wear"])
    assert not search.named
    assert not search.base.tags
    assert {c.tag: c.note for c in search.rounds[-1].candidates} == {"wear": module.TAKEN_OUT}


def test_an_effect_that_settles_at_its_bound_is_not_kept_and_stops_a_name(search, monkeypatch):
    """Tilt is seen too, but the wear that is out of range predicts better than it."""
    search.table |= {(): {"wear": 20.0, "tilt": 10.0}}
    monkeypatch.setattr(module, "settled", lambda base, c, *_: Model((c.tag,), catalogue.amplitude(Wear).upper, 0.0))
    grown(search, ["wear", "tilt"])
    assert not search.named and not search.base.tags
    done = search.rounds[-1]
    assert done.beyond.tag == "wear" and done.beyond.amplitude == catalogue.amplitude(Wear).upper
    assert len(search.rounds) == 1 and len(search.ladder) == 1


def test_but_what_predicts_as_well_inside_its_range_is_named_instead(search, monkeypatch):
    search.table |= {(): {"wear": 20.0, "tilt": 19.99}, ("tilt",): {}}
    at_bound = Model(("wear",), catalogue.amplitude(Wear).upper, 0.0)
    monkeypatch.setattr(module, "settled", lambda base, c, *_: at_bound if c.tag == "wear" else Model((c.tag,)))
    grown(search, ["wear", "tilt"])
    assert list(search.named) == ["tilt"] and search.gone == {"wear"}


def test_what_drives_an_earlier_effect_to_its_bound_is_not_kept(search, monkeypatch):
    """The wear is named, and goes to its bound once the tilt is there."""
    search.table |= {
        (): {"wear": 20.0, "tilt": 15.0}, ("wear",): {"tilt": 9.0}, ("tilt",): {"wear": 19.0}, ("wear", "tilt"): {},
    }  # fmt: skip

    def settled(base: Any, c: Candidate, *_: Any) -> Model:
        made = Model((*base.tags, c.tag))
        if c.tag == "tilt":
            made.values[f"wear.{Wear.amplitude}"] = catalogue.amplitude(Wear).upper
        return made

    monkeypatch.setattr(module, "settled", settled)
    grown(search, ["wear", "tilt"])
    assert list(search.named) == ["wear"] and search.gone == {"tilt"}
    assert search.base.tags == ("wear",) and len(search.ladder) == 2


@pytest.mark.parametrize("each", [0.5, -0.5])
def test_a_model_is_kept_by_the_likelihood_of_unseen_runs_alone(each, monkeypatch):
    """Where a sensor is undone the measured forces are others, and a larger residual may be less of an error."""
    before: Any = Model(())
    after: Any = Model(("sensor-low-pass",))
    found = Compared(after, 1.0, 1e-9, np.full(EVENTS, each), -np.ones(EVENTS))
    monkeypatch.setattr(module, "Judge", lambda base, tried: SimpleNamespace(beside=lambda *_, **__: found))
    assert module.predicts_better(before, after) is (each > 0.0)


def test_a_model_without_an_effect_has_none_of_its_parameters():
    free = tuple(SimpleNamespace(name=n) for n in ("rig.damping", "wear.drift", "tilt.slope"))
    effects: Any = (SimpleNamespace(tag="wear"), SimpleNamespace(tag="tilt"))
    made = Composition(0.1, np.ones(3), free, {}, effects).without("wear")  # type: ignore[arg-type]
    assert [f.name for f in made.free] == ["rig.damping", "tilt.slope"]
    assert [e.tag for e in made.effects] == ["tilt"]
