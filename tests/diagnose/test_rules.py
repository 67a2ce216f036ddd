"""The rules of a verdict and of what is held out, on made-up numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.diagnose.candidate import Candidate
from stickslip.diagnose.heldout import HeldOut
from stickslip.diagnose.holdout import training_cycles
from stickslip.diagnose.pieces import fit_arrays, fit_from
from stickslip.diagnose.rungs import Rung
from stickslip.diagnose.search import starts
from stickslip.diagnose.thresholds import THRESHOLDS
from stickslip.diagnose.verdict import (
    confidence,
    decide,
    is_adequate,
    is_complete,
    judge,
    nothing,
    passed_over,
    weights,
    worst_phase,
)
from stickslip.effects import catalogue
from stickslip.errors import InputError
from stickslip.features.layout import Layout
from stickslip.features.measurement import Measurement
from stickslip.fit.inertial import DISPERSION, Fit, robust
from stickslip.fit.parameters import effect_parameters
from stickslip.forward import Cycles
from stickslip.residual import Misfit


def measurement(velocities=(5e-5, 1e-4, 2e-4, 4e-4, 1e-4), cycles=6, hold_runs=(4,)) -> Measurement:
    """Nothing but shapes, velocities and holds (in the fourth and sixth cycle of the hold runs)."""
    layout = Layout(0.06, 0.004)
    runs = len(velocities)
    used = np.ones((runs, cycles), bool)
    valid = np.ones((runs, cycles, layout.size), bool)
    valid[..., layout.slices()["hold"]] = False
    for r in hold_runs:
        valid[r, [3, 5], layout.slices()["hold"]] = True
    c = Cycles(*([jnp.zeros((runs, cycles))] * 4), jnp.asarray(used), jnp.asarray(used), *([jnp.zeros((runs, 2))] * 2),
               jnp.full(runs, jnp.nan), jnp.ones(runs, bool))  # fmt: skip
    zero = np.zeros((runs, cycles, layout.size))
    names = tuple(f"run{r}" for r in range(runs))
    anchors = SimpleNamespace(
        ring_period=np.full((runs, cycles), 2e-3),
        creep=np.broadcast_to(np.geomspace(1.0, 4e-3, 16), (runs, cycles, 16)),
    )
    return Measurement(layout, c, anchors, zero, valid, zero + 1, names, np.array(velocities))


def test_a_middle_velocity_and_the_later_hold_are_held_out():
    train = training_cycles(measurement())
    assert not train[2].any() or not train[1].any()
    held_runs = [r for r in range(4) if not train[r].any()]
    assert len(held_runs) == 1
    assert held_runs[0] not in (0, 3)  # neither the slowest nor the fastest
    assert train[4, :4].all()
    assert not train[4, 5]


def test_runs_to_be_fitted_are_not_held_out_by_default():
    data = measurement()
    middle = next(r for r in range(4) if not training_cycles(data)[r].any())
    kept = training_cycles(data, keep=[f"run{middle}"])
    assert kept[middle].all()
    assert not kept[4, 5]
    with pytest.raises(InputError, match="no cycle is left that no fit sees"):
        training_cycles(data, keep=[f"run{r}" for r in range(5)])


def test_named_runs_are_held_out_and_unknown_names_refused():
    train = training_cycles(measurement(), ["run1.csv"])
    assert not train[1].any()
    assert train[[0, 2, 3, 4]].all()
    with pytest.raises(InputError, match="run of this name"):
        training_cycles(measurement(), ["run9"])
    with pytest.raises(InputError, match="every run"):
        training_cycles(measurement(), [f"run{r}" for r in range(5)])


def test_a_single_velocity_still_holds_something_out():
    data = measurement((1e-4,), 6, ())
    train = training_cycles(data)
    assert 0 < train.sum() < 6


def held(score: float, n: int = 8) -> HeldOut:
    return HeldOut(np.sqrt(score), score, {"creep": np.sqrt(score)}, score * np.linspace(0.9, 1.1, n))


def candidate(tag: str, cost: float, score: float, at_bound: bool = False) -> Candidate:
    effect = catalogue.make(tag)
    free = tuple(effect_parameters(effect))
    z = np.array([f.inward(f.start) for f in free])
    if at_bound:
        z[0] = free[0].bounds[1]
    sd = np.ones(len(free)) * 1e-3
    shape = (1, 1, 3)
    empty = np.zeros(shape)
    fit = Fit(z, np.zeros((1, 1, 2)), cost, cost, empty, empty, np.diag(sd**2), free,
              np.zeros((*shape, len(z))), np.ones((1, 1), bool), 1, 1)  # fmt: skip
    train = Misfit(1.0, {"creep": 1.0}, {})
    return Candidate(tag, {}, effect, 0.5, fit=fit, train=train, held=held(score))


def test_a_candidate_that_meets_every_condition_is_told_why_it_is_not_named():
    base = held(9.0)
    tried = [
        candidate("contact-ageing", 300, 0.8),
        candidate("rate-and-state", 298, 0.8),
        candidate("viscous-drag", 305, 0.8),
        candidate("tilt", 600, 0.9),
        candidate("wear", 950, 8.5),
    ]
    judged = [judge(c, 1000.0, base) for c in tried]
    why = {j.candidate.tag: passed_over(j, judged) for j in judged}
    assert why["contact-ageing"] == ()
    assert "contains contact-ageing" in why["rate-and-state"][0]
    assert "cannot tell it from contact-ageing" in why["viscous-drag"][0]
    assert "100 % above that of contact-ageing" in why["tilt"][0]
    assert why["wear"] == judged[-1].failures != ()


def test_a_clear_winner_is_named():
    base = held(9.0)
    tried = [candidate("contact-ageing", 300, 0.8), candidate("viscous-drag", 950, 8.5)]
    best, close = decide([judge(c, 1000.0, base) for c in tried])
    assert best is not None
    assert best.candidate.tag == "contact-ageing"
    assert len(close) == 1


def test_two_that_explain_as_well_are_a_set():
    base = held(9.0)
    tried = [candidate("sensor-drift", 300, 0.8), candidate("thermal-creep", 320, 0.8)]
    best, close = decide([judge(c, 1000.0, base) for c in tried])
    assert best is not None
    assert [j.candidate.tag for j in close] == ["sensor-drift", "thermal-creep"]


def test_what_fitted_cycles_cannot_tell_apart_unseen_ones_may():
    """One wave longer than the track fits as well as wear, and goes on wrongly where no fit looked."""
    wave, wear = candidate("position-dependent-friction", 175, 4.8), candidate("wear", 179, 0.85)
    best, close = decide([judge(c, 6000.0, held(81.0)) for c in (wave, wear)])
    assert best is not None
    assert best.candidate.tag == "wear"
    assert [j.candidate.tag for j in close] == ["wear"]
    # beyond the rivals of the cheapest, unseen cycles do not make a leader
    best, _ = decide([judge(c, 6000.0, held(81.0)) for c in (wave, replace(wear, fit=replace(wear.fit, cost=230)))])
    assert best is not None
    assert best.candidate.tag == "position-dependent-friction"


@pytest.mark.parametrize(
    "rival", [candidate("thermal-creep", 310, 1.2), candidate("thermal-creep", 310, 0.8, at_bound=True)]
)
def test_no_rival_is_what_fails_on_unseen_cycles_or_needs_the_implausible(rival):
    judged = [judge(c, 1000.0, held(9.0)) for c in (candidate("sensor-drift", 300, 0.8), rival)]
    _, close = decide(judged)
    assert [j.candidate.tag for j in close] == ["sensor-drift"]


@pytest.mark.parametrize(("errors", "said"), [(1.5, {"sensor-drift", "thermal-creep"}), (2.5, {"sensor-drift"})])
def test_a_rival_is_left_out_only_where_unseen_cycles_speak_plainly(errors, said):
    """One that is cheaper on the fitted cycles is not silenced by a little more on few unseen ones."""
    leader, rival = candidate("sensor-drift", 300, 0.8), candidate("thermal-creep", 280, 0.8)
    off = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    more = 0.1 * off + errors * 0.1 * np.std(off, ddof=1) / np.sqrt(off.size)
    own = leader.held.per_cycle + more
    worse = replace(rival, held=replace(rival.held, score=float(np.mean(own)), per_cycle=own))
    _, close = decide([judge(c, 1000.0, held(9.0)) for c in (leader, worse)])
    assert {j.candidate.tag for j in close} == said


def test_weights_follow_the_costs_and_the_widened_errors():
    judged = [judge(candidate(t, c, 0.8), 1000.0, held(9.0)) for t, c in (("tilt", 300), ("wear", 332), ("tilt", 350))]
    found = weights(judged)
    assert found["tilt"] / found["wear"] == pytest.approx(np.exp(32 / (2 * DISPERSION)))
    assert sum(found.values()) == pytest.approx(1.0)
    assert confidence(judged, judged[:1]) == pytest.approx(found["tilt"])
    # the law that contains the one that was said counts with it
    pair = [judge(candidate(t, 300, 0.8), 1000.0, held(9.0)) for t in ("contact-ageing", "rate-and-state")]
    assert confidence(pair, pair[:1]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("made", "why"),
    [
        (lambda: candidate("viscous-drag", 1000 * (1 - 0.9 * THRESHOLDS.gain), 0.8), "training cost"),
        (lambda: candidate("viscous-drag", 300, 9.0 * (1 - 0.9 * THRESHOLDS.unseen)), "unseen cycles does not fall"),
        (lambda: candidate("viscous-drag", 300, 0.8, at_bound=True), "border"),
    ],
)
def test_every_condition_can_refuse_a_name(made, why):
    judged = judge(made(), 1000.0, held(9.0))
    assert not judged.passed
    assert any(why in f for f in judged.failures)
    assert decide([judged]) == (None, [])


@pytest.mark.parametrize(
    ("cost", "score", "errors", "passes"),
    [
        (740, 0.85, 1.5, True),  # ample on the fitted cycles: the unseen ones need but agree
        (760, 0.85, 2.5, False),
        (760, 0.70, 1.5, False),
        (760, 0.70, 2.5, True),
        (910, 0.70, 2.5, False),
    ],
)
def test_what_takes_little_off_the_fitted_cycles_must_be_plain_on_the_unseen_ones(cost, score, errors, passes):
    """Small effects hide among the many features that only noise decides; on cycles no fit has seen nothing is hidden.

    ``errors``: gain on unseen cycles over its standard error.
    """
    off = np.array([1.0, -1.0] * 4)
    gain = 1.0 - score
    scatter = off * gain / errors * np.sqrt(off.size) / np.std(off, ddof=1)
    base = HeldOut(1.0, 1.0, {"creep": 1.0}, np.ones(8))
    seen = replace(
        candidate("contact-damping", cost, score),
        held=HeldOut(np.sqrt(score), score, {"creep": 1.0}, 1.0 - gain - scatter),
    )
    judged = judge(seen, 1000.0, base)
    assert judged.passed is passes, judged.failures


def test_a_small_amplitude_is_not_implausible():
    """A high-pass at 8e-5 Hz moves creep by thirty floors, and 8e-5 Hz is next to nothing in a range up to 5 Hz."""
    small = candidate("sensor-high-pass", 10, 0.8)
    assert small.fit is not None
    (cutoff,) = (i for i, f in enumerate(small.fit.free) if f.amplitude)
    z = small.fit.z.copy()
    z[cutoff] = small.fit.free[cutoff].inward(8e-5)
    assert judge(replace(small, fit=replace(small.fit, z=z)), 1000.0, held(9.0)).passed
    z[cutoff] = small.fit.free[cutoff].bounds[1]
    assert not judge(replace(small, fit=replace(small.fit, z=z)), 1000.0, held(9.0)).passed


@pytest.mark.parametrize(("general", "special"), [(310, 300), (300, 310)])
def test_the_special_case_is_named_where_the_general_law_is_no_better(general, special):
    tried = [candidate("rate-and-state", general, 0.8), candidate("contact-ageing", special, 0.8)]
    best, close = decide([judge(c, 1000.0, held(9.0)) for c in tried])
    assert best is not None
    assert best.candidate.tag == "contact-ageing"
    assert len(close) == 1
    better = [candidate("rate-and-state", 200, 0.8), candidate("contact-ageing", 300, 0.8)]
    best, close = decide([judge(c, 1000.0, held(9.0)) for c in better])
    assert best is not None
    assert best.candidate.tag == "rate-and-state"
    assert len(close) == 1


def test_what_is_left_decides_between_complete_and_unknown():
    refused = [judge(candidate("viscous-drag", 900, 8.0), 1000.0, held(9.0))]
    limit = THRESHOLDS.complete["slip"]

    def left(factor: float) -> Rung:
        return Rung((), None, Misfit(1.0, {"slip": factor * limit}, {}), None, None, None, np.zeros(0))

    assert nothing([], refused, left(THRESHOLDS.remainder - 0.05)).kind == "complete"
    assert "remains" in nothing([], refused, left(THRESHOLDS.remainder - 0.05)).text
    # the model is fitted once more after all were tried, and may be within its limits then
    assert nothing([], refused, left(0.95)).text.startswith("Nothing is missing")
    assert nothing(["tilt"], refused, left(0.95)).text.startswith("The base model lacks tilt. With it every phase")
    assert nothing([], refused, left(THRESHOLDS.remainder + 0.05)).kind == "unknown"
    assert nothing(["tilt"], refused, left(THRESHOLDS.adequate - 0.05)).kind == "missing"
    verdict = nothing(["tilt"], refused, left(THRESHOLDS.adequate + 0.05))
    assert verdict.kind == "unknown"
    assert "viscous-drag" in verdict.text
    assert verdict.reasons == refused[0].failures


def test_a_gain_too_small_for_its_parameters_is_refused():
    """Two parameters of drag and nine for each: 18 is not enough, even where it is most of the cost."""
    assert any("not significant" in f for f in judge(candidate("viscous-drag", 3, 0.8), 20.0, held(9.0)).failures)
    assert judge(candidate("viscous-drag", 1, 0.8), 20.0, held(9.0)).passed


def test_complete_means_every_phase_also_where_no_fit_looked():
    top = THRESHOLDS.overall
    good = Misfit(top, {"creep": 0.8, "slip": 1.0}, {})
    limit = THRESHOLDS.complete
    unseen = HeldOut(top, top**2, {"creep": limit["creep"]}, np.array([1.0]))
    assert is_complete(good, unseen)
    assert not is_complete(good, replace(unseen, by_phase={"creep": limit["creep"] + 0.1}))
    for phase in limit:
        assert is_complete(replace(good, by_phase={phase: limit[phase]}), unseen)
        assert not is_complete(replace(good, by_phase={phase: limit[phase] + 0.1}), unseen)
    assert is_complete(replace(good, alike={"slip": THRESHOLDS.alike}), unseen)
    assert not is_complete(replace(good, alike={"slip": THRESHOLDS.alike + 0.1}), unseen)


def test_what_all_events_have_in_common_is_named_where_it_is_worst():
    left = Misfit(0.8, {"slip": 0.8}, {}, {"slip": 2.0 * THRESHOLDS.alike, "creep": 0.1})
    assert worst_phase(left, None) == ("slip in all events", 2.0 * THRESHOLDS.alike)
    assert worst_phase(replace(left, alike={}), None) == ("slip", 0.8)
    assert not is_adequate(left, None, factor=1.9)
    assert is_adequate(left, None, factor=2.1)


def test_complete_means_all_phases_together_too():
    """What no phase shows by itself, fitted or unseen."""
    top = THRESHOLDS.overall
    thin, unseen = Misfit(top, {"creep": 0.9}, {}), HeldOut(top, top**2, {"creep": 0.9}, np.array([0.8]))
    assert is_complete(thin, unseen)
    assert not is_complete(replace(thin, total=top + 0.05), unseen)
    assert not is_complete(thin, replace(unseen, error=top + 0.05))


def test_a_fit_survives_being_kept():
    fit = candidate("contact-ageing", 10.0, 1.0).fit
    assert fit is not None
    again = fit_from(fit_arrays(fit))
    assert again.free == fit.free
    assert again.cost == fit.cost
    np.testing.assert_array_equal(again.z, fit.z)
    np.testing.assert_array_equal(again.columns, fit.columns)
    assert again.values == fit.values


@pytest.mark.parametrize("tag", catalogue.tags())
def test_a_search_starts_inside_the_bounds(tag):
    effect = catalogue.make(tag)
    free = {f.name.split(".", 1)[1]: f for f in effect_parameters(effect)}
    found = starts(effect, [0.02])
    assert found
    for values in found:
        assert effect.amplitude not in values
        for name, value in values.items():
            assert free[name].lower <= value <= free[name].upper


def test_huber_is_quadratic_inside_and_straight_outside():
    assert robust(np.array([2.0])) == 4.0
    assert robust(np.array([10.0])) == pytest.approx(2 * 3 * 10 - 9)
