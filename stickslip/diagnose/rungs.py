"""One step of the ladder of models, and the fits it is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..features.measurement import Measurement
from ..fit.composition import Composition
from ..fit.inertial import Fit, errors
from ..fit.problem import Problem
from ..residual import Misfit
from .heldout import HeldOut, held_out
from .pieces import fit_arrays, fit_from
from .sweep import Store


@dataclass(frozen=True)
class Rung:
    """One step of the ladder of models.

    Attributes:
        model: tags of what is in it.
        added: what this rung added to the one before, or None.
        removed: the effect it does without, which the one before had, or None.
        train, held: errors on the cycles fitted and on the others.
        fit, composition: None for the static model.
        features: of the model (R, n, F).
    """

    model: tuple[str, ...]
    added: str | None
    train: Misfit
    held: HeldOut | None
    composition: Composition | None
    fit: Fit | None
    features: np.ndarray
    removed: str | None = None


class Material(NamedTuple):
    """What every model is fitted to: the measurement, its floors, the cycles that may be fitted (R, n); and where
    finished fits are kept."""

    data: Measurement
    floor: np.ndarray
    train: np.ndarray
    store: Store | None


def make_rung(
    model: tuple[str, ...],
    added: str | None,
    composition: Composition,
    optimum: Fit,
    material: Material,
    removed: str | None = None,
) -> Rung:
    """The step of a fitted model, with its errors on fitted and on unseen cycles."""
    data, floor, train, _ = material
    unseen = np.asarray(data.cycles.used) & ~train
    held = held_out(Problem(composition, data), optimum, floor, unseen, optimum.features)
    return Rung(model, added, errors(data, optimum, floor), held, composition, optimum, optimum.features, removed)


def kept(store: Store | None, name: str, make: Callable[[], Fit]) -> Fit:
    """The fit of that name from the store, or made and kept there."""
    found = store.load(name) if store is not None else None
    if found is not None:
        return fit_from(found)
    made = make()
    if store is not None:
        store.save(name, fit_arrays(made))
    return made
