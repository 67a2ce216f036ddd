"""What every effect promises at first sight: how far the cost falls with a small amplitude of it, nothing fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...physics.effects import catalogue
from ...physics.params import specs
from .candidates import grid
from .fit import Fit
from .heldout import folds, halves
from .linearised import Array
from .periodogram import best_wave, by_run, waves
from .signatures import Explained, signatures


@dataclass(frozen=True)
class Promise:
    """One form of an effect at first sight.

    Attributes:
        tag, form: which.
        fall: of the cost (chi-square), to first order; no more than the bounds of the amplitude allow.
        amplitude, std: the size that promises it, and its standard deviation (SI, distance from the null).
        unit: of the amplitude.
        unseen, unseen_std: fall of the cost on runs that are left out of the amplitude, and its standard deviation, by
            how much events differ. The model's other parameters have seen them.
        force: what it would take off the residual force (N), all other parameters fitted anew, shape (p,); None where
            it does nothing.
    """

    tag: str
    form: dict[str, str]
    fall: float
    amplitude: float
    std: float
    unit: str
    force: Array | None
    unseen: float = 0.0
    unseen_std: float = float("nan")


def promise(base: Fit, explained: Explained, tag: str, form: dict[str, str]) -> Promise:
    """The best that one form of an effect promises on top of a model."""
    effect = catalogue.get(tag)(**form)
    spec = specs(effect)[effect.amplitude]
    nothing = Promise(tag, form, 0.0, 0.0, float("inf"), spec.unit, None)
    if waves(effect):
        return _wave(base, explained, nothing, effect)
    columns = signatures(base, effect, grid(effect))
    usable = np.isfinite(columns).all(axis=1) & (np.abs(columns).max(axis=1) > 0.0)
    if not usable.any():
        return nothing
    columns = columns[usable]
    falls, sizes, errors = explained.singly(explained.orthogonal(columns.T))
    null = spec.null or 0.0
    inside = np.clip(sizes, spec.lower - null, spec.upper - null)
    share = np.where(sizes != 0.0, inside / np.where(sizes != 0.0, sizes, 1.0), 0.0)
    falls = falls * (1.0 - (1.0 - share) ** 2)
    best = int(np.argmax(falls))
    force = explained.left(-inside[best] * columns[best][:, None])[:, 0]
    unseen = _unseen(base, explained, columns[best][:, None], folds(base))
    return Promise(tag, form, float(falls[best]), float(inside[best]), float(errors[best]), spec.unit, force, *unseen)


def _unseen(
    base: Fit, explained: Explained, columns: Array, left_out: Sequence[NDArray[np.intp]]
) -> tuple[float, float]:
    """Fall of the cost on what is left out, and its standard deviation."""
    each = explained.unseen(columns, left_out)
    return float(each.sum()), float(np.sqrt(each.size) * each.std(ddof=1)) if each.size > 1 else float("nan")


def _wave(base: Fit, explained: Explained, nothing: Promise, effect: Any) -> Promise:
    """Of the periods the best, with an amplitude and a phase of each run."""
    wave = best_wave(base, explained, effect)
    if wave is None or wave.fall <= 0.0:
        return nothing
    force = -wave.amplitude * wave.column(base.problem.run)
    error = float(np.mean(explained.singly(explained.orthogonal(wave.columns.T))[2]))
    force = explained.left(force[:, None])[:, 0]
    unseen, std = _unseen(base, explained, by_run(base, wave.columns), halves(base))
    return replace(
        nothing, fall=wave.fall, amplitude=wave.amplitude, std=error, force=force, unseen=unseen, unseen_std=std
    )  # fmt: skip
