"""Searches: begun on the floor of the valley, they end where the first look promises, or lower."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.errors import FitError
from stickslip.inference.diagnose.decide import Judge
from stickslip.inference.force import candidates
from stickslip.inference.force.candidates import Candidate, Start, _at, _columns, from_end, try_effect, with_start
from stickslip.inference.force.descent import SETTLED, descend
from stickslip.inference.force.fit import fit, refit
from stickslip.inference.force.linearised import FARTHEST, Linearised
from stickslip.inference.force.signatures import Explained
from stickslip.inference.force.whitening import Whitening
from stickslip.physics.effects import catalogue

from .conftest import made, seen


@pytest.fixture(scope="module")
def base(begun):
    """With a stretched spring at the start and its stiffness unknown, the valley is as flat as it gets."""
    return fit(begun.problem, begun.point)


def objective(base, problem, point) -> float:
    white = Whitening(base.scatter.sizes, base.known)
    slopes = problem.evaluate(point)
    return Linearised(problem, point, slopes, base.scatter, white).objective(point, slopes)


@pytest.mark.slow
@pytest.mark.parametrize("tag, size", [("tilt", 1e-3), ("inertia", 2e-3)])
def test_a_model_that_makes_room_stays_near_its_optimum(base, tag, size):
    """To first order what is left of an effect is what the model's own parameters cannot take."""
    cls = catalogue.get(tag)
    effect = cls(**next(iter(catalogue.forms(cls))))
    null = float(getattr(effect, effect.amplitude))
    (column,) = _columns(base, effect, [{}])
    left = Explained(base).orthogonal(size * column[:, None])
    point, share = base.yielding(size * column)
    assert share == 1.0
    problem, free = with_start(base.problem, effect, {effect.amplitude: null + size})
    carried = problem.carried_by(base.problem.carrier)
    room, none = (objective(base, carried, _at(problem, free, Start({}, p))) for p in (point, base.point))
    start = objective(base, base.problem, base.point)
    assert room - start < 0.1 * (none - start)
    assert none - start > 10.0 * float((left**2).sum())


def test_making_room_takes_no_more_of_the_strength_than_a_step_may(small):
    found = fit(small.problem, small.point)
    kept = []
    for part in (0.01, 0.5, 1.0):  # of the force that the contact holds
        point, share = found.yielding(-part * found.forces.held)
        kept.append(point.weights.sum() / found.point.weights.sum())
        assert kept[-1] == pytest.approx(1.0 - share * part, abs=1e-3)
    assert kept[-1] == pytest.approx(np.exp(-FARTHEST), rel=1e-6)
    nothing = replace(found.point, weights=0.0 * found.point.weights)
    with pytest.raises(FitError, match="no finite force"):
        refit(found.problem, nothing, found)


def test_what_was_tried_takes_little_memory(small):
    """A diagnosis keeps all candidates: what is large and can be found again is not kept with them."""
    found = fit(small.problem, small.point)
    (tried,) = try_effect(found, Explained(found), "viscous-drag", [{}])
    assert "_system" in vars(found) and "_system" not in vars(tried.fit)
    judged = Judge(found, 1)(tried)
    assert judged.candidate.fit is tried.fit and "_system" not in vars(tried.fit)
    assert judged.std == pytest.approx(tried.fit.std()[tried.name])


@pytest.mark.slow
def test_an_effect_is_begun_where_it_stood(base):
    """In a model with another effect more, whose parameters go between; also where it could not be fitted by itself."""
    names, stood = ("tilt", "viscous-drag"), base
    first = {tag: next(iter(catalogue.forms(catalogue.get(tag)))) for tag in names}
    for tag in names:
        (found,) = try_effect(stood, Explained(stood), tag, [first[tag]])
        stood = found.fit
    (drag,) = try_effect(base, Explained(base), "viscous-drag", [first["viscous-drag"]])
    again = from_end(drag.fit, Candidate("tilt", first["tilt"], 0.0, None), stood)
    assert {e.tag for e in again.fit.problem.composition.effects} == set(names)
    assert again.fit.cost < stood.cost + 3.0
    assert from_end(drag.fit, again, stood).fit.cost <= again.fit.cost


@pytest.mark.slow
@pytest.mark.parametrize("tag", ["tilt", "inertia", "sensor-gain"])
def test_a_refit_ends_no_higher_than_the_first_look_promises(base, tag):
    cls = catalogue.get(tag)
    for found in try_effect(base, Explained(base), tag, list(catalogue.forms(cls))):
        assert base.cost - found.fit.cost > 0.7 * found.promise - 2.0


@pytest.mark.slow
@pytest.mark.parametrize("tag", ["tilt", "inertia", "sensor-gain"])
def test_a_refit_ends_no_higher_than_it_began(base, tag):
    """What is not there gains nothing and costs nothing: a tilt once ended 43 above the model without it."""
    cls = catalogue.get(tag)
    for found in try_effect(base, Explained(base), tag, list(catalogue.forms(cls))):
        assert found.promise < 9.0
        assert -SETTLED < base.cost - found.fit.cost < 9.0 + found.promise


@pytest.mark.slow
def test_a_search_comes_back_from_the_side_of_the_valley(base):
    """Off by a tenth of the strength that a slip loses the cost is thousands higher; all of it is found again."""
    names = [f.name for f in base.free]
    z = base.point.z.copy()
    z[names.index("weakening.drop")] += 0.1
    point = replace(base.point, z=z)
    slopes = base.problem.evaluate(point)
    _, _, fallen, count, _ = descend(base.problem, point, slopes, base.scatter, base.known, 30)
    start = objective(base, base.problem, point) - objective(base, base.problem, base.point)
    assert start > 1e4
    assert fallen > start - 3.0
    assert count < 30


@pytest.mark.slow
def test_derivatives_that_no_covariance_holds_end_a_search_in_words(base):
    """Of a candidate, which is then left out: one of a record with counts of a micrometre once ended the diagnosis."""
    bad = replace(base.slopes, local=1e200 * base.slopes.local)
    with pytest.raises(FitError, match="too large"), np.errstate(all="ignore"):
        descend(base.problem, base.point, bad, base.scatter, base.known, 4)


@pytest.mark.slow
def test_what_gains_nothing_small_is_found_from_a_large_amplitude(tmp_path, monkeypatch):
    """The base has taken its part of a sensor that is two thirds of a millisecond late; a small one makes it worse."""
    case = made(tmp_path / "case", 11, [seen("sensor-low-pass", "first order", 10.0)], spring_known=True)
    base = fit(case.problem, case.point)
    explained = Explained(base)

    def gain() -> float:
        (found,) = try_effect(base, explained, "sensor-low-pass", [{}])
        assert found.promise < 1.0
        return base.cost - found.fit.cost

    assert gain() > 50.0
    monkeypatch.setattr(candidates, "FAR", 1e-9)
    assert gain() < 5.0
