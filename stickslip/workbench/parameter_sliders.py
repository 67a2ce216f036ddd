"""A slider for every parameter: over which range it goes, and what stands beside it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..inference.fit.parameters import Free
from ..objects.fit import Fit
from ..objects.fit_tables import MEANINGS, STRENGTH
from ..system.units import shown, shown_with

DEVIATIONS = 12.0  # of a parameter that a slider reaches to either side
LEAST, MOST = 0.3, 3.5  # e-folds to either side on a logarithmic scale
BASE = ("contact", "weakening", "rig", "sensor", "start")


@dataclass(frozen=True)
class Knob:
    """One slider.

    Attributes:
        free: the parameter.
        low, high: ends on the search scale.
        prior: in words.
    """

    free: Free
    low: float
    high: float
    prior: str

    def place(self, value: float) -> float:
        """Where a value (SI) is on the slider, 0 to 1."""
        return float(np.clip((self.free.inward(value) - self.low) / (self.high - self.low), 0.0, 1.0))

    def value(self, place: float) -> float:
        """The value (SI) at a place of the slider."""
        return self.free.outward(self.low + float(np.clip(place, 0.0, 1.0)) * (self.high - self.low))

    def row(self, value: float, std: float, locked: bool) -> dict[str, Any]:
        """What the slider shows; ``std`` in SI."""
        free = self.free
        tag, _, own = free.name.rpartition(".")
        z, width = free.inward(value), self.high - self.low
        deviation = std / free.slope(z)
        ends = [float(np.clip((z + s * deviation - self.low) / width, 0.0, 1.0)) for s in (-1.0, 1.0)]
        return {
            "name": free.name,
            "label": own.replace("_", " "),
            "group": "" if tag in BASE else tag,
            "text": shown_with(value, std, free.unit) if std > 0.0 else shown(value, free.unit),
            "prior": self.prior,
            "doc": free.doc,
            "place": self.place(value),
            "band": ends if std > 0.0 and np.isfinite(ends).all() else [0.0, 0.0],
            "low": shown(free.outward(self.low), free.unit, 2),
            "high": shown(free.outward(self.high), free.unit, 2),
            "locked": locked,
        }


def knobs(fit: Fit) -> dict[str, Knob]:
    """Name -> slider of every parameter of a model that was fitted; the contact's strength first."""
    std, values = fit.std, fit.values
    strength = values[STRENGTH]
    half = float(np.clip(DEVIATIONS * std[STRENGTH] / strength, 0.1, 1.0))
    centre = float(np.log(strength))
    whole = Free(STRENGTH, "N", "log", strength, strength, np.inf, 0.0, np.inf, MEANINGS[STRENGTH])
    out = {STRENGTH: Knob(whole, centre - half, centre + half, "measured")}
    for f in fit.free:
        z = f.inward(values[f.name])
        deviation = std.get(f.name, 0.0) / max(abs(f.slope(z)), 1e-300)
        deviation = deviation if np.isfinite(deviation) else 0.0
        least, most = f.bounds
        if f.scale == "log":
            half = float(np.clip(DEVIATIONS * deviation, LEAST, MOST))
            low, high = z - half, z + half
        elif f.amplitude:
            half = max(DEVIATIONS * deviation, abs(z), 0.02 * (most - least))
            low, high = min(z - half, 0.0), max(z + half, 0.0)
        else:
            half = max(DEVIATIONS * deviation, 0.1 * (most - least))
            low, high = z - half, z + half
        low, high = max(low, least), min(high, most)
        known = f.known_as(partial(shown, unit=f.unit, digits=3))
        out[f.name] = Knob(f, low, high, known)
    return out


def given(fit: Fit) -> list[dict[str, str]]:
    """What the campaign's file states, so that no fit and no hand moves it: ``label``, ``text`` and ``doc``."""
    table = fit.parameters
    stated = table[table.prior == "given"]
    names = [str(name).rpartition(".")[2].replace("_", " ") for name in stated.index]
    return [
        {"label": name, "text": shown(value, unit), "doc": meaning}
        for name, value, unit, meaning in zip(names, stated.value, stated.unit, stated.meaning, strict=True)
    ]


def rows(fit: Fit, fitted: Fit, made: dict[str, Knob], locked: Collection[str] = ()) -> list[dict[str, Any]]:
    """What the sliders show of a model; deviations are those of the fit before it was moved by hand."""
    values, std = fit.values, fitted.std
    return [k.row(values[n], std.get(n, 0.0), n in locked) for n, k in made.items() if n in values]
