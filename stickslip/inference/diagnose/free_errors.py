"""How far free simulations are off, event by event, and whether that contradicts the fit of the force."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .free_measures import Array, Measures, measures
from .free_simulation import Confirmation, FreeSimulation

ERRORS = 2.0  # standard errors by which a free prediction must be worse to contradict
COUNTED = ("recurrence", "slip", "creep")  # the whole cycle says little beyond its recurrence


def predicted(c: Confirmation, model: FreeSimulation) -> Measures:
    """The model's measures; a slip that is missed counts as none after the time that was waited."""
    m = c.measurement
    assert m is not None
    features, s = np.array(model.features), m.layout.slices()
    features[model.broken] = np.nan
    waited = (model.arrests - np.asarray(m.cycles.start))[model.missed]
    features[model.missed] = np.nan
    features[model.missed, s["recurrence"].start] = waited
    features[model.missed, s["times"].start] = 0.0
    out = measures(m, features, np.where(model.broken, np.nan, model.arrests))
    return Measures(out.recurrence, out.cycle, np.where(model.missed, 0.0, out.slip), out.creep)


def deviations(c: Confirmation, model: FreeSimulation) -> dict[str, Array]:
    """Errors of every event in units of the scatter, by measure, shape (R, n); nan where there is none."""
    assert c.data is not None and c.scatter is not None
    made = predicted(c, model)
    out = {k: np.abs(made[k] - c.data[k]) / np.maximum(c.scatter[k], 1e-300) for k in ("recurrence", "cycle", "slip")}
    out["creep"] = _rms((made.creep - c.data.creep) / np.maximum(c.scatter.creep, 1e-300), axis=-1)
    return out


def errors(c: Confirmation, model: FreeSimulation) -> dict[str, Any]:
    """The model's errors as plain numbers, for all runs and (``by_run``) for each."""
    m = c.measurement
    assert m is not None
    out = _errors(c, model, np.ones(m.runs, bool))
    out["by_run"] = {name: _errors(c, model, np.arange(m.runs) == r) for r, name in enumerate(m.names)}
    return out


def _errors(c: Confirmation, model: FreeSimulation, runs: NDArray[np.bool_]) -> dict[str, Any]:
    assert c.measurement is not None and c.data is not None
    made, data = predicted(c, model), c.data
    units = None if c.scatter is None else deviations(c, model)

    def scatters(name: str) -> float | None:
        return None if units is None else _number(_rms(units[name][runs]))

    out: dict[str, Any] = {}
    for name in ("recurrence", "cycle", "slip"):
        share = (made[name] - data[name])[runs] / data[name][runs]
        out[name] = {"relative": _number(_rms(share)), "scatters": scatters(name)}
    off = (made.creep - data.creep)[runs]
    whole = data.creep[runs][..., :1]
    out["creep"] = {
        "relative": _number(_rms(off / whole)), "metres": _number(_rms(off)), "scatters": scatters("creep")
    }  # fmt: skip
    used = np.asarray(c.measurement.cycles.used)[runs]
    out["missed"] = int(np.sum(model.missed[runs]))
    out["events"] = int(np.sum(used & ~model.broken[runs]))
    return out


def contradiction(force: tuple[float, float], free: tuple[Array, Array]) -> tuple[float, float] | None:
    """Whether an effect helps the force and spoils the free prediction.

    Args:
        force: error of the force on unseen runs without and with it.
        free: errors of the free prediction in units of the scatter, summed over the measures, of every event without
            and with it, shape (E,).

    Returns:
        By how much the sum over events rises and its standard error, paired by event; None where there is no
        contradiction.
    """
    rise = free[1] - free[0]
    rise = rise[np.isfinite(rise)]
    if rise.size < 2 or not force[1] < force[0]:
        return None
    total, error = float(rise.sum()), float(np.sqrt(rise.size) * np.std(rise, ddof=1))
    return (total, error) if total > ERRORS * error and total > 0.0 else None


def summed(c: Confirmation, model: FreeSimulation) -> Array:
    """Errors of every event in units of the scatter, summed over the measures, shape (R n,); nan where none."""
    each = np.stack([deviations(c, model)[k] for k in COUNTED])
    with_any = np.isfinite(each).any(axis=0)
    return np.where(with_any, np.nansum(each, axis=0), np.nan).ravel()


def _rms(values: Array, axis: int | None = None) -> Any:
    """Root mean square of what is finite; nan where nothing is."""
    there = np.isfinite(values)
    count = there.sum(axis=axis)
    total = np.where(there, values, 0.0) ** 2
    return np.where(count > 0, np.sqrt(total.sum(axis=axis) / np.maximum(count, 1)), np.nan)


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
