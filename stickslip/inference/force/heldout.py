"""How well events are predicted that a fit has not seen: leave one run out, without fitting again.

At the optimum the model is linear enough in its parameters that what a fit without some events would give is one
Gauss-Newton step away (the infinitesimal jackknife made exact for a linear model). A run that has parameters of its
own, a phase or the pull at its start, is left out by halves: they are told by its other half.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .fit import STEPS, Fit, refit
from .linearised import Array, Linearised, moved, prior_rows, reach
from .problem import Point
from .scatter import Whitening

SHARES = (1.0, 0.5, 0.25, 0.1)  # of the step to what a fit without some events would give


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


class _Parts:
    """The linear system at the optimum, event by event, so that any of them can be taken out."""

    def __init__(self, fit: Fit) -> None:
        self.fit = fit
        white = fit.white
        self.low, self.high = reach(fit.problem, fit.point)
        self.free = np.flatnonzero((self.low < 0.0) & (self.high > 0.0))
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

    def without(self, part: NDArray[np.intp]) -> tuple[Array, Array]:
        """Matrix and right side, scaled, of all events but these."""
        matrix = (self.normal - self.each[part].sum(axis=0)) * self.scale[:, None] * self.scale
        return matrix + 1e-10 * np.eye(len(self.scale)), self.scale * (self.right - self.slope[part].sum(axis=0))


def unseen(fit: Fit, left_out: list[NDArray[np.intp]] | None = None) -> Unseen:
    """Predict every fold from the others."""
    parts, blocks = _Parts(fit), fit.blocks
    cost, out = np.zeros(len(parts.rest)), np.zeros(fit.problem.of.size)
    for part in left_out or folds(fit):
        matrix, right = parts.without(part)
        step = -parts.scale * np.linalg.solve(matrix, right)
        predicted = parts.rest[part] + parts.rows[part] @ step
        cost[part] = (predicted**2).sum(axis=1) + parts.logs[part]
        force = blocks(fit.marginal)[part] + blocks(fit.slopes.shared)[part][..., parts.free] @ step
        there = blocks.there[part]
        out[blocks.index[part][there]] = force[there]
    return Unseen(cost, out)


def points(fit: Fit, left_out: list[NDArray[np.intp]]) -> list[Point]:
    """The parameters that a fit without each of these folds would find, within their bounds; all events alike.

    The step of :func:`unseen` would do for the force, but a model is to be run with them: where a parameter hardly
    counts the step is far, and the valley is bent. So it is gone as far as it lowers the cost of the other events, and
    a few steps of a fit follow.
    """
    alike, out = np.zeros_like(fit.point.events), []
    for part in left_out:
        hidden = np.where(np.isin(fit.problem.of, part), fit.known.strength**2, 0.0)  # which takes their weight
        apart = replace(fit, known=replace(fit.known, dropped=np.maximum(fit.known.dropped, fit.blocks(hidden))))
        system = Linearised(
            fit.problem, fit.point, fit.slopes, fit.scatter, fit.blocks, Whitening(fit.scatter.sizes, apart.known)
        )
        change, _, _ = system.step()
        ways = [moved(fit.point, share * change, system.events_after(share * change)) for share in SHARES]
        start = min(ways, key=lambda point: system.objective(point, fit.problem.forces(point)))
        out.append(replace(refit(fit.problem, start, apart, STEPS).point, events=alike))
    return out
