"""What stands beside a verdict, so that it is not believed further than it goes."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from stickslip.diagnose.caution import cautions
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


def judged(**costs):
    return SimpleNamespace(
        judged=[SimpleNamespace(cost=c, candidate=SimpleNamespace(tag=t.replace("_", "-"))) for t, c in costs.items()]
    )


def test_what_describes_the_fitted_cycles_better_is_said():
    first = judged(wear=900.0, tilt=800.0, viscous_drag=700.0, direct_effect=950.0)
    later = judged(tilt=500.0, direct_effect=550.0)  # wear is in the model by then
    rounds = (first, later)
    named = SimpleNamespace(verdict=finished(["wear"]), rounds=rounds, ladder=(UNFITTED,))
    (line,) = (line for line in cautions(named) if "named for what it does on unseen cycles" in line)
    assert "by viscous-drag (700), tilt (800); its cost is 900" in line
    assert "direct-effect (" not in line
    cheapest = SimpleNamespace(verdict=finished(["tilt"]), rounds=rounds, ladder=(UNFITTED,))
    assert not any("unseen cycles" in line for line in cautions(cheapest))
    # a law that contains the one named could be no worse
    wider = SimpleNamespace(
        verdict=finished(["contact-ageing"]), rounds=(judged(contact_ageing=90.0, rate_and_state=89.0),),
        ladder=(UNFITTED,),
    )  # fmt: skip
    assert "contact-ageing" in catalogue.get("rate-and-state").generalises
    assert not any("unseen cycles" in line for line in cautions(wider))


def test_where_nothing_is_named_nothing_is_cautioned_against():
    rung = SimpleNamespace(train=SimpleNamespace(by_phase={"creep": 9.0}, alike={}, total=9.0), held=None)
    assert said(nothing([], [], rung)) == []
