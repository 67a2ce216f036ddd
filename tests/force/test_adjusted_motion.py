"""Noise of the readings, found from what it did to the forces, and the fit along the motion without it."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.data.segment import segment
from stickslip.inference.diagnose.prepare import prepare
from stickslip.inference.force.fit import fit, fit_base
from stickslip.inference.force.noise import by_reading, reading_errors
from stickslip.inference.force.signatures import Explained, signatures
from stickslip.physics.effects.contact_damping import ContactDamping

from .counted_motions import moved, read

pytestmark = pytest.mark.slow

READINGS = 6


@pytest.fixture(scope="module")
def runs():
    return [moved(*s, tolerance=1e-5, damping=8.0, healing_time=8e-3) for s in ((1e-4, 5.0), (2e-4, 2.8))]


@pytest.fixture(scope="module")
def fits(runs):
    """Fits along the motion as it was smoothed and along the adjusted one, for readings with white noise alone."""
    out = []
    for seed in range(READINGS):
        campaign = read(runs, seed, noise=2.6e-9, count=0.0)
        prepared = prepare(campaign.description, campaign.traces, [segment(t) for t in campaign.traces])
        out.append([make(prepared.problem, prepared.start) for make in (fit, fit_base)])
    return out


def test_errors_of_the_reading_are_found_from_the_forces_they_make(fits):
    """The best linear estimate: it does not go with its own error, and is smaller than what it estimates by that."""
    found = fits[0][0]
    problem, rng = found.problem, np.random.default_rng(5)
    rows = by_reading(problem, found.point, found.slopes)
    covariances, samples = [], []
    for run, row in zip(problem.runs, rows, strict=True):
        spread = run.noise * np.sqrt(run.reading.count)
        scaled = row.toarray() * spread
        covariances.append(scaled @ scaled.T + 1e-12 * np.eye(len(scaled)))
        samples.append(spread * rng.standard_normal((200, spread.size)))
    products = np.zeros(3)  # of estimate and estimate, estimate and truth, truth and truth
    weighted = [
        np.linalg.solve(s, -(e @ row.T).T - 1e-6 * rng.standard_normal((len(s), 200)))
        for s, e, row in zip(covariances, samples, rows, strict=True)
    ]
    for i in range(200):
        estimates = reading_errors(problem, rows, np.concatenate([w[:, i] for w in weighted]), 1.0)
        for run, e, estimate in zip(problem.runs, samples, estimates, strict=True):
            true = run.reading.displacement @ e[i]
            products += [estimate @ estimate, estimate @ true, true @ true]
    assert products[1] == pytest.approx(products[0], rel=0.02)
    assert 0.1 < products[0] / products[2] < 0.9


def test_the_adjusted_motion_is_nearer_to_the_true_one(runs, fits):
    for pair in fits:
        for run, before, after in zip(runs, *(f.problem.runs for f in pair), strict=True):
            true = run.course(before.t)
            raw, adjusted = (float(np.std(k.x - true)) for k in (before, after))
            assert adjusted < 0.9 * raw


def test_what_errors_do_to_residuals_stays_in_them_but_for_what_is_even(fits):
    """To first order they stay: half the errors change them by a quarter."""
    before, after = fits[0]
    problem, point = before.problem, before.point
    changes = []
    for share in (0.02, 0.01):
        small = problem.adjusted([share * e for e in after.problem.errors], point)
        changes.append(np.std(small.forces(point).residual - before.forces.residual))
    assert changes[1] < 0.4 * changes[0]  # half, if the force they make were not in them
    for run, other, error in zip(problem.runs, after.problem.runs, after.problem.errors, strict=True):
        np.testing.assert_allclose(run.x - other.x, error, atol=1e-15)


def test_a_damping_of_the_contact_that_is_not_there_is_not_seen(fits):
    """Noise in the motion that drives the model dissipates, by as much in every reading."""
    effect = ContactDamping()

    def seen(found):
        explained = Explained(found)
        _, value, std = explained.singly(explained.orthogonal(signatures(found, effect, [{}]).T))
        return float(value[0] / std[0])

    before, after = (np.mean([seen(pair[i]) for pair in fits]) for i in range(2))
    assert before < -1.0 and abs(after) < 0.5 * abs(before)
