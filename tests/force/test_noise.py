"""Noise of single samples in the residual force: what the covariance says is what trials show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.inference.force.fit import fit
from stickslip.inference.force.knots import NUCLEATION, RING, SLIP, knots
from stickslip.inference.force.noise import by_reading, noise, periodic, remembered
from stickslip.inference.force.problem import Problem
from stickslip.inference.force.scatter import Blocks
from stickslip.physics.sensor.chain import FRINGE

TRIALS = 120
SMALL = 1e-12  # m, so that nothing but the linear answer is seen


def test_noise_of_the_samples_reaches_the_force_as_stated(small):
    """Near the contact's resonance spring and inertia undo each other: parts taken one by one would say far more."""
    problem = small.problem
    point = fit(problem, small.point).point
    blocks = Blocks.of(problem.of, problem.events)
    slopes = problem.evaluate(point)
    rng, drawn = np.random.default_rng(4), []
    for _ in range(TRIALS):
        shaken = [
            knots(t, s, small.times, SMALL * rng.standard_normal(t.time.size))
            for t, s in zip(small.traces, small.found, strict=True)
        ]
        drawn.append(Problem(problem.composition, shaken).evaluate(point).residual - slopes.residual)
    levels = np.concatenate([np.full(k.at.size, k.noise) for k in problem.runs])
    seen = blocks(np.stack(drawn, axis=1) / SMALL * levels[:, None])
    stated, local = noise(problem, by_reading(problem, point, slopes), blocks), blocks(slopes.local)
    variances, along, apart = [], [], []
    for e, phase in enumerate(blocks(problem.phase)):
        ringing = np.flatnonzero((phase == RING) & blocks.there[e])
        if ringing.size < 10:
            continue
        # the error of the position at the arrest is an effect of its own in the model of what is random
        offset = local[e, ringing, 3] / np.linalg.norm(local[e, ringing, 3])
        without = np.eye(ringing.size) - np.outer(offset, offset)
        shown, told = without @ seen[e][ringing], without @ stated[e][np.ix_(ringing, ringing)] @ without
        variances.append(np.mean(shown**2, axis=1) / np.diag(told))
        values, vectors = np.linalg.eigh(told)
        along.append(np.median((np.mean((vectors.T @ shown) ** 2, axis=1) / values)[1:]))
        apart.append(values[1] / values[-1])
    assert len(variances) > 4
    assert 0.85 < np.median(np.concatenate(variances)) < 1.2
    # where an element stands just at its cap as the block turns, the force's kink answers: in few events of all
    assert 0.7 < np.median(along) < 1.6
    assert np.median(apart) < 1e-2  # what is left near the resonance, to what there is away from it


def test_a_spring_of_the_run_counts_as_that_of_the_rig_does(small):
    problem, point = small.problem, small.point
    blocks = Blocks.of(problem.of, problem.events)
    stiffness = problem.composition.fixed["rig.spring_stiffness"]
    fixed = {**problem.composition.fixed, "rig.spring_stiffness": 0.1 * stiffness}
    own = Problem(replace(problem.composition, fixed=fixed), [replace(k, stiffness=stiffness) for k in problem.runs])
    found = [noise(p, by_reading(p, point, p.evaluate(point)), blocks) for p in (problem, own)]
    np.testing.assert_allclose(*found, rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_an_error_periodic_within_a_fringe_reaches_the_force_as_stated(small, turn):
    """A small one is added to the reading: what it does to the residuals lies in the span of what is stated.

    Of a contact that slip does not weaken: that an error of the path weakens it is not carried.
    """
    problem = small.problem
    z = small.point.z.copy()
    place = next(i for i, f in enumerate(problem.composition.shared) if f.name == "weakening.drop")
    z[place] = problem.composition.shared[place].inward(1e-9)
    point = replace(small.point, z=z)
    blocks, slopes = Blocks.of(problem.of, problem.events), problem.evaluate(point)
    shaken = []
    for trace, found, k in zip(small.traces, small.found, problem.runs, strict=True):
        phase = 2.0 * np.pi * k.samples / FRINGE
        error = SMALL * (np.sin(phase + turn) + 0.25 * np.cos(2.0 * phase - turn))
        shaken.append(knots(trace, found, small.times, error))
    seen = blocks(Problem(problem.composition, shaken).evaluate(point).residual - slopes.residual)
    stated = periodic(problem, by_reading(problem, point, slopes), blocks)
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
    assert checked > 4 and np.median(explained) > 0.99


def test_an_element_remembers_where_it_last_slid():
    """Two elements there and back: the first slides at knots 1 and 4, the second never."""
    slides = np.array([[False, False], [True, False], [False, False], [False, False], [True, False], [False, False]])
    elements, stiffness = np.array([3.0, 5.0]), np.array([8.0, 5.0, 8.0, 16.0, 5.0, 8.0])
    found = remembered(elements, stiffness, slides).toarray()
    wanted = np.zeros((6, 6))
    wanted[2, 1], wanted[3, 1], wanted[5, 4] = 3.0, 6.0, 3.0  # at knot 3 the event's elements are twice as stiff
    np.testing.assert_allclose(found, wanted)
