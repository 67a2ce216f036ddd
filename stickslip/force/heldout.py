"""How well events are predicted that a fit has not seen: leave one run out, without fitting again.

At the optimum the model is linear enough in its parameters that what a fit without some events would give is one
Gauss-Newton step away (the infinitesimal jackknife made exact for a linear model). A run that has parameters of its
own, a phase or the pull at its start, is left out by halves: they are told by its other half.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fit import Array, Fit, prior_rows, reach
from .scatter import covariance


@dataclass(frozen=True)
class Unseen:
    """Prediction of events left out.

    Attributes:
        cost: twice the negative logarithm of the predictive likelihood of each event, shape (E,).
        residual: residual force of the prediction, events alike (N), shape (p,).
    """

    cost: Array
    residual: Array


def folds(fit: Fit) -> list[NDArray[np.intp]]:
    """Events that are left out together."""
    problem = fit.problem
    runs = [np.flatnonzero(problem.event_run == r) for r in range(len(problem.runs))]
    if not problem.composition.phases and len(runs) > 2:
        return [r for r in runs if r.size]
    return halves(fit)


def halves(fit: Fit) -> list[NDArray[np.intp]]:
    """The events of either half of every run."""
    problem = fit.problem
    runs = [np.flatnonzero(problem.event_run == r) for r in range(len(problem.runs))]
    return [half for r in runs for half in np.array_split(r, 2) if half.size]


def unseen(fit: Fit, left_out: list[NDArray[np.intp]] | None = None) -> Unseen:
    """Predict every fold from the others."""
    _, whole = covariance(fit.scatter.sizes, fit.known)
    root = np.linalg.cholesky(np.asarray(whole))
    low, high = reach(fit.problem, fit.point)
    free = np.flatnonzero((low < 0.0) & (high > 0.0))
    blocks = fit.blocks
    side = np.concatenate([blocks(fit.slopes.shared)[..., free], blocks(fit.marginal)[..., None]], axis=2)
    white = np.linalg.solve(root, side)
    rows, rest = white[..., :-1], white[..., -1]
    prior, target = prior_rows(fit.problem, fit.point)
    prior = prior[:, free]
    each = np.einsum("eip,eiq->epq", rows, rows)
    slope = np.einsum("eip,ei->ep", rows, rest)
    normal, right = each.sum(axis=0) + prior.T @ prior, slope.sum(axis=0) + prior.T @ target
    logs = 2.0 * np.where(fit.known.there, np.log(np.diagonal(root, axis1=1, axis2=2)), 0.0).sum(axis=1)
    cost, out = np.zeros(len(rest)), np.zeros(fit.problem.of.size)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    for part in left_out or folds(fit):
        matrix = (normal - each[part].sum(axis=0)) * scale[:, None] * scale + 1e-10 * np.eye(len(scale))
        step = -scale * np.linalg.solve(matrix, scale * (right - slope[part].sum(axis=0)))
        predicted = rest[part] + rows[part] @ step
        cost[part] = (predicted**2).sum(axis=1) + logs[part]
        force = blocks(fit.marginal)[part] + blocks(fit.slopes.shared)[part][..., free] @ step
        there = blocks.there[part]
        out[blocks.index[part][there]] = force[there]
    return Unseen(cost, out)
