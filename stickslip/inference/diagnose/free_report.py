"""What a report says and shows of the free simulations."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...data.segment import thin
from .free_errors import contradiction, predicted, summed
from .free_measures import Array
from .free_simulation import Confirmation, FreeSimulation, Parts
from .prepare import Prepared

POINTS = 4000  # of a picture's line
WINDOW = (0.6, 1.3)  # of a slip's duration, shown before its onset and after it
MODELS = ("base", "last")


def cautions(c: Confirmation, unseen: dict[Parts, float]) -> list[str]:
    """What was not done, slips that did not come, and contradictions, in words.

    Args:
        c: the free simulations.
        unseen: error of the force on unseen runs, in floors, of the first and the last model by their parts.
    """
    out = list(c.notes)
    for parts, model in c.models.items():
        missed, broken = int(model.missed.sum()), int(model.broken.sum())
        events = 0 if c.measurement is None else int(np.sum(np.asarray(c.measurement.cycles.used)))
        if missed:
            out.append(
                f"in free simulation, the model {' + '.join(parts)} does not slip in time in {missed} of {events} "
                "cycles"
            )
        if broken:
            out.append(f"{broken} of {events} cycles of the model {' + '.join(parts)} could not be integrated freely")
    before, after = next(iter(unseen)), next(reversed(unseen))
    if before != after and before in c.models and after in c.models and c.scatter is not None:
        free = summed(c, c.models[before]), summed(c, c.models[after])
        found = contradiction((unseen[before], unseen[after]), free)
        if found is not None:
            total, error = found
            out.append(
                f"force and free simulation contradict each other: with {' + '.join(after[len(before) :])} the error "
                f"of the force on unseen runs falls from {unseen[before]:.3g} to {unseen[after]:.3g} floors, but run "
                f"freely the model predicts their recurrence, slip and creep worse (by {total:.3g} +- {error:.2g} "
                "scatters, summed over the events)"
            )
    return out


def left_out(c: Confirmation) -> list[str]:
    """Runs and slips that are not simulated, and why."""
    return [] if c.measurement is None else [f"free simulation: {line}" for line in c.measurement.dropped]


def free_variables(c: Confirmation, prepared: Prepared, base: Parts, last: Parts) -> dict[str, Any]:
    """Arrays of the picture: one run measured and predicted, the onset of one of its slips, all recurrences."""
    m, data = c.measurement, c.data
    parts = [(name, p) for name, p in zip(MODELS, dict.fromkeys([base, last]), strict=False) if p in c.models]
    if m is None or data is None or not parts:
        return {}
    out: dict[str, Any] = {}
    made = {name: predicted(c, c.models[p]) for name, p in parts}
    there = np.isfinite(data.recurrence)
    first = made[parts[0][0]]
    with np.errstate(invalid="ignore"):
        off = np.where(there, np.abs(first.recurrence / data.recurrence - 1.0), 0.0)
    r = int(np.argmax(np.nanmean(np.where(np.isfinite(off), off, 0.0), axis=1)))
    columns = {"measured": data.recurrence, **{name: made[name].recurrence for name, _ in parts}}
    if c.scatter is not None:
        columns["scatter"] = c.scatter.recurrence
    for name, values in columns.items():
        out[f"free_recurrence_{name}"] = ("free_event", values[there], {"units": "s"})
    out["free_recurrence_run"] = ("free_event", np.nonzero(there)[0], {"units": "1"})

    run = prepared.runs[[k.name for k in prepared.runs].index(m.names[r])]
    at = [k.name for k in prepared.runs].index(run.name)
    trace, events = prepared.traces[at], prepared.segmentations[at].events
    used = int(np.sum(np.asarray(m.cycles.used)[r]))
    assert trace.displacement is not None and trace.drive is not None
    inside = trace.time <= events[used - 1].t_arrest + 2.0 * m.layout.settling
    chosen = events[min(max(used // 2, 1), used - 1)]
    zero = float(np.asarray(m.cycles.position)[r, chosen.index])

    def put(name: str, t: Array, x: Array, near: Array, position: Array) -> None:
        gap = trace.drive.position(t) - x  # type: ignore[union-attr]
        out[f"free_run_{name}_time"] = (f"free_run_{name}", t, {"units": "s", "run": run.name})
        out[f"free_run_{name}_gap"] = (f"free_run_{name}", gap, {"units": "m"})
        shown = (near > -WINDOW[0] * chosen.duration) & (near < WINDOW[1] * chosen.duration)
        out[f"free_onset_{name}_time"] = (f"free_onset_{name}", near[shown], {"units": "s", "event": chosen.index})
        out[f"free_onset_{name}_position"] = (f"free_onset_{name}", position[shown] - zero, {"units": "m"})

    t, gap = thin(trace.time[inside], trace.drive.position(trace.time[inside]) - trace.displacement[inside], POINTS)
    put("measured", t, trace.drive.position(t) - gap, trace.time - chosen.t_onset, trace.displacement)
    for name, p in parts:
        times, readings = (np.concatenate([*a[:used], [np.nan]]) for a in _joined(c.models[p], r))
        one = c.models[p]
        put(name, times, readings, one.times[r, chosen.index] - chosen.t_onset, one.readings[r, chosen.index])
    return out


def _joined(model: FreeSimulation, r: int) -> tuple[list[Array], list[Array]]:
    """Times and readings of every cycle of a run, each without its padding and ended by nan, so that lines break."""
    times, readings = [], []
    for t, y in zip(model.times[r], model.readings[r], strict=True):
        keep = np.concatenate([[True], np.diff(t) > 0.0])
        times.append(np.append(t[keep], np.nan))
        readings.append(np.append(y[keep], np.nan))
    return times, readings
