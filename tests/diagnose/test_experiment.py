"""The experiment that is proposed is the one in which two models differ most, in units of what can be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest

from stickslip.contact import power_law_bank
from stickslip.diagnose import experiment as proposals
from stickslip.diagnose.bench import prepared, until_slips
from stickslip.diagnose.experiment import TELLING, propose, recommend_among
from stickslip.diagnose.menu import LONGEST, MENU, Conditions, Experiment
from stickslip.diagnose.outcome import outcome
from stickslip.effects import catalogue
from stickslip.errors import SolveError
from stickslip.fit.composition import Composition
from stickslip.fit.parameters import Free, effect_parameters

VALUES = {
    "contact.strength": ("N", 0.26),
    "weakening.drop": ("1", 0.18),
    "weakening.slip_distance": ("m", 1.2e-6),
    "weakening.healing_time": ("s", 0.01),
    "rig.damping": ("N s/m", 10.0),
    "contact.u_max": ("m", 0.95e-6),
    "contact.p": ("1", 3.3),
    "contact.spread": ("1", 0.15),
}
CONDITIONS = Conditions((1e-4, 2e-4, 4e-4), 1 / 540.0, noise=1e-9, clock=3e-5)
HOLDS = tuple(e for e in MENU if e.hold)
PLAIN = Experiment("as measured")


class Optimum(NamedTuple):
    z: np.ndarray
    covariance: np.ndarray


@dataclass
class Model:
    """A rival: tag, composition, optimum."""

    tag: str
    composition: Composition
    fit: Any


def model(tag="base", std=0.0, effect=None, **changes):
    """The rig with some values changed, known to ``std`` on the search scale."""
    values = {name: changes.get(name.split(".")[1], v) for name, (_, v) in VALUES.items()}
    free = [Free(n, VALUES[n][0], "log", v, v, 1.0, v / 20, 20 * v) for n, v in values.items()]
    effects = () if effect is None else (effect,)
    if effect is not None:
        free += [f.starting(float(getattr(effect, f.name.split(".")[1]))) for f in effect_parameters(effect)]
    z = np.array([f.inward(f.start) for f in free])
    composition = Composition(0.0894, 4, 48, tuple(free), {"rig.spring_stiffness": 1000.0}, effects)
    return Model(tag, composition, Optimum(z, np.eye(z.size) * std**2))


def ageing():
    """An effect that a stick of a second hardly shows and one of 25 s does."""
    return aged("contact-ageing", rate=0.01, onset_time=3.0, first_age=1.0)


def aged(tag, **values):
    """The rig with ageing contacts, called ``tag``."""
    return model(tag, effect=catalogue.make("contact-ageing", **values))


def ran(experiment, pieces=None, wanted=3, **changes):
    """The third slip of an experiment with the base model."""
    found = model(**changes)
    made = prepared(found.composition, found.fit.z, CONDITIONS, experiment)
    run, slips = until_slips(made, pieces or [(1.0, CONDITIONS.velocity(experiment))], wanted)
    return outcome(run, slips, wanted - 1, CONDITIONS.period, None), made


def test_the_load_makes_caps_and_reach_of_the_contact_grow_as_a_power_law_does():
    found = model()
    plain, loaded = (prepared(found.composition, found.fit.z, CONDITIONS, Experiment("", load=x)) for x in (1.0, 2.0))
    wanted = power_law_bank(2 * 0.26, 0.95e-6 * 2 ** (1 / 3.3), 3.3, 0.15, contacts=4, n=48)
    np.testing.assert_allclose(loaded.bank.strength, wanted.strength, rtol=1e-9)
    np.testing.assert_allclose(loaded.bank.stiffness, wanted.stiffness, rtol=1e-9)
    assert float(plain.bank.total_strength) == pytest.approx(0.26)


def test_a_slip_is_measured_as_physics_has_it():
    found, made = ran(PLAIN)
    v = CONDITIONS.velocity(PLAIN)
    # in a steady series the block moves in a cycle as far as the load point
    assert found.size + found.creep == pytest.approx(v * found.recurrence, rel=0.02)
    stiffness = float(made.bank.total_stiffness) + 1000.0
    assert found.frequency == pytest.approx(np.sqrt(stiffness / 0.0894) / (2 * np.pi), rel=0.08)
    heavy, _ = ran(Experiment("", mass=1.5))
    assert heavy.frequency == pytest.approx(found.frequency / np.sqrt(1.5), rel=0.02)
    assert heavy.peak < 0.95 * found.peak
    loaded, _ = ran(Experiment("", load=2.0))
    assert loaded.size == pytest.approx(2 * found.size, rel=0.06)


def test_ageing_is_told_by_the_longest_hold():
    found = propose(ageing(), model(), CONDITIONS, draws=0)
    # sticks of 25 s, 10 s and 2 s; all others are shorter than those that were measured, or as long
    assert [p.name for p in found[:3]] == ["hold 25 s", "hold 10 s", "slow drive"]
    assert found[0].separation > 1.4 * found[1].separation > 1.4 * TELLING
    assert found[1].separation > 1.5 * found[2].separation
    assert {p.name for p in found} == {e.name for e in MENU}
    best = found[0]
    assert best.text.startswith("hold the drive for 25 s late in a stick (at 80 % of it): ")
    # what a hold of 25 s adds to the strength, 0.01 ln(1 + 25/3) of 0.26 N, comes as time on a spring of 1000 N/m
    first, second, _ = best.differences["recurrence"]
    late = 0.01 * np.log1p(25 / 3.0) * 0.26 / 1000.0 / 2e-4
    assert first - second == pytest.approx(late, rel=0.25)
    assert second == pytest.approx(ran(PLAIN)[0].recurrence + 25.0, abs=2e-3)
    turned = propose(model(), ageing(), CONDITIONS, draws=0, menu=HOLDS)[0]
    more, less = {"recurrence": ("later", "earlier"), "size": ("larger", "smaller")}[best.feature]
    assert f" {more} with contact-ageing than with base" in best.text
    assert f" {less} with base than with contact-ageing" in turned.text
    assert turned.separation == pytest.approx(best.separation)


def test_only_a_fresh_contact_tells_models_that_differ_in_its_age():
    """After the first slip both have forgotten how long the contact had been closed."""
    young, old = (aged(tag, rate=0.002, onset_time=0.03, first_age=age) for tag, age in (("young", 0.1), ("old", 1e3)))
    found = propose(young, old, CONDITIONS, draws=0)
    assert [p.name for p in found[:2]] == ["lift-off", "reversed start"]
    assert found[0].separation > TELLING
    assert max(p.separation for p in found[2:]) < TELLING
    assert found[0].text.startswith("lift the block off, set it down and pull: the first slip is ")
    assert "smaller with young than with old" in found[0].text
    # the growth of 0.26 N from one age at the slip, which comes after 1.3 s, to the other, as time on the spring
    first, second, _ = found[0].differences["recurrence"]
    grown = 0.002 * (np.log1p(1e3 / 0.03) - np.log1p((0.1 + 1.3) / 0.03))
    assert second - first == pytest.approx(grown * 0.26 / 1000.0 / 2e-4, rel=0.1)


def test_a_lift_off_starts_as_a_reversed_start_does_but_without_the_back_pull():
    same = [e for e in MENU if e.first]
    assert [e.name for e in same] == ["lift-off", "reversed start"]
    found = {p.name: p for p in propose(model(), model("other", drop=0.19), CONDITIONS, draws=0, menu=same)}
    virgin = ran(PLAIN, wanted=1)[0]
    assert found["lift-off"].differences["recurrence"].first == pytest.approx(virgin.recurrence, rel=1e-6)
    assert found["lift-off"].differences["size"].first == pytest.approx(virgin.size, rel=1e-6)
    assert found["reversed start"].differences["recurrence"].first > 2 * virgin.recurrence


def test_no_experiment_is_proposed_that_a_diagnosis_cannot_take_in():
    assert max(e.hold for e in MENU) == 25.0
    assert max(e.hold for e in MENU) + ran(PLAIN)[0].recurrence < LONGEST
    # 2 s at 25 um/s are 40 s at 1.2 um/s
    slow = CONDITIONS._replace(velocities=(5e-6, 2e-4))
    found = propose(ageing(), model(), slow, draws=0, menu=[MENU[0]])[0]
    assert found.separation == 0.0
    assert "a cycle would last 4" in found.text
    assert "no more than 30.7 s" in found.text


def test_equal_models_differ_in_nothing():
    assert all(p.separation == 0.0 for p in propose(model("a"), model("b"), CONDITIONS, draws=0, menu=MENU[:3]))


def test_what_the_fits_leave_open_does_not_count_and_neither_does_scatter():
    other = model("other", drop=0.19)
    menu = [PLAIN]
    sharp = propose(model(), other, CONDITIONS, draws=0, menu=menu)[0]
    rough = propose(model(), other, CONDITIONS, draws=0, menu=menu, factor=2.0)[0]
    # the slip's scatter is far above the sensor's noise
    assert sharp.differences["size"].floors == pytest.approx(2 * rough.differences["size"].floors, rel=0.01)
    wide = propose(model(std=0.05), model("other", std=0.05, drop=0.19), CONDITIONS, menu=menu)[0]
    assert wide.differences["size"].floors < 0.2 * sharp.differences["size"].floors


def test_sliding_instead_of_slipping_is_a_difference():
    # at 0.8 mm/s strength lost in a slip comes back where that takes 10 ms, but not where it takes 50 ms
    conditions = CONDITIONS._replace(velocities=(1e-4, 2e-4))
    quick, slow = model("quick healing"), model("slow healing", healing_time=0.05)
    fast = [e for e in MENU if e.name == "fast drive"]
    found = propose(quick, slow, conditions, draws=0, menu=fast)[0]
    assert found.separation == np.inf
    assert "slips with quick healing and slides steadily with slow healing" in found.text
    both = propose(slow, model("other", healing_time=0.06), conditions, draws=0, menu=fast)[0]
    assert both.separation == 0.0
    assert "slides steadily with both" in both.text


def test_a_model_that_fails_says_so(monkeypatch):
    def fail(*args):
        raise SolveError("the steps became too small")

    monkeypatch.setattr(proposals, "until_slips", fail)
    found = propose(model(), model("other"), CONDITIONS, draws=0, menu=[PLAIN])[0]
    assert found.separation == 0.0
    assert "base could not be simulated (the steps became too small)" in found.text


def test_the_recommendation_says_where_nothing_helps():
    best = recommend_among((ageing(), model()), CONDITIONS, draws=0, menu=HOLDS)
    assert best["separates"] == ["contact-ageing", "base"]
    assert [m["experiment"] for m in best["menu"]] == ["hold 25 s", "hold 10 s"]
    assert best["text"] == best["menu"][0]["text"]
    none = recommend_among((model("a"), model("b")), CONDITIONS, draws=0, menu=[PLAIN])
    assert none["text"].startswith("no experiment of the menu tells a from b")


def test_of_three_the_two_that_are_nearest_decide():
    three = [ageing(), model(), model("damped", damping=14.0)]
    told = []
    found = recommend_among(three, CONDITIONS, draws=0, progress=lambda text, share: told.append((text, share)))
    assert found["separates"] == ["contact-ageing", "base", "damped"]
    alone = {p.name: [p] for p in propose(three[0], three[1], CONDITIONS, draws=0)}
    for a, b in ((0, 2), (1, 2)):
        for p in propose(three[a], three[b], CONDITIONS, draws=0):
            alone[p.name].append(p)
    least = {name: min(p.separation for p in pairs) for name, pairs in alone.items()}
    best = max(least, key=lambda name: least[name])
    assert found["menu"][0]["experiment"] == best
    # where the drive is held depends on all of them a little
    assert found["floors"] == pytest.approx(least[best], rel=0.01) and found["floors"] > TELLING
    assert found["text"].endswith("; every other pair of them differs more")
    assert [text for text, _ in told] == [f"next experiment, {e.name}" for e in MENU]
    assert [share for _, share in told] == sorted(share for _, share in told)
    assert told[0][1] == 0.0


def test_what_an_experiment_leaves_of_three_is_named():
    three = [ageing(), model(), model("twin")]
    found = recommend_among(three, CONDITIONS, draws=0, menu=[PLAIN, *HOLDS])
    assert found["floors"] == 0.0
    assert found["menu"][0]["experiment"] == "hold 25 s"
    assert found["text"].startswith("hold the drive for 25 s")
    assert found["text"].endswith("; it also tells contact-ageing from twin; it does not tell base from twin")
    none = recommend_among([model("a"), model("b"), model("c")], CONDITIONS, draws=0, menu=[PLAIN])
    assert none["text"].startswith("no experiment of the menu tells any of a, b and c from another; best is: ")
    with pytest.raises(ValueError, match="at least two"):
        recommend_among([model("a")], CONDITIONS)
