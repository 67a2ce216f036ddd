"""Noise of single samples in the residual force: what the covariance says is what trials show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.blind.generator.rigs import draw_setup
from stickslip.blind.generator.sensor import SILENT
from stickslip.inference.force.fit import fit
from stickslip.inference.force.knots import CREEP, NUCLEATION, PHASES, RING, SLIP, knots
from stickslip.inference.force.noise import by_reading, noise, periodic, remembered, weakened
from stickslip.inference.force.problem import Problem
from stickslip.physics.effects.base import Motion
from stickslip.physics.model import Weakening
from stickslip.physics.sensor.chain import FRINGE

from .conftest import made

TRIALS = 120
NOISE = 1e-9  # m
SMALL = 1e-12  # m, so that nothing but the linear answer is seen


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    """Two runs of four events with nothing hidden, read without noise, and the fit of them."""
    setup = draw_setup(np.random.default_rng(11))
    setup = replace(setup, sensor=replace(SILENT, count=1e-11))
    case = made(tmp_path_factory.mktemp("still") / "case", 11, spring_known=True, setup=setup)
    traces = [replace(t, noise=NOISE) for t in case.traces]
    thinned = [knots(t, s, case.times) for t, s in zip(traces, case.found, strict=True)]
    problem = Problem(case.problem.composition, thinned)
    return replace(case, traces=traces, problem=problem, point=fit(problem, case.point).point)


@pytest.mark.slow
def test_noise_of_the_samples_reaches_the_force_as_stated(still):
    """Draws, whitened with what is stated, event by event: near the contact's resonance spring and inertia undo each
    other, creep counts from the start, windows that go back share a mean, and slip takes friction away."""
    problem, point = still.problem, still.point
    blocks, slopes = problem.blocks, problem.evaluate(point)
    rng, drawn = np.random.default_rng(4), []
    for _ in range(TRIALS):
        shaken = [
            knots(t, s, still.times, NOISE * rng.standard_normal(t.time.size))
            for t, s in zip(still.traces, still.found, strict=True)
        ]
        drawn.append(Problem(problem.composition, shaken).evaluate(point).residual)
    seen = blocks((np.array(drawn) - np.mean(drawn, axis=0)).T)
    stated, phases = noise(problem, by_reading(problem, point, slopes)), blocks(problem.phase)
    for phase in (CREEP, NUCLEATION, SLIP, RING):
        squares, variances, apart = [], [], []
        for e in range(problem.events):
            own = np.flatnonzero((phases[e] == phase) & blocks.there[e])
            if own.size < 6:
                continue
            told = stated[e][np.ix_(own, own)]
            values, vectors = np.linalg.eigh(told)
            white = (vectors.T @ seen[e][own])[values > 1e-9 * values[-1]]
            squares.append(np.mean(white**2 / values[values > 1e-9 * values[-1], None]))
            variances.append(np.mean(seen[e][own] ** 2, axis=1) / np.diag(told))
            apart.append(values[0] / values[-1])
        assert len(squares) >= 6
        assert 0.85 < np.median(squares) < 1.15, PHASES[phase]
        assert 0.85 < np.median(np.concatenate(variances)) < 1.2, PHASES[phase]
        if phase == RING:
            assert np.median(apart) < 1e-2  # what is left near the resonance, to what there is away from it


def test_a_spring_of_the_run_counts_as_that_of_the_rig_does(small):
    problem, point = small.problem, small.point
    stiffness = problem.composition.fixed["rig.spring_stiffness"]
    fixed = {**problem.composition.fixed, "rig.spring_stiffness": 0.1 * stiffness}
    own = Problem(replace(problem.composition, fixed=fixed), [replace(k, stiffness=stiffness) for k in problem.runs])
    found = [noise(p, by_reading(p, point, p.evaluate(point))) for p in (problem, own)]
    np.testing.assert_allclose(*found, rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_an_error_periodic_within_a_fringe_reaches_the_force_as_stated(small, turn):
    """A small one is added to the reading: what it does to the residuals lies in the span of what is stated."""
    problem, point = small.problem, small.point
    blocks, slopes = problem.blocks, problem.evaluate(point)
    shaken = []
    for trace, found, k in zip(small.traces, small.found, problem.runs, strict=True):
        phase = 2.0 * np.pi * k.reading.samples / FRINGE
        error = SMALL * (np.sin(phase + turn) + 0.25 * np.cos(2.0 * phase - turn))
        shaken.append(knots(trace, found, small.times, error))
    seen = blocks(Problem(problem.composition, shaken).evaluate(point).residual - slopes.residual)
    stated = periodic(problem, by_reading(problem, point, slopes))
    fast = blocks(np.isin(problem.phase, [NUCLEATION, SLIP]))  # where hardly an element sticks, whose kinks answer
    explained, checked = [], 0
    for e, own in enumerate(fast & blocks.there):
        if own.sum() < 10:
            continue
        values, vectors = np.linalg.eigh(stated[e][np.ix_(own, own)])
        assert values[-5] < 1e-9 * values[-1]  # sine and cosine of the fringe and of its half
        span = vectors[:, -4:]
        part = span.T @ seen[e][own]
        explained.append((part**2).sum() / (seen[e][own] ** 2).sum())
        checked += 1
    assert checked > 4 and np.median(explained) > 0.998


def test_an_element_remembers_where_it_last_slid():
    """Two elements there and back: the first slides at knots 1 and 4, the second never, and counts from the start."""
    slides = np.array([[False, False], [True, False], [False, False], [False, False], [True, False], [False, False]])
    elements, stiffness = np.array([3.0, 5.0]), np.array([8.0, 5.0, 8.0, 16.0, 5.0, 8.0])
    found = remembered(elements, stiffness, slides).toarray()
    wanted = np.zeros((6, 6))
    wanted[:, 0] = 8.0, 5.0, 5.0, 10.0, 5.0, 5.0
    wanted[2, 1], wanted[3, 1], wanted[5, 4] = 3.0, 6.0, 3.0  # at knot 3 the event's elements are twice as stiff
    np.testing.assert_allclose(found, wanted)


@pytest.mark.slow
def test_the_path_weakens_as_the_law_of_friction_says():
    """A step of the reading at each knot in turn, through the law itself: at rest, in creep and in fast slip."""
    rng = np.random.default_rng(7)
    law = Weakening(ratio=0.8, slip_distance=1e-6, healing_time=5e-3)
    dt = np.concatenate([[0.0], rng.uniform(1e-4, 2e-3, 30)])
    creep, slip, back = rng.uniform(0.0, 2e-8, 10), rng.uniform(1e-8, 3e-7, 15), -rng.uniform(1e-8, 1e-7, 5)
    steps = np.concatenate([[0.0], creep, slip, back])

    def strength(steps):
        psi, out = np.ones(()), []
        for h, s in zip(dt, steps, strict=True):
            if h > 0.0:  # at a constant speed
                psi = law.advance(psi, Motion(0.0, h, 0.0, s / h, 0.0, s, 0.0))
            out.append(float(psi))
        return np.array(out)

    psi = strength(steps)
    sliding = np.where(steps < 0.0, -0.3, 0.3)
    x = np.cumsum(steps)
    found = weakened(np.cumsum(dt), x, sliding, psi, 0.8, 1e-6, 5e-3).toarray()
    small = 1e-13
    for j in range(1, x.size):
        moved, other = x.copy(), x.copy()
        moved[j], other[j] = x[j] + small, x[j] - small
        change = strength(np.diff(moved, prepend=0.0)) - strength(np.diff(other, prepend=0.0))
        wanted = sliding * 0.2 / (0.8 + 0.2 * psi) * change / (2.0 * small)
        np.testing.assert_allclose(found[:, j], wanted, atol=1e-2 * np.abs(found).max())
