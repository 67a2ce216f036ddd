"""Events left out are predicted as a fit without them would: at a linear problem one step is that fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.stats import multivariate_normal

from stickslip.inference.force.fit import fit, refit
from stickslip.inference.force.heldout import folds, points, unseen
from stickslip.inference.force.linearised import prior_rows, reach
from stickslip.inference.force.scatter import NAMES, Scatter

from .dense_covariance import dense
from .test_derivatives import EFFECTS, with_effects


@pytest.fixture(scope="module")
def fitted(small):
    return fit(small.problem, small.point, rounds=4)


def refitted(fit, left_out):
    """Residuals of the events left out by explicit least squares over the others and the priors, and their density."""
    blocks, whole = fit.blocks, dense(fit.scatter.sizes, fit.known)
    there = blocks.there.ravel()
    of = np.repeat(np.arange(fit.problem.events), blocks.there.shape[1])[there]
    point, whole = blocks.index.ravel()[there], whole[np.ix_(there, there)]
    low, high = reach(fit.problem, fit.point)
    free = (low < 0.0) & (high > 0.0)
    prior, target = prior_rows(fit.problem, fit.point)
    rows, rest = [prior[:, free]], [target]
    seen, hidden = ~np.isin(of, left_out), np.isin(of, left_out)
    root = np.linalg.cholesky(whole[np.ix_(seen, seen)])
    rows.append(np.linalg.solve(root, fit.slopes.shared[point[seen]][:, free]))
    rest.append(np.linalg.solve(root, fit.marginal[point[seen]]))
    a, b = np.vstack(rows), np.concatenate(rest)
    scale = np.sqrt((a**2).sum(axis=0))
    found = lsq_linear(a / scale, -b, (low[free] * scale, high[free] * scale), method="bvls", tol=1e-14)
    step, inside = found.x / scale, found.active_mask == 0
    covariance = np.linalg.pinv(((a / scale)[:, inside]).T @ (a / scale)[:, inside], hermitian=True)
    slopes = fit.slopes.shared[point[hidden]][:, free]
    out, unsure = fit.marginal[point[hidden]] + slopes @ step, (slopes / scale)[:, inside]
    root = np.linalg.cholesky(whole[np.ix_(hidden, hidden)])
    white, unsure, cost = np.linalg.solve(root, out), np.linalg.solve(root, unsure), 2.0 * np.log(np.diag(root)).sum()
    for event in left_out:
        own = of[hidden] == event
        spread = np.eye(own.sum()) + unsure[own] @ covariance @ unsure[own].T
        cost -= 2.0 * multivariate_normal(np.zeros(own.sum()), spread).logpdf(white[own]) + own.sum() * np.log(
            2 * np.pi
        )
    return point[hidden], out, cost


def test_a_run_left_out_is_predicted_as_least_squares_without_it(fitted):
    """The density of each event by itself too, where no walk of the sensor makes it a matter of their order."""
    sizes = fitted.scatter.sizes - 8.0 * (np.array(NAMES) == "walk")
    for found, exact in ((fitted, False), (replace(fitted, scatter=Scatter(sizes)), True)):
        parts = [np.flatnonzero(found.problem.event_run == r) for r in (1, 0)]
        predicted = unseen(found, parts)
        for part in parts:
            own, force, cost = refitted(found, part)
            np.testing.assert_allclose(predicted.residual[own], force, atol=2e-5 * found.strength)
            if exact:
                assert predicted.cost[part].sum() == pytest.approx(cost, abs=0.005)


def test_what_was_not_seen_is_predicted_less_well_than_what_was(fitted):
    predicted = unseen(fitted)
    assert predicted.cost.sum() > fitted.likelihood.sum()
    assert np.all(np.isfinite(predicted.cost))
    nothing = unseen(fitted, [np.array([], int)])
    assert not nothing.residual.any()


def test_a_model_is_run_with_what_a_fit_without_the_events_finds(fitted):
    """The force at its parameters is what is predicted to first order, and the others are described no worse."""
    parts, predicted = folds(fitted), unseen(fitted).residual
    problem, sd = fitted.problem, np.sqrt(np.diag(fitted.covariance))[: fitted.point.z.size]
    for part, point in zip(parts, points(fitted, parts), strict=True):
        hidden = np.isin(problem.of, part)
        found = problem.forces(point).residual
        gap = np.linalg.norm(found[hidden] - predicted[hidden])
        assert gap < 0.15 * np.linalg.norm(predicted[hidden])
        assert gap < 0.5 * np.linalg.norm(found[hidden] - fitted.marginal[hidden])  # of what saw them
        assert not point.events.any()
        away = fitted.forces.residual + 0.05 * fitted.strength * hidden  # which a fit that does not see them ignores
        (other,) = points(replace(fitted, forces=replace(fitted.slopes, residual=away)), [part])
        assert np.abs((other.z - point.z) / sd).max() < 0.3


def test_every_event_is_left_out_once(fitted):
    parts = folds(fitted)
    assert sorted(np.concatenate(parts).tolist()) == list(range(fitted.problem.events))


def test_runs_with_phases_are_left_out_by_halves(small, fitted):
    problem, point = with_effects(small, EFFECTS["effects"])
    found = refit(problem, point, fitted)
    parts = folds(found)
    assert len(parts) == 2 * len(problem.runs)
    for part in parts:
        assert np.unique(problem.event_run[part]).size == 1
        assert part.size < np.count_nonzero(problem.event_run == problem.event_run[part[0]])
    assert np.all(np.isfinite(unseen(found).cost))
