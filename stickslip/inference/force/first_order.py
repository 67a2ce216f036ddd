"""What every effect promises at first sight: how far the cost falls with a small amplitude of it, nothing fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...physics.effects import catalogue
from ...physics.params import specs
from .candidates import grid, resolved
from .fit import Array, Fit
from .signatures import Explained, signatures

COARSE = 6  # every so many frequencies of a periodic effect are tried


@dataclass(frozen=True)
class Promise:
    """One form of an effect at first sight.

    Attributes:
        tag, form: which.
        fall: of the cost (chi-square), to first order; no more than the bounds of the amplitude allow.
        amplitude, std: the size that promises it, and its standard deviation (SI, distance from the null).
        unit: of the amplitude.
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


def promise(base: Fit, explained: Explained, tag: str, form: dict[str, str]) -> Promise:
    """The best that one form of an effect promises on top of a model."""
    effect = catalogue.get(tag)(**form)
    spec = specs(effect)[effect.amplitude]
    nothing = Promise(tag, form, 0.0, 0.0, float("inf"), spec.unit, None)
    waves = effect.periodic is not None and hasattr(effect, "phase") and getattr(effect, "form", None) != "trend"
    members = _waves(base, effect) if waves else grid(effect)
    if not members:
        return nothing
    columns = signatures(base, effect, members)
    usable = np.isfinite(columns).all(axis=1) & (np.abs(columns).max(axis=1) > 0.0)
    if not usable.any():
        return nothing
    columns = columns[usable]
    if waves:
        return _wave(base, explained, nothing, columns)
    falls, sizes, errors = explained.singly(explained.apart(columns.T))
    null = spec.null or 0.0
    inside = np.clip(sizes, spec.lower - null, spec.upper - null)
    share = np.where(sizes != 0.0, inside / np.where(sizes != 0.0, sizes, 1.0), 0.0)
    falls = falls * (1.0 - (1.0 - share) ** 2)
    best = int(np.argmax(falls))
    force = explained.left(-inside[best] * columns[best][:, None])[:, 0]
    return Promise(tag, form, float(falls[best]), float(inside[best]), float(errors[best]), spec.unit, force)


def _waves(base: Fit, effect: Any) -> list[dict[str, float]]:
    name, variable = effect.periodic
    found = resolved(base, variable, specs(effect)[name], name)[::COARSE]
    return [
        {name: float(f if name == "frequency" else 1.0 / f), "phase": turn} for f in found for turn in (0.0, np.pi / 2)
    ]


def _wave(base: Fit, explained: Explained, nothing: Promise, columns: Array) -> Promise:
    """Of the frequencies the best, with a sine and a cosine for each run."""
    runs, number = base.problem.run, len(base.problem.runs)
    best = nothing
    for i in range(0, len(columns) - 1, 2):
        split = np.zeros((runs.size, 2 * number))
        for r in range(number):
            split[runs == r, 2 * r : 2 * r + 2] = columns[i : i + 2, runs == r].T
        fall, sizes = explained.gain(split)
        if fall > best.fall:
            amplitude = float(np.sqrt(np.mean(sizes**2) * 2.0))
            error = float(np.mean(explained.singly(explained.apart(columns[i : i + 2].T))[2]))
            best = Promise(nothing.tag, nothing.form, fall, amplitude, error, nothing.unit, -(split @ sizes))
    return best if best.force is None else replace(best, force=explained.left(best.force[:, None])[:, 0])
