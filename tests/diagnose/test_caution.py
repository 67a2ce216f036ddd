"""What stands beside a verdict, so that it is not believed further than it goes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.diagnose.caution import cautions
from stickslip.diagnose.heldout import HeldOut
from stickslip.diagnose.thresholds import Thresholds
from stickslip.diagnose.verdict import finished, nothing
from stickslip.effects import catalogue
from stickslip.fit.parameters import effect_parameters

UNFITTED = SimpleNamespace(fit=None)


def said(verdict, asked=(), last=UNFITTED, **more):
    return cautions(SimpleNamespace(verdict=verdict, rounds=(), ladder=(last,)), asked, **more)


def test_complete_says_that_nothing_was_tried_and_by_which_limits():
    (line,) = said(finished([]), limits=Thresholds(complete={"creep": 1.7, "slip": 2.5}))
    assert "No effect of the catalogue was tried" in line
    assert "creep 1.7, slip 2.5" in line
    assert "not excluded" in line
    (line,) = said(finished([]), ["wear", "tilt"])
    assert "The candidates wear, tilt were not tried" in line
    assert "--add wear" in line


def test_complete_after_a_round_does_not_say_that_nothing_was_tried():
    tried = SimpleNamespace(verdict=finished([]), rounds=(SimpleNamespace(candidates=(1, 2, 3)),))
    (line,) = cautions(tried, ["wear"])
    assert line.startswith("Effects were tried")
    assert "not tried" not in line


@pytest.mark.parametrize("tag", catalogue.tags())
def test_a_name_comes_with_what_it_may_be_taken_for(tag):
    first, *checks = said(finished([tag]))
    assert "a suspicion, not a finding" in first
    known = catalogue.alike(tag)
    assert len(checks) == len(known)
    for (other, what), line in zip(known.items(), checks, strict=True):
        assert line.startswith(f"{tag} may be taken for {other}")
        assert what in line


@pytest.mark.parametrize(
    ("value", "std", "doubted"), [(0.03, 0.005, True), (0.012, 0.005, False), (0.009, 0.001, False)]
)
def test_a_value_that_a_machine_hardly_has_is_doubted(value, std, doubted):
    free = effect_parameters(catalogue.make("adhesion"))
    fit = SimpleNamespace(
        free=free, values={"adhesion.attraction": value}, std=lambda: {"adhesion.attraction": std}
    )  # fmt: skip
    lines = [line for line in said(finished(["adhesion"]), last=SimpleNamespace(fit=fit)) if "usually" in line]
    assert len(lines) == doubted
    if doubted:
        assert lines[0].startswith("adhesion.attraction is 0.03, usually 0 ... 0.01: ")
    # of an effect that is not named nothing is said
    assert not any("usually" in line for line in said(finished(["tilt"]), last=SimpleNamespace(fit=fit)))


def a_round(**found):
    """Effects with their cost, score on unseen cycles, and what they fail."""

    def judged(tag, cost, score, *failures):
        effect = catalogue.make(tag)
        held = HeldOut(score**0.5, score, {}, score * np.linspace(0.9, 1.1, 8))
        candidate = SimpleNamespace(tag=tag, effect=effect, held=held)
        return SimpleNamespace(
            cost=cost, candidate=candidate, failures=failures, passed=not failures, plausible="border" not in failures
        )  # fmt: skip

    return SimpleNamespace(judged=[judged(tag.replace("_", "-"), *rest) for tag, rest in found.items()])


def better(effects, *rounds):
    found = SimpleNamespace(verdict=finished(effects), rounds=rounds, ladder=(UNFITTED,))
    return [line for line in cautions(found) if "described better" in line]


def test_what_describes_the_fitted_cycles_better_is_said():
    first = a_round(
        wear=(900.0, 1.0), tilt=(800.0, 2.0, "unseen"), viscous_drag=(700.0, 2.0, "unseen"),
        adhesion=(600.0, 2.0, "border"), curvature=(650.0, 0.9, "too little"), direct_effect=(950.0, 2.0, "unseen"),
    )  # fmt: skip
    later = a_round(tilt=(500.0, 0.9), direct_effect=(550.0, 1.9))  # wear is in the model by then
    (line,) = better(["wear"], first, later)
    assert "wear is named with a cost of 900" in line
    assert "by viscous-drag (700), tilt (800), the unseen ones worse" in line
    # not what is itself named, nor of the cheapest
    (line,) = better(["wear", "tilt"], first, later)
    assert "by viscous-drag (700), the unseen" in line
    # one that took another's place in the end was chosen in no round
    assert better(["direct-effect"], first, later) == []


def test_a_law_that_contains_the_one_named_is_no_better():
    assert "contact-ageing" in catalogue.get("rate-and-state").generalises
    assert better(["contact-ageing"], a_round(contact_ageing=(90.0, 1.0), rate_and_state=(89.0, 1.1))) == []


def test_where_nothing_is_named_nothing_is_cautioned_against():
    rung = SimpleNamespace(train=SimpleNamespace(by_phase={"creep": 9.0}, alike={}, total=9.0), held=None)
    assert said(nothing([], [], rung)) == []
