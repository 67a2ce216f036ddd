"""The fitted models run freely through the measured cycles: does what they do agree with what was measured?

Along the measured motion nothing is integrated, so a model may hold the right force there and yet slip at another time.
Here the leading models, the base and the last of the ladder, are integrated from arrest to arrest, each run with the
parameters of a fit that has not seen it, and their recurrence, slip and creep are compared with the data's.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..features.measurement import Measurement, measure
from ..fit.start import FALLBACK_PERIOD
from ..force.fit import Fit
from ..force.heldout import folds, halves, points
from .free_measures import Array, Measures, measured, measures, scatter, simulated
from .pieces import Store
from .prepare import Prepared
from .trials import Tell

ERRORS = 2.0  # standard errors by which a free prediction must be worse to contradict
COUNTED = ("recurrence", "slip", "creep")  # a cycle's whole length says little beyond its recurrence
KEPT = ("features", "arrests", "missed", "broken", "times", "readings")


@dataclass(frozen=True)
class Freely:
    """One model run freely, every cycle predicted from a fit without it. R runs, n cycles.

    Attributes:
        features: of the model, shape (R, n, F).
        arrests: when its cycles end (s), shape (R, n).
        missed: cycles that end without a slip, shape (R, n).
        broken: cycles that could not be integrated, and those after them, shape (R, n).
        times, readings: of the model's steps (s, m), shape (R, n, steps); the last is repeated.
    """

    features: Array
    arrests: Array
    missed: NDArray[np.bool_]
    broken: NDArray[np.bool_]
    times: Array
    readings: Array


@dataclass(frozen=True)
class Confirmation:
    """Data and models side by side.

    Attributes:
        measurement: features of the data; None where nothing was simulated.
        data: the measures of the data.
        scatter: what the campaign's own scatter makes of them, under the last model.
        models: of the rungs that were run, by their number on the ladder.
        notes: what was not done, and why.
    """

    measurement: Measurement | None = None
    data: Measures | None = None
    scatter: Measures | None = None
    models: dict[int, Freely] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def confirm(
    fits: Sequence[Fit | None],
    names: Sequence[str],
    prepared: Prepared,
    store: Store | None = None,
    tell: Tell = lambda text, share: None,
    in_time: Callable[[], bool] = lambda: True,
) -> Confirmation:
    """Run the first and the last model of a ladder freely.

    Args:
        fits: of the rungs, in order; None for a rung without a fit.
        names: of the rungs, for notes and for the store.
        prepared: the data.
        store: keeps finished pieces.
        tell: told the stage and the share of it done.
        in_time: whether there is time for more.

    Returns:
        What was found; no failure of a simulation raises, it is a note.
    """
    have = [i for i, fit in enumerate(fits) if fit is not None]
    chosen = dict.fromkeys([have[0], have[-1]]) if have else {}
    found: dict[int, Freely] = {}
    notes: list[str] = []
    try:
        m = measure(prepared.traces, prepared.segmentations, ring_period=prepared.scales.ring or FALLBACK_PERIOD)
    except Exception as error:
        return Confirmation(notes=(f"no free simulation: {_line(error)}",))
    order = [k.name for k in prepared.runs]
    runs = [order.index(name) for name in m.names]
    every = [fits[i] for i in chosen]
    apart = any(fit is not None and len(folds(fit)) != len(order) for fit in every)
    unit = None
    for done, i in enumerate(chosen):
        fit = fits[i]
        assert fit is not None
        if not in_time():
            notes.append(f"no free simulation of the model with {names[i]}: the time limit came before")
            continue
        tell(f"free simulation: {names[i]}", done / len(chosen))
        try:
            found[i] = _kept(store, f"free-{names[i]}", fit, lambda fit=fit: freely(m, fit, runs, apart))  # type: ignore[misc]
            if i == have[-1]:
                unit = _scatter(store, f"free-scatter-{names[i]}", m, fit, runs)
        except Exception as error:  # an effect of one's own may fail in any way; the diagnosis stands without this
            notes.append(f"the free simulation of the model with {names[i]} failed: {_line(error)}")
    ends = [prepared.segmentations[run].events[int(np.sum(m.cycles.used[r])) - 1].t_arrest for r, run in enumerate(runs)]
    tell("free simulation", 1.0)
    return Confirmation(m, measured(m, np.array(ends)), unit, found, tuple(notes))


def freely(m: Measurement, fit: Fit, runs: Sequence[int], apart: bool) -> Freely:
    """A model through all runs, each cycle with the parameters of a fit that has not seen it.

    Args:
        m: the measurement.
        fit: of the model.
        runs: number in the problem of each run of the measurement.
        apart: whether runs are left out by halves.
    """
    problem = fit.problem
    left_out = halves(fit) if apart else folds(fit)
    shape = np.shape(m.cycles.start)
    used = np.asarray(m.cycles.used)
    features, arrests = np.array(m.values), np.zeros(shape)
    missed, broken = np.zeros(shape, bool), np.zeros(shape, bool)
    tracks: dict[tuple[int, int], tuple[Array, Array]] = {}
    for part, point in zip(left_out, points(fit, left_out), strict=True):
        run = int(problem.event_run[part[0]])
        if run not in runs:
            continue
        r = list(runs).index(run)
        here = part - problem.first[run]
        here = here[here < shape[1]]
        here = here[used[r, here]]
        if here.size == 0:
            continue
        track, seen, cut = simulated(m, problem, point, r, run)
        features[r, here], arrests[r, here], broken[r, here] = seen[here], track.arrest[here], cut[here]
        missed[r, here] = ~track.arrested[here] & ~cut[here]
        for n in here:
            steps = max(int(track.steps[n]), 1)
            tracks[r, n] = (track.t[n, :steps], track.reading[n, :steps])
    longest = max((t.size for t, _ in tracks.values()), default=1)
    times, readings = np.full((*shape, longest), np.nan), np.full((*shape, longest), np.nan)
    for at, (t, y) in tracks.items():
        times[at], readings[at] = (np.pad(a, (0, longest - a.size), mode="edge") for a in (t, y))
    return Freely(features, arrests, missed, broken, times, readings)


def predicted(c: Confirmation, model: Freely) -> Measures:
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


def deviations(c: Confirmation, model: Freely) -> dict[str, Array]:
    """Errors of every event in units of the scatter, by measure, shape (R, n); nan where there is none."""
    assert c.data is not None and c.scatter is not None
    made = predicted(c, model)
    out = {k: np.abs(made[k] - c.data[k]) / np.maximum(c.scatter[k], 1e-300) for k in ("recurrence", "cycle", "slip")}
    out["creep"] = _rms((made.creep - c.data.creep) / np.maximum(c.scatter.creep, 1e-300), axis=-1)
    return out


def errors(c: Confirmation, model: Freely) -> dict[str, Any]:
    """The model's errors as plain numbers, for all runs and (``by_run``) for each."""
    m = c.measurement
    assert m is not None
    out = _errors(c, model, np.ones(m.runs, bool))
    out["by_run"] = {name: _errors(c, model, np.arange(m.runs) == r) for r, name in enumerate(m.names)}
    return out


def _errors(c: Confirmation, model: Freely, runs: NDArray[np.bool_]) -> dict[str, Any]:
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


def summed(c: Confirmation, model: Freely) -> Array:
    """Errors of every event in units of the scatter, summed over the measures, shape (R n,); nan where there is none."""
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


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".split("\n")[0][:300]


def _key(name: str, fit: Fit) -> str:
    """Name of a piece that belongs to this fit and to no other of the same effects."""
    p = fit.point
    content = b"".join(np.ascontiguousarray(a).tobytes() for a in (p.z, p.phases, p.weights))
    return f"{name}-{hashlib.sha256(content).hexdigest()[:12]}"


def _kept(store: Store | None, name: str, fit: Fit, make: Callable[[], Freely]) -> Freely:
    key = _key(name, fit)
    piece = None if store is None else store.load(key)
    if piece is not None:
        return Freely(**{k: np.asarray(piece[k]) for k in KEPT})
    found = make()
    if store is not None:
        store.save(key, {k: getattr(found, k) for k in KEPT})
    return found


def _scatter(store: Store | None, name: str, m: Measurement, fit: Fit, runs: Sequence[int]) -> Measures:
    key = _key(name, fit)
    piece = None if store is None else store.load(key)
    if piece is not None:
        return Measures(**{k: np.asarray(piece[k], float) for k in Measures.__dataclass_fields__})
    found = scatter(m, fit, list(runs))
    if store is not None:
        store.save(key, {k: getattr(found, k) for k in Measures.__dataclass_fields__})
    return found
