"""Loops of prescribed motion and measured force: the backbone, the noise and an uneven fixture, from a plain bank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from stickslip.data.campaign import Rig
from stickslip.data.prescribed import prescribed, with_motion
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.errors import InputError
from stickslip.inference.diagnose.free_simulation import confirm
from stickslip.inference.diagnose.prepare import Prepared
from stickslip.inference.diagnose.search_round import Round
from stickslip.inference.diagnose.stepwise_selection import _end
from stickslip.inference.force.backbone import backbone
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit import fit
from stickslip.inference.force.prescribed import begin, placeholders, stretches, thinned
from stickslip.inference.force.scales import Scales
from stickslip.inference.force.signatures import Explained
from stickslip.physics.effects import catalogue

from .conftest import made

RATE, STROKE, SPEED, REST = 200.0, 2.4e-4, 2.2e-4, 0.5  # Hz, m, m/s, s
CAPS = np.full(30, 2.4 / 30)  # N
YIELDS = np.linspace(2e-6, 9e-5, 30)  # m
NOISE = 2e-4  # N
BEND = 8e-7  # m/N^2


def stage(cycles: int, rate: float = RATE) -> tuple[np.ndarray, np.ndarray]:
    """A triangle with a rest at either end (s, m)."""
    one_way = STROKE / SPEED
    knots = np.cumsum(np.tile([0.0, one_way, REST, one_way, REST], cycles)[1:])
    knots = np.concatenate([[0.0], np.unique(knots)])
    ends = np.concatenate([[0.0], np.tile([1.0, 1.0, 0.0, 0.0], cycles)]) * STROKE
    t = np.arange(0.0, knots[-1], 1.0 / rate)
    return t, np.interp(t, knots, ends)


def jenkins(
    x: np.ndarray, load: np.ndarray | None = None, caps: np.ndarray = CAPS, yields: np.ndarray = YIELDS
) -> np.ndarray:
    """Force of a bank of Coulomb elements along a way, sample by sample; caps in proportion to a load about 1."""
    load = np.ones(x.size) if load is None else load
    force, out = np.zeros(caps.size), np.zeros(x.size)
    for i, step in enumerate(np.diff(x), start=1):
        force = np.clip(force + caps / yields * step, -caps * load[i], caps * load[i])
        out[i] = force.sum()
    return out


def record(seed: int, bend: float = 0.0, rate: float = RATE) -> Trace:
    t, x = stage(4, rate)
    force = jenkins(x)
    noise = np.random.default_rng(seed).normal(0.0, NOISE, t.size)
    return Trace.from_arrays(
        f"run {seed}", time=t, drive_position=x + bend * force**2, spring_force=force + noise, noise=NOISE, virgin=True
    )


@pytest.fixture(scope="module")
def plain():
    runs = [thinned(with_motion(record(seed))) for seed in (1, 2, 3)]
    return fit(*begin(Rig(), runs))


def test_a_record_of_force_and_motion_is_told_from_one_of_a_force_alone():
    t, _ = stage(1)
    loop = record(1)
    assert prescribed(loop, segment(loop))
    teeth = Trace.from_arrays(time=t, spring_force=(t % 0.3) / 0.3 + 0.1, drive_velocity=SPEED, spring_stiffness=1e4)
    assert segment(teeth).events
    assert not prescribed(teeth, segment(teeth))


def test_every_stroke_and_every_rest_is_a_stretch_of_its_own():
    t, x = stage(3)
    found = stretches(t, x, 1e-9, None)
    ways = np.array([s.way for s in found if abs(s.way) > 0.5 * STROKE])
    assert ways.size == 6
    assert np.sign(ways).tolist() == [1.0, -1.0] * 3
    assert sum(not s.moving for s in found) >= 5


def test_the_velocity_after_a_step_is_known_where_single_samples_are_noise():
    """Windows of 10 ms, in which the motion goes on by less than its noise, as in a velocity step of rock."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 20.0, 0.01)
    clean = 3e-6 * time + 7e-6 * np.maximum(time - 10.0, 0.0)
    force = 1.0 + 0.01 * np.tanh((time - 10.0) / 0.3) + 1e-4 * rng.normal(size=time.size)

    def speeds(noise):
        knots = thinned(Trace.from_arrays("step", time=time, displacement=clean + noise, spring_force=force))
        away = np.abs(knots.at - 10.0) > 0.05
        return knots.rate[away], np.where(knots.at < 10.0, 3e-6, 1e-5)[away]

    found, true = speeds(0.17e-6 * rng.normal(size=time.size))
    assert np.abs(found / true - 1.0).max() < 0.4
    assert np.sqrt(np.mean((found / true - 1.0) ** 2)) < 0.1
    found, true = speeds(np.zeros(time.size))
    np.testing.assert_allclose(found, true, rtol=1e-3)


@pytest.mark.slow
def test_the_backbone_of_the_bank_is_measured():
    runs = [thinned(with_motion(record(seed, rate=8.0 * RATE))) for seed in (1, 2, 3)]
    curve = backbone(fit(*begin(Rig(), runs)))
    true = np.array([np.minimum(CAPS, CAPS / YIELDS * u).sum() for u in curve.displacement])
    inside = (curve.displacement > YIELDS[0]) & (curve.displacement < YIELDS[-1])
    np.testing.assert_allclose(curve.force[inside], true[inside], atol=1.5e-3 * CAPS.sum())


def test_where_the_stiffest_elements_yield_within_two_samples_a_slow_healing_takes_what_the_windows_lose(plain):
    """Sampled an eighth as often the true curve lies between what the contact holds at rest and in sliding."""
    curve = backbone(plain)
    true = np.array([np.minimum(CAPS, CAPS / YIELDS * u).sum() for u in curve.displacement])
    inside = (curve.displacement > YIELDS[0]) & (curve.displacement < YIELDS[-1])
    lost = plain.values["weakening.drop"]
    assert lost < 0.01
    at_rest, near = curve.force[inside], 3e-3 * CAPS.sum()
    assert ((true[inside] < at_rest + near) & (true[inside] > (1.0 - lost) * at_rest - near)).all()


def test_what_the_bank_leaves_is_small(plain):
    assert np.sqrt(np.mean(plain.marginal**2)) < 2e-3 * CAPS.sum()


@pytest.mark.slow
def test_a_count_that_is_wider_than_the_stiffest_elements_yield_does_not_make_the_contact_weaker():
    """After every turn the reading stands still while the force falls by a half."""
    count, runs = 1e-5, []
    caps, yields = np.append(CAPS, 0.5 * CAPS.sum()), np.append(YIELDS, 1e-6)
    for seed in (1, 2, 3):
        t = np.arange(0.0, 12.0, 1.0 / RATE)
        x = 0.5 * STROKE * (1.0 - np.cos(np.pi * t)) + 1e-6 * seed
        force = jenkins(x, caps=caps, yields=yields) + np.random.default_rng(seed).normal(0.0, NOISE, t.size)
        read = count * np.round(x / count)
        trace = Trace.from_arrays(f"{seed}", time=t, drive_position=read, spring_force=force, noise=NOISE)
        runs.append(thinned(with_motion(trace)))
    found = fit(*begin(Rig(), runs))
    assert found.strength == pytest.approx(caps.sum(), rel=0.05)
    curve = backbone(found)
    true = np.array([np.minimum(caps, caps / yields * u).sum() for u in curve.displacement])
    far = (curve.displacement > 2.0 * count) & (curve.displacement < YIELDS[-1])
    np.testing.assert_allclose(curve.force[far], true[far], atol=0.05 * caps.sum())


def test_a_contact_that_never_slides_as_a_whole_is_measured_with_what_stays_stuck():
    """A swing that decays, as of a bolted joint: its stiff part holds a hundred times what slides."""
    beside, zero = 4e4, 0.3  # N/m, N
    caps, yields = np.full(20, 0.01), np.linspace(5e-6, 5e-5, 20)
    runs, t = [], np.arange(0.0, 8.0, 1.0 / RATE)
    for seed, size in enumerate((6e-5, 4.5e-5, 3e-5)):
        x = size * np.exp(-0.03 * t) * np.sin(2.0 * np.pi * t)
        force = jenkins(x, caps=caps, yields=yields) + beside * x + zero
        noise = np.random.default_rng(seed).normal(0.0, NOISE, t.size)
        # the record begins within a swing, where elements are loaded by what was before
        later = t > 1.1
        trace = Trace.from_arrays(f"{size}", time=t[later] - t[later][0], drive_position=x[later],
                                  spring_force=(force + noise)[later], noise=NOISE)  # fmt: skip
        runs.append(thinned(with_motion(trace)))
    found = fit(*begin(Rig(), runs))
    assert found.values["rig.parallel_stiffness"] == pytest.approx(beside, rel=0.02)
    assert np.sqrt(np.mean(found.marginal**2)) < 0.03 * caps.sum()
    curve = backbone(found)
    true = beside * curve.displacement + [np.minimum(caps, caps / yields * u).sum() for u in curve.displacement]
    slid = curve.displacement < 5e-5
    np.testing.assert_allclose(curve.force[slid], true[slid], rtol=0.005)


def test_derivatives_in_what_never_slides_and_in_what_a_run_begins_with():
    t, x = stage(2)
    trace = Trace.from_arrays("run", time=t, drive_position=x, spring_force=jenkins(x) + 3e3 * x, noise=NOISE)
    problem, point = begin(Rig(), [thinned(with_motion(trace))])
    names = [f.name for f in problem.composition.shared]
    slopes, step = problem.evaluate(point).shared, 1e-4
    at = names.index("rig.parallel_stiffness")
    z = point.z.copy()
    z[at] += step
    moved = problem.evaluate(replace(point, z=z)).residual - problem.evaluate(point).residual
    np.testing.assert_allclose(moved, step * slopes[:, at], atol=1e-9)
    other = problem.evaluate(replace(point, phases=point.phases + step)).residual
    np.testing.assert_allclose(other - problem.evaluate(point).residual, step * slopes[:, len(names)], atol=1e-9)


def test_nothing_stays_stuck_beside_a_contact_that_slides(plain):
    assert plain.values["rig.parallel_stiffness"] * STROKE < 5e-3 * CAPS.sum()


def test_what_a_part_of_a_stroke_has_not_made_slide_is_not_compared():
    t, x = stage(3)
    force = jenkins(x)
    later = t > 0.75 * STROKE / SPEED
    cut = Trace.from_arrays("cut", time=t[later], drive_position=x[later], spring_force=force[later], noise=NOISE)
    run = thinned(with_motion(cut))
    back = 2.0 * STROKE / SPEED + REST  # the end of the first whole stroke
    assert run.at.min() > back - 0.05
    whole = fit(*begin(Rig(), [run]))
    assert np.sqrt(np.mean(whole.marginal**2)) < 2e-3 * CAPS.sum()


@pytest.mark.slow
def test_an_uneven_fixture_is_found_with_its_size():
    runs = [thinned(with_motion(record(seed, BEND))) for seed in (1, 2, 3)]
    base = fit(*begin(Rig(), runs))
    (found,) = try_effect(base, Explained(base), "uneven-compliance", [{}])
    assert base.cost - found.fit.cost > 100.0
    error = found.fit.std()["uneven-compliance.bend"]
    assert found.fit.values["uneven-compliance.bend"] == pytest.approx(BEND, abs=max(3.0 * error, 0.03 * BEND))


def test_an_even_fixture_has_no_uneven_part(plain):
    (found,) = try_effect(plain, Explained(plain), "uneven-compliance", [{}])
    assert abs(found.fit.values["uneven-compliance.bend"]) < 0.03 * BEND


@pytest.mark.slow
def test_friction_follows_the_load_that_was_measured_beside_it():
    runs = []
    for seed in (1, 2, 3):
        t, x = stage(4)
        load = 5.0 * (1.0 + 0.05 * np.sin(1.3 * t + seed))
        force = jenkins(x, load / 5.0) + np.random.default_rng(seed).normal(0.0, NOISE, t.size)
        trace = Trace.from_arrays(f"{seed}", time=t, drive_position=x, spring_force=force, noise=NOISE, virgin=True)
        runs.append(thinned(with_motion(trace.replace(normal_load=load))))
    base = fit(*begin(Rig(), runs))
    assert base.problem.loaded
    (found,) = try_effect(base, Explained(base), "measured-load", [{}])
    error = found.fit.std()["measured-load.share"]
    assert base.cost - found.fit.cost > 100.0
    assert found.fit.values["measured-load.share"] == pytest.approx(1.0, abs=max(3.0 * error, 0.03))


def test_a_law_that_is_far_off_is_not_called_complete(plain):
    """A damper with play: after every turn the force is gone for a while, which no effect of the catalogue knows."""
    runs = []
    for seed in (1, 2, 3):
        t, x = stage(4)
        follower = np.zeros(x.size)
        for i in range(1, x.size):
            follower[i] = np.clip(follower[i - 1], x[i] - 8e-5, x[i])
        force = np.where(np.isclose(follower, x) | np.isclose(follower, x - 8e-5), jenkins(follower), 0.0)
        force = force + np.random.default_rng(seed).normal(0.0, NOISE, t.size)
        trace = Trace.from_arrays(f"{seed}", time=t, drive_position=x, spring_force=force, noise=NOISE, virgin=True)
        runs.append(thinned(with_motion(trace)))
    base = fit(*begin(Rig(), runs))
    assert base.scatter.unexpected()
    assert _end({}, Round(base, (), (), ())).kind == "unknown"
    assert not plain.scatter.unexpected()


def test_an_effect_is_tried_where_the_record_shows_what_it_needs(plain):
    uneven, loaded = catalogue.get("uneven-compliance"), catalogue.get("measured-load")
    loops = Prepared(plain.problem, plain.point, (), (), Scales(1.0, 0.0, 1.0), (), True)
    assert loops.shows(uneven)
    assert not loops.shows(loaded)  # no load was measured
    t = np.arange(0.0, 2.0, 1.0 / RATE)
    x = SPEED * np.minimum(t, 1.0)
    ramp = Trace.from_arrays("ramp", time=t, drive_position=x, spring_force=jenkins(x), noise=NOISE, virgin=True)
    runs = [thinned(with_motion(ramp.replace(normal_load=5.0 + 0.5 * np.sin(t))))]
    one_way = Prepared(*begin(Rig(), runs), (), (), Scales(1.0, 0.0, 1.0), (), True)
    assert not one_way.shows(uneven)
    assert one_way.shows(loaded)


def test_nothing_is_run_freely_and_the_report_says_so_in_words(plain):
    loops = Prepared(plain.problem, plain.point, (), (), Scales(1.0, 0.0, 1.0), (), prescribed=True)
    found = confirm({("static", "inertia"): plain}, ("static", "inertia"), loops)
    assert not found.models
    assert found.notes[0].startswith("no free simulation: the motion is prescribed")
    assert "Error" not in found.notes[0]


@pytest.mark.slow
def test_what_the_rig_lacks_is_no_parameter_of_it(plain):
    """Nothing but the prescribed motion pulls; the numbers that stand for a spring and a mass are not "given"."""
    assert placeholders(plain.problem, Rig()) == ("rig.spring_stiffness", "rig.mass")
    assert placeholders(plain.problem, Rig(mass=0.1)) == ("rig.spring_stiffness",)
    loops = ss.Campaign.from_traces([record(seed) for seed in (1, 2, 3)]).fit()
    listed = set(loops.parameters.index)
    assert "rig.damping" in listed and not listed & {"rig.spring_stiffness", "rig.mass"}
    assert set(loops.result["parameters"]) & {"rig.spring_stiffness", "rig.mass"} == set()


def test_one_step_of_the_velocity_is_fitted_but_not_diagnosed():
    t = np.arange(0.0, 4.0, 1.0 / RATE)
    x = SPEED * (t + 4.0 * np.maximum(t - 2.0, 0.0))
    step = 1.0 + 0.02 * (t > 2.0)
    force = step * jenkins(x) + np.random.default_rng(1).normal(0.0, NOISE, t.size)
    campaign = ss.Campaign.from_traces(
        [Trace.from_arrays("step", time=t, drive_position=x, spring_force=force, noise=NOISE)]
    )
    found = campaign.fit()
    assert found.error < 2.0
    assert np.isnan(found.unseen_error)  # nothing can be held out
    assert "none on unseen runs, with one event only" in repr(found)
    with pytest.raises(InputError, match="no part of the record can be left out to test an effect"):
        campaign.diagnose()
    still = Trace.from_arrays("steady", time=t, drive_position=SPEED * t, spring_force=jenkins(SPEED * t), noise=NOISE)
    with pytest.raises(InputError, match="never turns, stops or changes its speed"):
        ss.Campaign.from_traces([still]).fit()


def test_a_spring_that_was_stretched_when_the_record_began_pulls_one_way(tmp_path):
    """Its force is not known at first: where the block stands then is no force of zero, after which it would push."""
    case = made(tmp_path / "case", 11, virgin=False, spring_known=True)
    begun = Prepared(case.problem, case.point, (), (), case.times, ())
    low = min(float(np.min(k.drive - k.x)) for k in begun.runs)
    high = max(float(np.max(k.drive - k.x)) for k in begun.runs)
    assert low < -0.1 * high
    assert not begun.both_ways
