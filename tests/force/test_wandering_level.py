"""Friction that wanders along the slip path, in motions of the own solver: its level is part of the base fit."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.data.segment import segment
from stickslip.effects import make
from stickslip.inference.diagnose.prepare import prepare
from stickslip.inference.diagnose.wandering_level import level_of
from stickslip.inference.force import fit as fitting
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit_arrays import fit_arrays, fit_of
from stickslip.inference.force.level_within_events import _states
from stickslip.inference.force.signatures import Explained

from .counted_motions import moved, read
from .solver_motion import STRENGTH

SIZE, LENGTH = 0.01, 3e-4


def courses(size, of="both"):
    """Two draws of a level along the slip path."""
    return [make("wandering-friction", size=size, length=LENGTH, draw=i, along="slip", of=of) for i in range(2)]


def wanders(size, of="both"):
    """Two runs whose friction wanders along the slip path."""
    effects = courses(size, of)
    return read([moved(1e-4, 8.0, 1e-4, effects[:1]), moved(2e-4, 4.0, 1e-4, effects[1:])], 5)


@pytest.fixture(scope="module")
def prepared():
    campaign = wanders(SIZE)
    return prepare(campaign.description, campaign.traces, [segment(t) for t in campaign.traces])


def gain(base, tag):
    (found,) = try_effect(base, Explained(base), tag, [{}])
    return base.cost - found.fit.cost


@pytest.mark.slow
def test_the_level_is_found_and_a_wave_that_is_not_there_gains_little(prepared, monkeypatch):
    base = fitting.fit_base(prepared.problem, prepared.start)
    size = base.scatter.named()
    assert base.scatter.follows.coordinate == "slip path"
    assert 0.3 < size["level"] / SIZE < 2.0 and 0.3 < size["length"] / LENGTH < 3.0  # of one draw, ten lengths long
    assert size["strength"] < 0.03 * size["level"]
    level = level_of(base)
    assert level.form == {"along": "slip"} and level.gain > 500.0
    assert (level.size, level.length) == (size["level"], size["length"])
    assert gain(base, "velocity-weakening") < 30.0
    assert np.std(base.problem.beyond) > 1e-6 * base.strength
    assert not fitting.independent(base).problem.beyond.any()
    assert fit_of(prepared.problem.with_composition(base.problem.composition), fit_arrays(base)).cost == base.cost
    with monkeypatch.context() as patch:
        patch.setattr(fitting, "FEWEST", 10**6)
        without = fitting.fit_base(prepared.problem, prepared.start)
    assert without.scatter.follows is None and level_of(without) is None
    assert without.cost - base.cost > 500.0
    assert gain(base, "position-dependent-friction") < 40.0 and gain(without, "position-dependent-friction") > 300.0


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.003, pytest.param(SIZE, marks=pytest.mark.long)])
def test_a_diagnosis_names_the_wander_and_nothing_else(size):
    found = wanders(size).diagnose(
        candidates=["position-dependent-friction", "wear", "velocity-weakening", "contact-ageing"], jobs=1
    )
    assert found.verdict["kind"] == "missing" and found.verdict["effects"] == ["wandering-friction"]
    assert found.verdict["forms"] == {"wandering-friction": {"along": "slip"}}


@pytest.mark.slow
@pytest.mark.parametrize("of", ["static", "sliding"])
def test_static_or_sliding_friction_alone_is_told_and_its_course_is_found(of):
    campaign = wanders(SIZE, of)
    given = prepare(campaign.description, campaign.traces, [segment(t) for t in campaign.traces])
    base = fitting.fit_base(given.problem, given.start)
    assert (base.scatter.follows.coordinate, base.scatter.follows.of) == ("slip path", of)
    assert level_of(base).form == {"along": "slip", "of": of}
    again = fit_of(given.problem.with_composition(base.problem.composition), fit_arrays(base))
    assert again.cost == base.cost and again.scatter.follows == base.scatter.follows
    after = _states(base.problem, base.point, base.forces, base.scatter, base.known)[:, 2]
    for run, effect in enumerate(courses(SIZE, of)):
        own = base.problem.event_run == run
        true = SIZE * np.asarray(effect.course(base.known.chain.end[own] / LENGTH))
        assert np.corrcoef(true, after[own])[0, 1] > 0.995
        # a share of the strength, which a record that begins with the contact loaded tells badly
        scale = np.polyfit(true, after[own], 1)[0] * base.strength / STRENGTH
        assert scale == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_way_back_tells_that_the_level_follows_the_place():
    """There and back over the same track: friction that wanders with the place is met again, in the other order."""
    effect = make("wandering-friction", size=SIZE, length=LENGTH, draw=2, along="place")
    campaign = read([moved(1e-4, 26.0, 1e-4, [effect], turn=13.0)], 5)
    given = prepare(campaign.description, campaign.traces, [segment(t) for t in campaign.traces])
    assert given.problem.along == ("time", "slip path", "place")
    base = fitting.fit_base(given.problem, given.start)
    assert base.scatter.follows.coordinate == "place" and base.scatter.follows.equally_likely == ()
    assert level_of(base).form == {"along": "place"}
