"""With how stretched a spring each run begins, where its record does not begin virgin: set by when its slips come."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..features.measurement import Measurement
from ..fit.composition import START, run_of
from ..fit.parameters import Free
from ..fit.problem import Problem

STEPS = 5  # each leaves some tenth of how late the slips are
NEAR = 0.002  # on the search scale: a start that moves less has arrived


def beginning(
    measurement: Measurement,
    free: Free,
    value: float,
    features: np.ndarray,
    columns: np.ndarray,
    aim: np.ndarray,
    cycles: np.ndarray,
) -> float:
    """The parameter ``start.R`` of a run, on the search scale, with which its slips come when those of ``aim`` do.

    Args:
        measurement: the data.
        free: the parameter.
        value: of it (search scale) at which the ``features`` of the model, shape (R, n, F), are.
        columns: their derivatives in it, of the same shape.
        aim: the features to be met, of the same shape.
        cycles: of the run that may be looked at, shape (n,).
    """
    run = run_of(free.name)
    assert run is not None
    at = measurement.layout.slices()["recurrence"].start
    seen = cycles & measurement.valid[run, :, at] & (np.abs(columns[run, :, at]) > 0.0)
    seen &= np.isfinite(features[run, :, at])
    if not seen.any():
        return value
    late = (aim[run, seen, at] - features[run, seen, at]) / columns[run, seen, at]
    return float(np.clip(value + np.median(late), *free.bounds))


def begun(
    problem: Problem,
    z: np.ndarray,
    events: np.ndarray,
    columns: np.ndarray,
    known: Sequence[Free],
    aim: np.ndarray,
    use: np.ndarray,
    steps: int = STEPS,
) -> tuple[np.ndarray, np.ndarray]:
    """Free parameters with every run begun so that its slips come when those of ``aim`` do, and the features there.

    An effect that changes the force at which the block slips moves all slips of a run that does not begin virgin, and
    by far more than it changes them.

    Args:
        problem: the model with the effect.
        z, events: free parameters on the search scale, and what varies from event to event.
        columns: derivatives of the features in the ``known`` free parameters, the first of ``z``, shape (R, n, F, k).
        known: these parameters.
        aim: features that have the slips where they should be, shape (R, n, F).
        use: cycles that may be looked at, shape (R, n).
        steps: at most so many times.
    """
    features = problem.features(z, events)
    starts = [i for i, f in enumerate(known) if f.name.startswith(START)]
    if not starts:
        return z, features
    for _ in range(steps):
        before, z = z, z.copy()
        for i in starts:
            run = run_of(known[i].name)
            z[i] = beginning(problem.measurement, known[i], z[i], features, columns[..., i], aim, use[run])
        features = problem.features(z, events)
        if np.max(np.abs(z - before)) < NEAR:
            break
    return z, features


def with_starts(
    problem: Problem,
    z: np.ndarray,
    events: np.ndarray,
    columns: np.ndarray,
    known: Sequence[Free],
    aim: np.ndarray,
    use: np.ndarray,
) -> np.ndarray:
    """The free parameters of :func:`begun` alone; nothing is integrated where all records begin virgin."""
    if not any(free.name.startswith(START) for free in known):
        return z
    return begun(problem, z, events, columns, known, aim, use)[0]
