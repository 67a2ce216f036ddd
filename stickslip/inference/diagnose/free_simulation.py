"""The fitted models run freely through the measured cycles: does what they do agree with what was measured?

Along the measured motion nothing is integrated, so a model may hold the right force there and yet slip at another time.
Here the leading models are integrated from arrest to arrest, each run with the parameters of a fit that has not seen
it. What comes of it is compared with the data in :mod:`.free_errors`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..features.measurement import Measurement
from ..force.fit import Fit
from ..force.heldout import folds, halves, points
from .checkpoints import Store
from .free_measures import Array, Measures, measured, scatter, simulated
from .prepare import Prepared
from .work import Work

Parts = tuple[str, ...]  # tags of what is in a model
FOLLOWED = (
    "no free simulation: the motion is prescribed, no slip is the block's own, and the error on unseen runs is "
    "that of the force"
)


@dataclass(frozen=True)
class FreeSimulation:
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
        scatter: standard deviation of each that the campaign's own scatter makes, under the last model; None where
            that was not simulated.
        models: what was run, by the parts of the model.
        notes: what was not done, and why.
    """

    measurement: Measurement | None = None
    data: Measures | None = None
    scatter: Measures | None = None
    models: Mapping[Parts, FreeSimulation] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def confirm(fits: Mapping[Parts, Fit], last: Parts, prepared: Prepared, work: Work = Work()) -> Confirmation:
    """Run models freely through the measured cycles (at most the first :data:`MOST_CYCLES` of a run).

    Args:
        fits: along the motion, of the models to be run, by their parts.
        last: parts of the model whose scatter is the unit of errors.
        prepared: the data.
        work: how.

    Returns:
        What was found. A simulation that fails is a note and raises nothing.
    """
    if prepared.prescribed:
        return Confirmation(notes=(FOLLOWED,))
    names = [k.name for k in prepared.runs]
    found: dict[Parts, FreeSimulation] = {}
    unit, notes = None, []
    try:
        m = prepared.measurement
    except Exception as error:  # the diagnosis stands without this
        return Confirmation(notes=(f"no free simulation: {_line(error)}",))
    runs = [names.index(name) for name in m.names]
    # two models are compared event by event only if both are left out in the same way
    by_halves = any(len(folds(fit)) != len(names) for fit in fits.values())
    for done, (parts, fit) in enumerate(fits.items()):
        if not work.in_time():
            notes.append(f"the time limit came before the free simulation of the model {_named(parts)}")
            continue
        work.tell(f"free simulation of {_named(parts)}", done / len(fits))
        try:
            found[parts] = _kept(
                work.store, _key("free", parts, fit), FreeSimulation, partial(simulate_freely, m, fit, runs, by_halves)
            )
            if parts == last:
                key = _key("scatter", parts, fit)
                unit = _kept(work.store, key, Measures, partial(scatter, m, fit, runs))
        except Exception as error:  # an effect of one's own may fail in any way
            notes.append(f"the free simulation of the model {_named(parts)} failed: {_line(error)}")
    work.tell("free simulation", 1.0)
    used = np.asarray(m.cycles.used).sum(axis=1)
    ends = [prepared.segmentations[k].events[int(n) - 1].t_arrest for k, n in zip(runs, used, strict=True)]
    return Confirmation(m, measured(m, np.array(ends)), unit, found, tuple(notes))


def simulate_freely(m: Measurement, fit: Fit, runs: Sequence[int], by_halves: bool) -> FreeSimulation:
    """A model through all runs, each cycle with the parameters of a fit that has not seen it.

    Args:
        m: the measurement.
        fit: of the model.
        runs: number in the problem of each run of the measurement.
        by_halves: whether runs are left out by halves.
    """
    problem = fit.problem
    left_out = halves(fit) if by_halves else folds(fit)
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
            tracks[r, int(n)] = (np.asarray(track.t[n, :steps]), np.asarray(track.reading[n, :steps]))
    longest = max((t.size for t, _ in tracks.values()), default=1)
    times, readings = np.full((*shape, longest), np.nan), np.full((*shape, longest), np.nan)
    for at, (t, y) in tracks.items():
        times[at], readings[at] = (np.pad(a, (0, longest - a.size), mode="edge") for a in (t, y))
    return FreeSimulation(features, arrests, missed, broken, times, readings)


def _named(parts: Parts) -> str:
    return " + ".join(parts)


def _line(error: Exception) -> str:
    said = error.what if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    return said.split("\n")[0][:300]


def _key(kind: str, parts: Parts, fit: Fit) -> str:
    """Name of a piece that belongs to this fit and to no other of the same effects."""
    p = fit.point
    content = b"".join(np.ascontiguousarray(a).tobytes() for a in (p.z, p.phases, p.weights, fit.scatter.sizes))
    return f"{kind}-{parts[-1]}-{hashlib.sha256(content).hexdigest()[:12]}"


def _kept(store: Store | None, key: str, kind: Any, make: Callable[[], Any]) -> Any:
    """A data class of arrays from the store, or made and kept there."""
    piece = None if store is None else store.load(key)
    if piece is not None:
        return kind(**{f.name: np.asarray(piece[f.name]) for f in fields(kind)})
    found = make()
    if store is not None:
        store.save(key, {f.name: getattr(found, f.name) for f in fields(kind)})
    return found
