"""Tables of a fit: its parameters, its errors by phase of the cycle and run, the models on the way to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..inference.force.errors import Sums, of_all
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.knots import PHASES
from ..inference.force.prescribed import placeholders
from ..system.object_repr import table

if TYPE_CHECKING:
    import pandas

    from .fit import Fit

STRENGTH = "contact.strength"
MEANINGS = {
    STRENGTH: "friction force of all contacts at full strength",
    "rig.mass": "mass of the block",
    "rig.spring_stiffness": "stiffness of the driving spring",
}
UNITS = {STRENGTH: "N", "rig.mass": "kg", "rig.spring_stiffness": "N/m"}


def parameter_table(fit: Fit) -> pandas.DataFrame:
    """See :attr:`stickslip.Fit.parameters`."""
    free = {f.name: f for f in fit.free}
    unused = placeholders(fit.force_fit.problem, fit.campaign.rig)
    rows: dict[str, dict[str, Any]] = {}
    for name, value in fit.values.items():
        if name in unused:
            continue
        f = free.get(name)
        rows[name] = {
            "value": value,
            "std": fit.std.get(name, 0.0),
            "unit": f.unit if f is not None else UNITS.get(name, "1"),
            "prior": "measured" if name == STRENGTH else "given" if f is None else f.known,
            "meaning": f.doc if f is not None else MEANINGS.get(name, ""),
        }
    return table(rows, "parameter")


def origins(parameters: pandas.DataFrame) -> pandas.Series:
    """Of what was made by :func:`parameter_table`: whether each was given, measured or fitted."""
    return parameters.prior.where(parameters.prior.isin(["given", "measured"]), "fitted")


def correlation_table(fit: Fit) -> pandas.DataFrame:
    """See :attr:`stickslip.Fit.correlations`."""
    names, covariance = fit.covariance.parameter.values.tolist(), fit.covariance.values
    std = np.sqrt(np.diag(covariance))
    found = covariance / np.maximum(np.outer(std, std), 1e-300)
    pairs = sorted(zip(*np.tril_indices(len(names), -1), strict=True), key=lambda pair: -abs(found[pair]))
    rows = {str(n): {"of": names[j], "and": names[i], "correlation": found[i, j]} for n, (i, j) in enumerate(pairs, 1)}
    return table(rows, "pair")


def statistics_of(fit: Fit) -> pandas.Series:
    """See :attr:`stickslip.Fit.statistics`."""
    import pandas

    found = fit.force_fit
    points, events = int((~found.dropped).sum()), found.problem.events
    number, unlikely = found.effective_parameters, float(found.likelihood.sum())
    counted = number + found.scatter.sizes.size
    rows = {
        "points": points,
        "events": events,
        "free parameters": len(fit.free),
        "effective parameters": number,
        "sizes": found.scatter.sizes.size,
        "evaluations": found.evaluations,
        "cost": found.cost,
        "-2 log-likelihood": unlikely,
        "chi-square": found.chi_square,
        "reduced chi-square": found.chi_square / (points - number),
        "AIC": unlikely + 2.0 * counted,
        "BIC": unlikely + np.log(events) * counted,
    }
    return pandas.Series(rows, name="value", dtype=object).rename_axis("statistic")  # counts remain whole numbers


def error_table(fit: ForceFit, found: Sums, measure: Callable[[np.ndarray, np.ndarray], float]) -> pandas.DataFrame:
    """A measure of :func:`sums`: a row for each phase, a column for each run."""
    problem, (squares, numbers) = fit.problem, found
    runs = {"all": slice(None), **{k.name: problem.event_run == r for r, k in enumerate(problem.runs)}}
    phases = {"all": slice(None), **{name: [i] for i, name in enumerate(PHASES) if numbers[:, i].any()}}
    rows = {
        p: {r: measure(*(a[own][:, some].sum(axis=1) for a in (squares, numbers))) for r, own in runs.items()}
        for p, some in phases.items()
    }
    return table(rows, "phase")


def ladder_table(fit: Fit, summed: Callable[[np.ndarray], Sums]) -> pandas.DataFrame:
    """See :attr:`stickslip.Fit.ladder`; ``summed`` makes :func:`sums` of a residual."""

    def errors(residual: np.ndarray | None, *names: str) -> dict[str, float]:
        values = (np.nan, np.nan) if residual is None else of_all(summed(residual))
        return dict(zip(names, values, strict=True))

    rows: dict[Any, dict[str, Any]] = {}
    for rung in fit.climbed.ladder:
        what = f"without {rung.removed}" if rung.removed else rung.added or "static"
        rows[len(rows)] = {
            "model": " + ".join(rung.model),
            "step": what if rung.removed or rung.added is None else f"+ {what}",
            **errors(rung.residual, "error", "error std"),
            **errors(rung.unseen, "unseen error", "unseen std"),
            "gain": fit.climbed.gains.get(rung.added or "", np.nan),
        }
    return table(rows, "rung")
