"""How far the model is from the data, feature by feature, in units of what the data can tell: the floors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .features.layout import PHASES
from .features.measurement import Measurement


@dataclass(frozen=True)
class Scatter:
    """Share of a feature that varies from one realisation of the contact to the next, besides what is refitted.

    Relative parts are shares of the feature; ``size`` of the slip, ``times`` of the slip's duration.
    Found by simulating rigs with many rough lines; checked in tests/fit/test_floors.py, see docs/measuring.
    """

    recurrence: float = 0.001
    recurrence_periods: float = 0.1  # in periods of the contact resonance: its phase decides the onset
    size: float = 0.0015
    times: float = 0.0015
    overshoot: float = 0.05
    ring: float = 0.05
    frequency: float = 0.03
    creep: float = 0.006
    creep_largest: float = 0.004
    creep_clock: float = 4e-5  # s
    hold: float = 0.025
    resolution: float = 0.4e-9  # m
    overshoot_resolution: float = 1.5e-9  # m
    virgin: float = 3.0  # factor on all of these in a virgin cycle, which sees the whole shape of the lines


def floors(measurement: Measurement, scatter: Scatter | None = None, factor: float = 1.0) -> np.ndarray:
    """Standard deviation of every feature around a perfect model, SI, shape (R, n, F).

    Args:
        measurement: the data.
        scatter: shares of realisation scatter.
        factor: on the realisation part: 1 where the lines are the same at every event, about 2 where they are new.
    """
    k = Scatter() if scatter is None else scatter
    m, s = measurement, measurement.layout.slices()
    v = m.values
    real = np.zeros_like(v)
    period = np.asarray(m.anchors.ring_period)[..., None]
    real[..., s["recurrence"]] = np.hypot(k.recurrence * v[..., s["recurrence"]], k.recurrence_periods * period)
    real[..., s["size"]] = k.size * v[..., s["size"]]
    times = v[..., s["times"]]
    duration = (times[..., -1] - times[..., 0])[..., None]
    real[..., s["times"]] = np.hypot(k.times * duration, 0.0)
    real[..., s["overshoot"]] = np.hypot(k.overshoot * v[..., s["overshoot"]], k.overshoot_resolution)
    loudest = np.max(np.abs(v[..., s["ring"]]), axis=-1, keepdims=True)
    real[..., s["ring"]] = np.hypot(k.ring * v[..., s["ring"]], 0.02 * loudest)
    real[..., s["frequency"]] = k.frequency * v[..., s["frequency"]]
    creep = v[..., s["creep"]]
    before = np.asarray(m.anchors.creep)
    slope = np.gradient(creep, axis=-1) / np.gradient(before, axis=-1)
    largest = np.max(np.abs(creep), axis=-1, keepdims=True)
    real[..., s["creep"]] = _root_sum(k.creep * creep, k.creep_largest * largest, k.creep_clock * slope, k.resolution)
    real[..., s["settle"]] = _root_sum(k.creep * v[..., s["settle"]], k.creep_largest * largest, k.resolution)
    real[..., s["hold"]] = _root_sum(k.hold * v[..., s["hold"]], k.creep_largest * largest, k.resolution)
    real[:, 0] *= k.virgin
    return np.hypot(m.sensor, factor * real)


def _root_sum(*parts: np.ndarray | float) -> np.ndarray:
    return np.sqrt(sum(np.square(p) for p in parts))


def scatter_factor(measurement: Measurement) -> float:
    """How much the contact varies from event to event, in units of the floors' own share: 1 (same lines) to 2 (new).

    Taken from the slip size, which neither drive nor sensor can scatter much.
    """
    s = measurement.layout.slices()["size"]
    used = np.asarray(measurement.cycles.used)
    ratios = []
    for r in range(measurement.runs):
        sizes = measurement.values[r][used[r]][1:, s].ravel()
        holds = measurement.valid[r][used[r]][1:, measurement.layout.slices()["hold"]].any(axis=1)
        sizes = sizes[~holds]
        if sizes.size >= 4:
            trend = np.polynomial.polynomial.polyfit(np.arange(sizes.size), sizes, 1)
            rest = sizes - np.polynomial.polynomial.polyval(np.arange(sizes.size), trend)
            ratios.append(np.std(rest, ddof=2) / np.mean(sizes))
    if not ratios:
        return 1.5
    return float(np.clip(np.median(ratios) / 0.0015, 1.0, 2.0))


def shared_cycles(measurement: Measurement) -> float:
    """How many cycles have the same lines and so the same realisation of what no model of few parameters describes.

    Their average knows no more of it than one of them. All cycles where the lines are the same at every event
    (:func:`scatter_factor` 1), one where they are new (2).
    """
    n = float(np.sum(np.asarray(measurement.cycles.used)))
    return 1.0 + (n - 1.0) * float(np.clip(2.0 - scatter_factor(measurement), 0.0, 1.0))


@dataclass(frozen=True)
class Misfit:
    """Root mean square of residual over floor (1 means as good as the data allow), robust against single features.

    Attributes:
        total: over everything.
        by_phase: phase -> error; phases without data are left out.
        by_run: run -> phase -> error.
    """

    total: float
    by_phase: dict[str, float]
    by_run: dict[str, dict[str, float]]


def misfit(measurement: Measurement, model: np.ndarray, floor: np.ndarray) -> Misfit:
    """Errors of the model's features (R, n, F) by phase and run."""
    z = np.where(measurement.valid, (measurement.values - model) / floor, np.nan)
    z = np.nan_to_num(z, nan=np.nan, posinf=1e6, neginf=-1e6)
    phase = measurement.layout.phase_index()

    def rms(part: np.ndarray) -> float | None:
        part = part[np.isfinite(part)]
        return float(np.sqrt(np.mean(np.square(np.clip(part, -1e6, 1e6))))) if part.size else None

    def phases(part: np.ndarray) -> dict[str, float]:
        errors = {name: rms(part[..., phase == i]) for i, name in enumerate(PHASES)}
        return {name: e for name, e in errors.items() if e is not None}

    by_phase = phases(z)
    # every phase counts alike, however many features describe it
    total = float(np.sqrt(np.mean(np.square(list(by_phase.values()))))) if by_phase else 0.0
    return Misfit(total, by_phase, {name: phases(z[r]) for r, name in enumerate(measurement.names)})
