"""One candidate: an effect on top of a model, and what became of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..effects import catalogue
from ..effects.base import Effect
from ..features.measurement import Measurement
from ..fit.composition import Composition
from ..fit.inertial import Fit, errors
from ..fit.parameters import Free
from ..fit.problem import Problem
from ..residual import Misfit
from .heldout import HeldOut, held_out

WIDEST = 30.0  # factor on the floors


@dataclass(frozen=True)
class Candidate:
    """What became of one effect.

    Attributes:
        tag: of the effect.
        form: of its law.
        effect: the instance whose free fields the composition overwrites.
        score: share of the base's misfit that the effect explains to first order, everything else refitted.
        promise: share of the base's misfit, at floors ``wide`` times as wide, that is gone where a search would start.
        fit: that start, or the refit; None where the effect was dropped before. A start has the data's own features in
            cycles that no fit has seen, and no errors.
        train: errors on the cycles fitted.
        held: errors on the others.
        note: why it was dropped, if it was.
        others: further places to start from, each free parameters and event-wise factors.
        settled: whether it was refined to the end.
    """

    tag: str
    form: dict[str, str]
    effect: Effect
    score: float
    promise: float = 0.0
    wide: float = 1.0
    composition: Composition | None = None
    fit: Fit | None = None
    train: Misfit | None = None
    held: HeldOut | None = None
    note: str = ""
    others: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    settled: bool = False

    @property
    def amplitude(self) -> Free | None:
        """The free parameter that is the amplitude."""
        if self.fit is None:
            return None
        return next((f for f in self.fit.free if f.amplitude and f.name.startswith(f"{self.tag}.")), None)

    @property
    def cost(self) -> float:
        """Robust chi-square of the refit; infinite where there is none."""
        return np.inf if self.fit is None else self.fit.cost


def with_fit(candidate: Candidate, found: Fit, problem: Problem, floor: np.ndarray, train: np.ndarray) -> Candidate:
    """The candidate with a refit, and its errors on the cycles fitted and on the others."""
    m = problem.measurement
    used = np.asarray(m.cycles.used)
    return replace(
        candidate,
        fit=found,
        train=errors(m, found, floor),
        held=held_out(problem, found, floor, used & ~train, found.features),
    )


def ease(optimum: Fit, measurement: Measurement, floor: np.ndarray) -> float:
    """Factor on the floors at which the base's misfit is moderate: where a search for what is missing begins."""
    valid = measurement.valid & optimum.use[..., None]
    r = np.abs(np.nan_to_num((optimum.features - measurement.values) / floor, nan=1e4))[valid]
    return float(np.clip(np.quantile(r, 0.9) / 3.0, 1.0, WIDEST))


def forms_of(tag: str) -> list[Effect]:
    """The effect in every form of its law, the usual one first."""
    cls = catalogue.get(tag)
    return [cls(**form) for form in catalogue.forms(cls)]
