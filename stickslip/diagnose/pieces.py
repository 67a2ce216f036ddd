"""Finished pieces of a diagnosis as plain arrays, so that they can be kept in a file that holds data only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np

from ..effects import catalogue
from ..features.measurement import Measurement
from ..fit.composition import Composition
from ..fit.inertial import Fit
from ..fit.parameters import Free, effect_parameters
from ..fit.problem import Problem
from .candidate import Candidate, with_fit
from .periods import within_record

_ARRAYS = ("z", "events", "features", "offsets", "covariance", "columns", "use")


def fit_arrays(fit: Fit) -> dict[str, np.ndarray]:
    """A fit as named arrays; the free parameters as one JSON text."""
    free = json.dumps([asdict(f) for f in fit.free])
    numbers = np.array([fit.cost, fit.data_cost, fit.evaluations, fit.jacobians])
    return {name: getattr(fit, name) for name in _ARRAYS} | {"numbers": numbers, "free": np.array(free)}


def fit_from(arrays: Mapping[str, np.ndarray]) -> Fit:
    """The inverse of :func:`fit_arrays`."""
    cost, data_cost, evaluations, jacobians = arrays["numbers"].tolist()
    free = tuple(
        Free(**{**f, "usual": None if f["usual"] is None else tuple(f["usual"])})  # JSON has no tuples
        for f in json.loads(str(arrays["free"]))
    )
    z, events, features, offsets, covariance, columns, use = (np.asarray(arrays[name]) for name in _ARRAYS)
    return Fit(
        z,
        events,
        cost,
        data_cost,
        features,
        offsets,
        covariance,
        free,
        columns,
        use.astype(bool),
        int(evaluations),
        int(jacobians),
    )


def candidate_arrays(candidate: Candidate) -> dict[str, np.ndarray]:
    """A candidate as named arrays."""
    facts = ("tag", "form", "score", "promise", "wide", "note", "settled")
    head = json.dumps({name: getattr(candidate, name) for name in facts})
    others = {name: np.array([o[i] for o in candidate.others]) for i, name in enumerate(("others_z", "others_events"))}
    return {"head": np.array(head)} | others | (fit_arrays(candidate.fit) if candidate.fit is not None else {})


def candidate_from(
    arrays: Mapping[str, np.ndarray],
    base: Composition,
    measurement: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
) -> Candidate:
    """The inverse of :func:`candidate_arrays`; errors are computed again from the features kept."""
    head = json.loads(str(arrays["head"]))
    effect = catalogue.get(head["tag"])(**head["form"])
    composition = base.with_effect(effect, within_record(effect, effect_parameters(effect), measurement))
    others = tuple(zip(arrays["others_z"], arrays["others_events"], strict=True))
    candidate = Candidate(**head, effect=effect, composition=composition, others=others)
    if "z" not in arrays:
        return candidate
    fit = fit_from(arrays)
    if candidate.note:
        return replace(candidate, fit=fit)
    return with_fit(candidate, fit, Problem(composition, measurement), floor, train)
