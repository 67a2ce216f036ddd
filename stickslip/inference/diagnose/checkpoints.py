"""Finished parts of a diagnosis as plain arrays, so that an interrupted one goes on from files that hold data only."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from ...physics.effects import catalogue
from ..force.candidates import Candidate, with_start
from ..force.fit import Fit, at
from ..force.fit_arrays import fit_arrays, fit_of, point_arrays, point_of, scatter_arrays, scatter_of
from ..force.problem import Problem

_FACTS = ("tag", "form", "promise", "note", "members", "visible", "start")


class Store(Protocol):
    """Where finished parts are kept."""

    def load(self, key: str) -> Mapping[str, np.ndarray] | None:
        """A finished part, or None."""

    def save(self, key: str, part: Mapping[str, np.ndarray]) -> None:
        """Keep a finished part."""


def kept(store: Store | None, key: str, problem: Problem, make: Callable[[], Fit]) -> Fit:
    """A fit of the problem from the store, or made and kept there.

    In both cases as it is taken from there: a last digit decides in which dent of a rough valley a later search ends.
    """
    if store is None:
        return make()
    found = store.load(key)
    if found is None:
        found = fit_arrays(make())
        store.save(key, found)
    return fit_of(problem, found)


def name_of(tag: str, form: Mapping[str, str]) -> str:
    """Name of a candidate among the pieces of a round."""
    return "-".join([tag, *form.values()]).replace(" ", "_")


def save_candidate(store: Store, key: str, candidate: Candidate) -> None:
    """Keep a candidate."""
    head = json.dumps({name: getattr(candidate, name) for name in _FACTS})
    fit = candidate.fit
    point = {} if fit is None else {**point_arrays(fit.point), **scatter_arrays(fit.scatter)}
    store.save(key, {"head": np.array(head), **point})


def load_candidate(store: Store, key: str, base: Fit) -> Candidate | None:
    """A kept candidate on top of its base, or None."""
    found = store.load(key)
    if found is None:
        return None
    head = json.loads(str(found["head"]))
    if "z" not in found:
        return Candidate(**head, fit=None)
    effect = catalogue.get(head["tag"])(**head["form"])
    problem, _ = with_start(base.problem, effect, head["start"])
    return Candidate(**head, fit=at(problem, point_of(found), scatter_of(found), base))
