"""With how stretched a spring each run begins, where its record does not begin virgin: set by when its slips come."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..features.measurement import Measurement
from ..fit.composition import START, run_of
from ..fit.parameters import Free
from ..fit.problem import Problem


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
) -> tuple[np.ndarray, np.ndarray]:
    """Free parameters with every run begun so that its slips come when those of ``aim`` do, and the features there.

    An effect that changes the force at which the block slips moves all slips of a run that does not begin virgin, and
    by far more than it changes them.

    Args:
        problem: the model with the effect.
        z, events: free parameters on the search scale, and what varies from event to event.
        columns: derivatives of the features in the ``known`` free parameters, the first of ``z``, shape (R, n, F, k).
        known: these parameters.
        aim: features of the model before it was changed, shape (R, n, F).
        use: cycles that may be looked at, shape (R, n).
    """
    features = problem.features(z, events)
    starts = [i for i, f in enumerate(known) if f.name.startswith(START)]
    if not starts:
        return z, features
    z = z.copy()
    for i in starts:
        run = run_of(known[i].name)
        z[i] = beginning(problem.measurement, known[i], z[i], features, columns[..., i], aim, use[run])
    return z, problem.features(z, events)
