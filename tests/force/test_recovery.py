"""What the generator, an independent simulator, put into a campaign comes out of the fit along the motion."""

from __future__ import annotations

import pytest

from stickslip.blind.generator import Run
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit import fit
from stickslip.inference.force.signatures import Explained

from .conftest import made, seen

RUNS = (Run("v100", 1e-4, 4), Run("v200", 2e-4, 4), Run("v400", 4e-4, 4))
TRIED = ("contact-ageing", "wear", "direct-effect", "nonlinear-spring", "viscous-drag")


def truth(case):
    rig = case.truth["rig"]
    return {
        "weakening.drop": 1.0 - rig["mu_k"] / rig["mu_s"],
        "weakening.slip_distance": rig["slip_length"],
        "weakening.healing_time": rig["heal_time"],
        "rig.damping": rig["damping"],
        "rig.spring_stiffness": rig["spring_stiffness"],
    }


def assert_recovered(case, found):
    rig = case.truth["rig"]
    for name, value in truth(case).items():
        share = 0.05 if name == "weakening.healing_time" else 0.03
        assert found.values[name] == pytest.approx(value, rel=share), name
        std = found.std().get(name, 0.0)
        assert abs(found.values[name] - value) < 4.0 * std + 1e-6 * value, name
    assert found.strength == pytest.approx(rig["mu_s"] * sum(rig["loads"]), rel=0.01)


def test_a_fit_with_known_spring_finds_the_base(small):
    assert_recovered(small, fit(small.problem, small.point))


def test_a_fit_with_unknown_spring_finds_it(tmp_path):
    case = made(tmp_path / "case", 13, spring_known=False)
    found = fit(case.problem, case.point)
    assert "rig.spring_stiffness" in {f.name for f in found.free}
    assert_recovered(case, found)


@pytest.mark.slow
def test_a_record_that_begins_under_load_finds_what_it_can(begun):
    """The strength is not known there, for nothing says what the spring held at first: drop and strength make one."""
    found, true = fit(begun.problem, begun.point), truth(begun)
    for name in ("weakening.slip_distance", "rig.damping", "rig.spring_stiffness"):
        assert found.values[name] == pytest.approx(true[name], rel=0.03), name
    assert found.values["weakening.healing_time"] == pytest.approx(true["weakening.healing_time"], rel=0.06)
    rig = begun.truth["rig"]
    lost = true["weakening.drop"] * rig["mu_s"] * sum(rig["loads"])
    assert found.values["weakening.drop"] * found.strength == pytest.approx(lost, rel=0.02)


def gains(case):
    base = fit(case.problem, case.point)
    explained = Explained(base)
    tried = {tag: try_effect(base, explained, tag, [{}])[0] for tag in TRIED}
    return {tag: base.cost - c.fit.cost for tag, c in tried.items() if c.fit is not None}, tried


@pytest.mark.slow
@pytest.mark.parametrize("hidden", ["contact-ageing logarithm", pytest.param("wear linear", marks=pytest.mark.long)])
def test_what_is_hidden_gains_most(tmp_path, hidden):
    tag, form = hidden.split()
    gain, tried = gains(made(tmp_path / "case", 11, [seen(tag, form, 10.0)], runs=RUNS, spring_known=True))
    others = max(g for other, g in gain.items() if other != tag)
    assert gain[tag] > 40.0
    assert gain[tag] > 3.0 * max(others, 1.0)
    assert tried[tag].fit.values[tried[tag].name] > 0.0
