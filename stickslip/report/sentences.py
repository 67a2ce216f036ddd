"""Where a model fails: a table of phase by velocity, and one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..features.layout import PHASES
from ..features.measurement import Measurement
from ..units import shown

GOOD = 1.3  # error (rms over floor) up to which a phase counts as described
FAILED = 50.0  # error from which a fit describes nothing
_SHARE = 0.8
_TREND = 0.25  # exponent of the error in the velocity from which it grows or falls


def phase_table(by_run: dict[str, dict[str, float]], velocities: dict[str, float]) -> dict[str, Any]:
    """Error by phase (columns) and run (rows, by drive velocity), as lists; runs without an error are left out."""
    runs = sorted((name for name, errors in by_run.items() if errors), key=lambda name: velocities.get(name, 0.0))
    phases = [p for p in PHASES if any(p in by_run[r] for r in runs)]
    return {
        "phases": phases,
        "runs": runs,
        "velocities": [velocities.get(r) for r in runs],
        "errors": [[by_run[r].get(p) for p in phases] for r in runs],
    }


def misfit_sentence(measurement: Measurement, model: np.ndarray, floor: np.ndarray, by_phase: dict[str, float]) -> str:
    """Where most of the misfit is, and how it depends on the drive velocity.

    Args:
        measurement: the data.
        model: features of the model, shape (R, n, F).
        floor: standard deviations, shape (R, n, F).
        by_phase: error of every phase.
    """
    if not by_phase:
        return "There is nothing to compare."
    squares = {p: e * e for p, e in by_phase.items()}
    whole = sum(squares.values())
    if whole <= 0:
        return "The model describes the data exactly."
    order = sorted(squares, key=lambda p: -squares[p])
    named: list[str] = []
    while sum(squares[p] for p in named) < _SHARE * whole and len(named) < 2:
        named.append(order[len(named)])
    share = 100 * sum(squares[p] for p in named) / whole
    worst = named[0]
    z = np.where(measurement.valid, (measurement.values - model) / floor, np.nan)
    place = " and ".join(_place(measurement, z, phase) for phase in named)
    rest = max(by_phase.values()) < GOOD
    text = f"{share:.0f} % of {'what is left' if rest else 'the misfit'} is in {place}{_trend(measurement, z, worst)}"
    error = float(np.sqrt(whole / len(squares)))
    if rest:
        return f"The data are described as well as they allow (error {error:.2g} floors); {text}."
    text = f"{text}; there the model is {by_phase[worst]:.3g} floors off."
    if error > FAILED:
        return f"The fit failed ({error:.3g} floors in the mean of the phases), so its parameters mean little: {text}"
    return text


def _place(m: Measurement, z: np.ndarray, phase: str) -> str:
    """The phase, and for creep and slip which part of it."""
    names = {"creep": "the creep", "slip": "the slip", "ring-down": "the ring-down",
             "recurrence": "the time from slip to slip", "hold": "the holds"}  # fmt: skip
    text = names.get(phase, phase)
    index = m.layout.phase_index() == PHASES.index(phase)
    power = np.nansum(np.square(np.where(index, z, np.nan)), axis=(0, 1))
    total = float(power[index].sum())
    if total <= 0:
        return text
    s = m.layout.slices()
    if phase == "creep":
        before = np.nanmedian(np.where(m.valid[..., s["creep"]], np.asarray(m.anchors.creep), np.nan), axis=(0, 1))
        part = power[s["creep"]]
        if part.sum() > 0.5 * total and np.isfinite(before).all():
            # creep points run from the slip backwards
            n = int(np.searchsorted(np.cumsum(part) / part.sum(), _SHARE)) + 1
            if n <= 0.7 * part.size:
                return f"the last {_seconds(float(before[n - 1]))} before the slip"
            start = part.size - int(np.searchsorted(np.cumsum(part[::-1]) / part.sum(), _SHARE)) - 1
            if start > 0.4 * part.size:
                return f"the creep up to {_seconds(float(before[start]))} before the slip"
    else:
        top = int(np.argmax(np.where(index, power, -1)))
        if power[top] > 0.6 * total and index.sum() > 1:
            return f"{text} ({m.layout.names[top]})"
    return text


def _seconds(value: float) -> str:
    return shown(value, "s", 2)


def _trend(m: Measurement, z: np.ndarray, phase: str) -> str:
    """How the error of a phase depends on the drive velocity, over the runs."""
    index = m.layout.phase_index() == PHASES.index(phase)
    error = np.array(
        [np.sqrt(np.nanmean(np.square(r[..., index]))) if np.isfinite(r[..., index]).any() else np.nan for r in z]
    )
    ok = np.isfinite(error) & (error > 0) & (m.velocities > 0)
    v = m.velocities[ok]
    if ok.sum() < 3 or v.max() < 1.5 * v.min():
        return ""
    slope = float(np.polyfit(np.log(v), np.log(error[ok]), 1)[0])
    if abs(slope) < _TREND:
        return ", and it is about the same at all velocities"
    return f", and it {'grows' if slope > 0 else 'falls'} with velocity"
