"""Means and scatter of slips, measured and simulated, as rows of a table, and curves of both that can be drawn."""

from __future__ import annotations

import numpy as np

from ..data.trace import Trace
from ..objects import experiments
from ..objects.experiments import MEASURES, Simulated
from ..objects.fit import Fit
from ..system.units import shown, shown_with
from .overview import reduced
from .simulation_form import named

POINTS = 4000  # that are drawn of a curve


def thinned(t: np.ndarray, x: np.ndarray, gap: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a source: samples that keep the course of both."""
    if not np.isfinite(x).any():
        return {"t": np.array([]), "x": np.array([]), "gap": np.array([])}
    begin, end = float(t[0]), float(t[-1])
    kept = [np.searchsorted(t, reduced(t, np.ascontiguousarray(v), begin, end, POINTS)[0]) for v in (x, gap)]
    own = np.unique(np.concatenate(kept))
    return {"t": t[own], "x": x[own], "gap": gap[own]}


def event_rows(
    measured: dict[str, tuple[float, float, int]], found: Simulated | None, trace: Trace, now: Fit | None
) -> tuple[list[str], list[list[str]]]:  # fmt: skip
    """Means over the slips after the first, measured (in a trace) and simulated; ``now`` is the model as it stands."""
    columns = ["means ± scatter, without the first slip", *(key.replace("_", " ") for key in MEASURES)]
    if found is None:
        return columns, [["measured", *cells(measured)]]
    model = [named(found.fit, now), *cells(experiments.simulated(found.recording, trace))]
    verdict = str(found.recording.attrs.get("verdict", ""))
    return [*columns, "what happens"], [["measured", *cells(measured), ""], [*model, verdict]]


SAME = 1e-6  # share of a mean below which a deviation is rounding


def cells(values: dict[str, tuple[float, float, int]]) -> list[str]:
    out = []
    for key, unit in MEASURES.items():
        mean, std, count = values.get(key, (np.nan, np.nan, 0))
        equal = f"{shown(mean, unit, 4)} all equal"
        out.append("-" if not count else shown_with(mean, std, unit) if std > SAME * abs(mean) else equal)
    return out
