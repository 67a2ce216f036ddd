"""Errors of a fit by phase of the cycle and by run, as a table."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..inference.force.errors import Sums
from ..inference.force.fit import Fit as ForceFit
from ..inference.force.knots import PHASES
from .shown import table

if TYPE_CHECKING:
    import pandas


def by_phase(fit: ForceFit, found: Sums, measure: Callable[[np.ndarray, np.ndarray], float]) -> pandas.DataFrame:
    """A measure of :func:`sums`: a row for each phase, a column for each run."""
    problem, (squares, numbers) = fit.problem, found
    runs = {"all": slice(None), **{k.name: problem.event_run == r for r, k in enumerate(problem.runs)}}
    phases = {"all": slice(None), **{name: [i] for i, name in enumerate(PHASES) if numbers[:, i].any()}}
    rows = {
        p: {r: measure(*(a[own][:, some].sum(axis=1) for a in (squares, numbers))) for r, own in runs.items()}
        for p, some in phases.items()
    }
    return table(rows, "phase")
