"""Spring over mass from the slips themselves: a wrong entry is found with its size, a right one is left alone."""

from __future__ import annotations

from dataclasses import replace

import pytest

from stickslip.inference.diagnose.decide import Judge
from stickslip.inference.diagnose.search import Rung, Search
from stickslip.inference.diagnose.search_round import Round
from stickslip.inference.diagnose.work import Work
from stickslip.inference.force.candidates import with_start
from stickslip.inference.force.fit import fit
from stickslip.inference.force.stated_spring import (
    SPRING,
    slips_finding,
    spring_freed,
    with_free_spring,
    within_knowledge,
)
from stickslip.physics.effects.viscous_drag import ViscousDrag
from stickslip.system.units import shown

from .conftest import Case


def stated(case: Case, factor: float):
    """The base fitted with the stiffness in the file wrong by a factor."""
    composition = case.problem.composition
    fixed = {**composition.fixed, SPRING: factor * composition.fixed[SPRING]}
    return fit(case.problem.with_composition(replace(composition, fixed=fixed)), case.point)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.05, 0.9])
def test_a_stiffness_that_is_wrong_is_found_with_the_true_one(small, factor):
    base = stated(small, factor)
    freed = spring_freed(base)
    assert freed is not None
    true = small.truth["rig"]["spring_stiffness"]
    assert freed.values[SPRING] == pytest.approx(true, rel=5e-3)
    assert Judge(base, 40).beside(freed, 1).seen
    finding = slips_finding(base, freed)
    assert finding.stops
    assert finding.stated == pytest.approx(factor * true, rel=1e-6)
    weighs = shown(freed.values["rig.mass"] * finding.stated / finding.value, "kg", 3)
    assert f"a block of {weighs} on the spring" in finding.sentence


def test_a_stiffness_that_is_right_is_left_alone(small):
    base = stated(small, 1.0)
    freed = spring_freed(base)
    assert freed is not None
    assert abs(freed.values[SPRING] - base.values[SPRING]) < 4.0 * freed.std()[SPRING] + 1e-3 * base.values[SPRING]
    assert not Judge(base, 40).beside(freed, 1).seen


def test_a_spring_that_is_free_already_has_no_rival(begun):
    assert spring_freed(fit(begun.problem, begun.point, rounds=1)) is None


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "near"), [(1.003, True), (0.996, True), (1.03, False)])
def test_what_springs_are_not_known_better_than_is_no_wrong_entry(small, factor, near):
    base = stated(small, factor)
    freed = spring_freed(base)
    assert freed is not None
    assert within_knowledge(base, freed) == near


def test_then_the_last_round_begins_anew_with_the_spring_that_the_slips_want(small):
    base = stated(small, 1.003)
    freed = spring_freed(base)
    assert freed is not None
    ladder = [Rung.of(("static", "inertia"), "inertia", base)]
    search = Search(base, ladder, Work())
    search.rounds.append(Round(base, (), (), ()))
    text = search.free_spring(freed)
    true = small.truth["rig"]["spring_stiffness"]
    assert search.base.values[SPRING] == pytest.approx(true, rel=1e-3)
    assert shown(1.003 * true, "N/m", 4) in text and shown(search.base.values[SPRING], "N/m", 4) in text
    assert search.rounds == [] and search.ladder[-1].fit is search.base
    assert spring_freed(search.base) is None  # which is said once


def test_a_free_spring_stands_before_effects_whenever_it_was_freed(small):
    """So that a model is the same that is built again from what is kept of it."""
    drag = ViscousDrag()
    early = with_start(with_free_spring(small.problem), drag, {"drag": 0.01})[0]
    late = with_free_spring(with_start(small.problem, drag, {"drag": 0.01})[0])
    for problem in (early, late):
        assert SPRING not in problem.composition.fixed
    names = [f.name for f in early.composition.shared]
    assert names == [f.name for f in late.composition.shared]
    assert all(name.startswith("viscous-drag.") for name in names[names.index(SPRING) + 1 :])
