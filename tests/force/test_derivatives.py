"""Derivatives of the residual force against central differences over a ladder of steps."""

from __future__ import annotations

from dataclasses import replace

import equinox as eqx
import numpy as np
import pytest

from stickslip.inference.fit.parameters import Free, effect_parameters
from stickslip.inference.force.composition import is_own
from stickslip.inference.force.knots import PHASES
from stickslip.inference.force.noise import by_reading, carrier
from stickslip.inference.force.point import LOCAL, Point
from stickslip.inference.force.problem import Problem
from stickslip.physics.effects import catalogue

LADDER = 10.0 ** np.arange(-3.0, -7.5, -0.5)  # of each direction's own unit
# residuals have kinks where an element begins to slide: a difference over one of them is no derivative, and the share
# of points with a kink falls with the step
AGREE = 2e-6  # of the largest derivative, in the mean over points
EFFECTS = {
    "base": (),
    "effects": (
        ("contact-ageing", {}, {"rate": 0.003}),
        ("position-dependent-friction", {"form": "wave"}, {"amplitude": 0.004}),
    ),
    "mass": (("inertia", {}, {"share": 0.08}),),
}


def with_effects(case, chosen):
    """Problem and point with effects in them, events that differ."""
    composition, z, phases = case.problem.composition, case.point.z, case.point.phases
    for tag, form, values in chosen:
        effect = catalogue.get(tag)(**form)
        amplitude = next(iter(values.values()))
        effect = eqx.tree_at(lambda e: getattr(e, e.amplitude), effect, np.float64(amplitude))
        free = effect_parameters(effect, amplitude=amplitude)
        composition = composition.with_effect(effect, free)
        z = np.concatenate([z, [f.inward(f.start) for f in free if not is_own(f.name)]])
        for f in (f for f in free if is_own(f.name)):
            phases = np.vstack([phases, np.array([0.7, -0.4]) / float(f.scale)])
    rng = np.random.default_rng(3)
    problem = case.problem.with_composition(composition)
    events = rng.standard_normal((problem.events, 4)) * [3e-3, 3e-2, 3e-2, 3e-9]
    weights = case.point.weights * np.exp(0.1 * rng.standard_normal(case.point.weights.size)) + 1e-4
    common = np.zeros(case.point.common.size)
    return problem, Point(z, phases, weights, events, common)


@pytest.fixture(scope="module", params=EFFECTS)
def placed(request, small):
    problem, point = with_effects(small, EFFECTS[request.param])
    return problem, point, problem.evaluate(point)


def moved(point: Point, part: str, index, step: float) -> Point:
    """One number of the point moved."""
    values = np.array(getattr(point, part))
    values[index] += step
    return replace(point, **{part: values})


def disagreement(problem, point, part, index, unit, exact) -> float:
    """The least, over the ladder, of the mean difference, over the largest derivative."""
    best = np.inf
    size = np.abs(exact).max()
    assert size > 0.0
    for step in LADDER * unit:
        up = problem.evaluate(moved(point, part, index, step)).residual
        down = problem.evaluate(moved(point, part, index, -step)).residual
        best = min(best, float(np.mean(np.abs((up - down) / (2.0 * step) - exact))) / size)
    return best


@pytest.mark.slow
def test_shared_parameters(placed):
    problem, point, slopes = placed
    for i, f in enumerate(problem.composition.shared):
        wrong = disagreement(problem, point, "z", i, 1.0, slopes.shared[:, i])
        assert wrong < AGREE, f.name


def test_no_motion_tells_all_forces_and_the_mass_by_one_factor(small):
    """More mass, and spring, damping and contact stronger by as much: the same residuals, and the same likelihood."""
    factor, spring = 1.08, 950.0
    free = Free("rig.spring_stiffness", "N/m", "log", spring, spring, np.inf, 1e2, 1e4)
    composition = small.problem.composition
    fixed = {name: value for name, value in composition.fixed.items() if name != free.name}
    kept = tuple(f for f in composition.free if f.name != free.name)
    names = [f.name for f in composition.shared]
    z = np.array([z for name, z in zip(names, small.point.z, strict=True) if name != free.name])
    runs = [replace(k, stiffness=None) for k in small.problem.runs]
    plain = Problem(replace(composition, free=(*kept, free), fixed=fixed), runs)
    point = replace(small.point, z=np.append(z, free.inward(spring)))
    heavier, _ = with_effects(replace(small, problem=plain, point=point), (("inertia", {}, {"share": factor - 1.0}),))
    moved_z = np.append(point.z, 0.0)
    for i, f in enumerate(heavier.composition.shared):
        if f.name in ("rig.damping", "rig.spring_stiffness"):
            moved_z[i] = f.inward(factor * f.outward(float(moved_z[i])))
        if f.name == "inertia.share":
            moved_z[i] = f.inward(factor - 1.0)
    one = plain.evaluate(point)
    other = heavier.evaluate(replace(point, z=moved_z, weights=factor * point.weights))
    size = np.abs(one.residual).max()
    np.testing.assert_allclose(other.residual, one.residual, rtol=0.0, atol=1e-9 * size)
    np.testing.assert_allclose(other.local, one.local, rtol=0.0, atol=1e-9 * np.abs(one.local).max())
    np.testing.assert_allclose(other.measured, factor * one.measured, rtol=1e-9)


def test_a_sensor_that_shows_less_makes_nothing_larger(small):
    """What a reading of 0.95 of the displacement undoes is more of everything; per reading it is the same."""
    plain, _ = with_effects(small, ())
    sensed, _ = with_effects(small, (("sensor-gain", {}, {"gain": -0.05}),))
    names = [f.name for f in sensed.composition.shared]
    damping, gain = names.index("rig.damping"), names.index("sensor-gain.gain")
    point = replace(small.point, z=np.append(small.point.z, sensed.composition.shared[gain].inward(-0.05)))
    one, other = plain.evaluate(small.point), sensed.evaluate(point)
    fast = plain.phase == PHASES.index("slip")
    before, after = one.shared[fast, damping], other.shared[fast, damping]
    np.testing.assert_allclose(after, before, rtol=0.0, atol=5e-3 * np.abs(before).max())
    assert np.abs(other.measured - one.measured).max() > 0.01 * np.abs(one.measured).max()


def test_phases_act_on_their_own_run(placed):
    problem, point, slopes = placed
    a, runs = point.z.size, len(problem.runs)
    assert point.phases.shape == (len(problem.composition.phases), runs)
    for j in range(point.phases.shape[0]):
        for r in range(runs):
            exact = slopes.shared[:, a + j * runs + r]
            assert np.all(exact[problem.run != r] == 0.0)
            assert disagreement(problem, point, "phases", (j, r), 1.0, exact) < AGREE


def test_weights(placed):
    problem, point, slopes = placed
    first = point.z.size + point.phases.size
    for k in (2, 11, 20, 29, 38):
        exact = slopes.shared[:, first + k]
        assert disagreement(problem, point, "weights", k, point.weights.sum(), exact) < AGREE


def test_what_cycles_share(placed):
    problem, point, slopes = placed
    first = point.z.size + point.phases.size + point.weights.size
    cycles = np.flatnonzero(np.abs(slopes.shared[:, first:]).max(axis=0) > 0.0)
    for c in cycles[[1, cycles.size // 2, -2]]:
        exact = slopes.shared[:, first + c]
        assert disagreement(problem, point, "common", c, 1e-6, exact) < AGREE


def shared_by_two(problem) -> np.ndarray:
    """Points in the middle of a slip whose test function reaches into the next event, shape (p,)."""
    reaches = []
    for run in problem.runs:
        of_knot = np.minimum(run.event, run.events)
        apart = (run.mean != 0).multiply(of_knot[None, :] != run.of[:, None])
        reaches.append(np.asarray(apart.sum(axis=1)).ravel() > 0)
    return np.concatenate(reaches)


@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 1, 2, 3], ids=LOCAL)
def test_an_event_moves_its_own_points_alone(placed, which):
    """The derivative in an event's own number, but for the few points that lie in two events."""
    problem, point, slopes = placed
    unit = (1.0, 1.0, 1.0, 1e-6)[which]
    both = shared_by_two(problem)
    # a test function reaches over 2 h, the cubics of its ends over h / 6 more each, and points are 0.4 h apart
    assert both.sum() <= np.ceil((2.0 + 2.0 / 6.0) / 0.4) * problem.events
    for e in (0, 2, 4, problem.events - 1):
        own, other = (problem.of == e) & ~both, (problem.of != e) & ~both
        size = np.abs(slopes.local[own, which]).max()
        wrong, leaks = np.inf, np.inf
        for step in LADDER * unit:
            up = problem.evaluate(moved(point, "events", (e, which), step)).residual
            down = problem.evaluate(moved(point, "events", (e, which), -step)).residual
            slope = (up - down) / (2.0 * step)
            wrong = min(wrong, float(np.mean(np.abs(slope - slopes.local[:, which])[own])) / size)
            leaks = min(leaks, float(np.abs(slope[other]).max()) / size)
        assert wrong < AGREE
        assert leaks < 1e-3


@pytest.mark.slow
def test_a_common_error_leaves_the_other_derivatives_as_they_are(placed):
    """In a search: what carries it to a force stays as it is."""
    problem, point, slopes = placed
    problem = problem.carried_by(carrier(problem, slopes, by_reading(problem, point, slopes)))
    common = 1e-9 * np.random.default_rng(4).standard_normal(point.common.size)
    point = replace(point, common=common)
    slopes = problem.evaluate(point)
    for i in range(point.z.size):
        assert disagreement(problem, point, "z", i, 1.0, slopes.shared[:, i]) < AGREE


def test_the_held_force_is_the_sum_of_its_elements(placed):
    problem, point, slopes = placed
    first = point.z.size + point.phases.size
    shares = -slopes.shared[:, first : first + point.weights.size]
    heavier = np.where(
        problem.phase == PHASES.index("creep"), 1.0, 1.0 + problem.values(point).get("inertia.share", 0.0)
    )
    np.testing.assert_allclose(heavier * (shares @ point.weights), slopes.held, rtol=1e-12, atol=1e-14)


def test_forces_alone_are_those_that_come_with_all_derivatives(placed):
    problem, point, slopes = placed
    alone, whole = problem.forces(point), vars(slopes)
    for name, value in vars(alone).items():
        for one, other in zip(*([v] if isinstance(v, np.ndarray) else v for v in (value, whole[name])), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-14 * max(float(np.abs(other).max()), 1.0))
