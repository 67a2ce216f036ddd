"""How well events are predicted that a fit has not seen: leave one run out, without fitting again.

At the optimum the model is linear enough in its parameters that what a fit without some events would give is one
Gauss-Newton step away (the infinitesimal jackknife made exact for a linear model). What that fit would not know of its
parameters is part of the density by which an event is predicted. A run that has parameters of its
own, a phase or the pull at its start, is left out by halves: they are told by its other half.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from .fit import STEPS, Fit, deviations, refit
from .linearised import Array, Linearised, moved, prior_rows, reach
from .point import Point
from .whitening import Whitening, WithEvents

SHARES = (1.0, 0.5, 0.25, 0.1)  # of the step to what a fit without some events would give


@dataclass(frozen=True)
class Unseen:
    """Prediction of events left out.

    Attributes:
        cost: twice the negative logarithm of the predictive likelihood of each event, shape (E,).
        residual: residual force of the prediction, events equal (N), shape (p,).
        spread: standard deviation of the prediction by what the others do not tell (N), shape (p,).
    """

    cost: Array
    residual: Array
    spread: Array


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


class _Parts:
    """The linear system at the optimum, event by event, so that any of them can be taken out."""

    def __init__(self, fit: Fit, left_out: Sequence[NDArray[np.intp]]) -> None:
        self.fit = fit
        white = _parted(fit, left_out)
        low, high = reach(fit.problem, fit.point)
        self.free = np.flatnonzero((low < 0.0) & (high > 0.0))
        blocks = fit.blocks
        side = np.concatenate([blocks(fit.slopes.shared)[..., self.free], blocks(fit.marginal)[..., None]], axis=2)
        together = white(side)
        self.rows, self.rest = together[..., :-1], together[..., -1]
        prior, target = prior_rows(fit.problem, fit.point)
        prior = prior[:, self.free]
        self.each = np.einsum("eip,eiq->epq", self.rows, self.rows)
        self.slope = np.einsum("eip,ei->ep", self.rows, self.rest)
        self.normal = self.each.sum(axis=0) + prior.T @ prior
        self.right = self.slope.sum(axis=0) + prior.T @ target
        self.logs = white.logs
        self.scale = 1.0 / np.sqrt(np.maximum(np.diag(self.normal), 1e-300))
        self.low, self.high = low[self.free] / self.scale, high[self.free] / self.scale

    def without(self, part: NDArray[np.intp]) -> tuple[Array, Array]:
        """What all events but these say of the parameters.

        Returns:
            The step to their optimum, within the bounds, shape (q,), and the standard deviations of independent
            combinations of what does not stand at a bound there, shape (q, r).
        """
        matrix = (self.normal - self.each[part].sum(axis=0)) * self.scale[:, None] * self.scale
        right = self.scale * (self.right - self.slope[part].sum(axis=0))
        root = np.linalg.cholesky(matrix + 1e-10 * np.eye(len(matrix)))
        target = -np.linalg.solve(root, right)
        step = np.linalg.solve(root.T, target)
        inside = np.ones(step.size, bool)
        if (step < self.low).any() or (step > self.high).any():
            found = lsq_linear(root.T, target, (self.low, self.high), method="bvls")
            step, inside = found.x, found.active_mask == 0
            root = np.linalg.cholesky((matrix + 1e-10 * np.eye(len(matrix)))[np.ix_(inside, inside)])
        unsure = np.zeros((step.size, len(root)))
        unsure[inside] = np.linalg.inv(root).T
        return self.scale * step, self.scale[:, None] * unsure


def _parted(fit: Fit, left_out: Sequence[NDArray[np.intp]]) -> WithEvents:
    """Whitens residuals of events whose level does not go on from one fold to another: none is told by another one."""
    chain = fit.known.chain
    if chain is None:
        return fit.white
    fold = np.full(chain.group.size, -1)
    for i, part in enumerate(left_out):
        fold[part] = i
    _, group = np.unique(np.stack([chain.group, fold]), axis=1, return_inverse=True)
    known = fit.known.following(replace(chain, group=group.ravel()))
    return Whitening(fit.scatter.sizes, known).with_events(known.local)


def unseen(fit: Fit, left_out: list[NDArray[np.intp]] | None = None) -> Unseen:
    """Predict every fold from the others."""
    left_out = left_out or folds(fit)
    parts, blocks = _Parts(fit, left_out), fit.blocks
    cost, (residual, spread) = np.zeros(len(parts.rest)), np.zeros((2, fit.problem.of.size))
    for part in left_out:
        step, unsure = parts.without(part)
        predicted = parts.rest[part] + parts.rows[part] @ step
        cost[part] = _predictive(predicted, parts.rows[part] @ unsure) + parts.logs[part]
        own = blocks.index[part][blocks.there[part]]
        slopes = fit.slopes.shared[own][:, parts.free]
        residual[own] = fit.marginal[own] + slopes @ step
        spread[own] = np.sqrt(((slopes @ unsure) ** 2).sum(axis=1))
    return Unseen(cost, residual, spread)


def heldout_residual(fit: Fit) -> Array:
    """Residual force of runs left out, events equal (N), shape (p,), to be seen over the floor.

    It is as much smaller as the deviation of the prediction is larger than the floor: where only one run tells a
    parameter, that run's being off is no error of the model. Not a number where there is one event only.
    """
    if fit.problem.events < 2:
        return np.full(fit.problem.of.size, np.nan)
    held, floor = unseen(fit), deviations(fit)
    return held.residual * floor / np.hypot(floor, held.spread)


def _predictive(predicted: Array, unsure: Array) -> Array:
    """Twice the negative logarithm of the density of each event's whitened residuals, without what whitens them.

    What the others do not tell, such as the level of the strength where only the run left out begins with a virgin
    contact, is no error of a model that does not know it: ``S = 1 + U U'`` with what is not known of the parameters.

    Args:
        predicted: residuals with the parameters that the others tell, shape (e, n).
        unsure: what a standard deviation of each independent combination of the parameters does, shape (e, n, p).
    """
    inner = np.swapaxes(unsure, 1, 2) @ unsure + np.eye(unsure.shape[2])
    root = np.linalg.cholesky(inner)
    along = np.linalg.solve(root, np.einsum("enp,en->ep", unsure, predicted)[..., None])[..., 0]
    logs = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    return np.asarray((predicted**2).sum(axis=1) - (along**2).sum(axis=1) + logs)


def points(fit: Fit, left_out: list[NDArray[np.intp]]) -> list[Point]:
    """The parameters that a fit without each of these folds would find, within their bounds; all events equal.

    The step of :func:`unseen` would do for the force, but a model is to be run with them: where a parameter hardly
    counts the step is far, and the valley is bent. So it is gone as far as it lowers the cost of the other events, and
    a few steps of a fit follow.
    """
    equal_events, out = np.zeros_like(fit.point.events), []
    for part in left_out:
        hidden = np.where(np.isin(fit.problem.of, part), fit.known.strength**2, 0.0)  # which takes their weight
        reduced = replace(fit, known=replace(fit.known, dropped=np.maximum(fit.known.dropped, fit.blocks(hidden))))
        system = Linearised(
            fit.problem, fit.point, fit.slopes, fit.scatter, Whitening(fit.scatter.sizes, reduced.known)
        )
        change, _, _ = system.step()
        ways = [moved(fit.point, share * change, system.events_after(share * change)) for share in SHARES]
        start = min(ways, key=lambda point: system.objective(point, fit.problem.forces(point)))
        out.append(replace(refit(fit.problem, start, reduced, STEPS).point, events=equal_events))
    return out
