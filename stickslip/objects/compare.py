"""Fits of the same runs side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ..errors import InputError
from ..inference.diagnose.decide import standard_error
from ..inference.force.errors import of_all, sums
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.fit import deviations
from ..inference.force.heldout import folds, halves, heldout_residual, unseen
from ..inference.force.noise import left_out as outlying
from ..system.object_repr import table
from .fit import Fit

if TYPE_CHECKING:
    import pandas

LEAST = 1e-6  # share of a mixture that is one


def compare(fits: Mapping[str, Fit]) -> pandas.DataFrame:
    """Fits of the same runs, the one that predicts unseen runs best first.

    Args:
        fits: by a name of each, such as ``{"with": fit, "without": fit.remove("wear")}``.

    Returns:
        A row for each: ``model``; ``error`` and ``unseen error`` in floors of the first one, with their standard
        deviations; ``behind``, twice the difference in log-likelihood of the left-out runs (each left out in turn) to
        the first row, and ``+-``, its standard error from event to event. Fits within two or three of it predict
        equally well. ``weight`` is the share of each in the mixture that predicts the left-out events best (stacking,
        Yao et al., Bayesian Analysis 13 (2018) 917): one that adds nothing to the others has none. What is an outlier
        in one of the fits counts in no likelihood.

    Raises:
        InputError: no fit, fits without names, fits of other runs, or a single event, which leaves nothing to predict
            it from.
    """
    allowed = 'fits by name, {"base": campaign.fit(), ...}'
    if not isinstance(fits, Mapping):
        raise InputError("fits are compared by their names", key="fits", value=type(fits).__name__, allowed=allowed)
    if not fits:
        raise InputError("there is nothing to compare", allowed=allowed)
    first, *others = fits.values()
    problem = first.force_fit.problem
    for name, other in zip([*fits][1:], others, strict=True):
        same = np.array_equal(problem.of, other.force_fit.problem.of)  # the points of every event
        if not same or first.campaign.inputs() != other.campaign.inputs():
            raise InputError(f"'{name}' is a fit of other runs than '{next(iter(fits))}'", hint="fit the same campaign")
    if problem.events < 2:
        raise InputError("one event cannot be predicted from others", hint="measure more slips")
    own = any(fit.force_fit.problem.composition.phases for fit in fits.values())
    left_out = (halves if own else folds)(first.force_fit)
    found = on_the_same_points({name: fit.force_fit for name, fit in fits.items()})
    costs = {name: unseen(fit, left_out).cost for name, fit in found.items()}
    order = sorted(fits, key=lambda name: float(costs[name].sum()))
    best = fits[order[0]].force_fit
    floor = deviations(best)
    rows, shares = {}, stacked(np.array([-0.5 * costs[name] for name in order]))
    for share, name in zip(shares, order, strict=True):
        fit, worse = fits[name].force_fit, costs[name] - costs[order[0]]
        error, std = of_all(sums(best, fit.marginal, floor))
        unseen_error, unseen_std = of_all(sums(best, heldout_residual(fit), floor))
        rows[name] = {
            "model": " + ".join(fits[name].parts), "error": error, "error std": std, "unseen error": unseen_error,
            "unseen std": unseen_std, "weight": share, "behind": float(worse.sum()), "+-": standard_error(worse),
        }  # fmt: skip
    return table(rows, "fit")


def on_the_same_points(fits: Mapping[str, ForceFit]) -> dict[str, ForceFit]:
    """Fits without what is an outlier in any of them: each has found its own, and a point left out costs likelihood."""
    dropped = np.any([fit.dropped for fit in fits.values()], axis=0)

    def reduced(fit: ForceFit) -> ForceFit:
        known = fit.known.without(fit.blocks(outlying(fit.problem, dropped)))
        return replace(fit, known=known, dropped=dropped)

    return {name: reduced(fit) for name, fit in fits.items()}


def stacked(densities: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares of models in the mixture under which left-out events are most likely, shape (m,).

    Args:
        densities: logarithm of each model's density of each event, shape (m, E); nan gives nan.
    """
    likely = np.exp(densities - densities.max(axis=0))
    if not np.isfinite(likely).all():
        return np.full(len(densities), np.nan)

    def surprise(shares: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        mixed = shares @ likely
        return -float(np.log(mixed).mean()), -(likely / mixed).mean(axis=1)

    count = len(likely)
    found = minimize(
        surprise, np.full(count, 1.0 / count), jac=True, method="SLSQP", bounds=[(1e-12, 1.0)] * count,
        constraints={"type": "eq", "fun": lambda shares: shares.sum() - 1.0, "jac": np.ones_like},
        options={"maxiter": 1000, "ftol": 1e-12},
    )  # fmt: skip
    shares = np.where(found.x > LEAST, found.x, 0.0)
    return np.asarray(shares / shares.sum())
