"""What the data can tell of a feature: noise, scatter of the contact, and what a bank of few parameters gets wrong."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.inference.features.measurement import Measurement


@dataclass(frozen=True)
class Scatter:
    """Standard deviations of a level, besides what is refitted.

    Relative parts are shares of the feature; ``times`` of the slip's duration. The defaults are those of a single event
    predicted from other runs, all levels together.
    """

    recurrence: float = 0.001
    recurrence_periods: float = 0.1  # in periods of the contact resonance: its phase decides the onset
    size: float = 0.0015
    times: float = 0.0015
    overshoot: float = 0.05
    ring: float = 0.05
    ring_loudest: float = 0.02  # of the loudest window
    frequency: float = 0.03
    creep: float = 0.006
    creep_largest: float = 0.004
    creep_clock: float = 4e-5  # s
    hold: float = 0.025
    resolution: float = 0.4e-9  # m
    overshoot_resolution: float = 1.5e-9  # m
    first: float = 3.0  # factor on all of these in the first cycle of a run: a virgin contact shows the whole shape of
    # its lines, and one that is not begins in a state that nobody has seen


def floors_alone(measurement: Measurement, *, factor: float = 1.0) -> np.ndarray:
    """Standard deviation of the features of a single event predicted from others (SI, shape (R, n, F))."""
    return root_sum(measurement.sensor, factor * level(measurement, Scatter()))


def level(measurement: Measurement, k: Scatter) -> np.ndarray:
    """Standard deviation of every feature without that of the sensor (SI, shape (R, n, F))."""
    m, s = measurement, measurement.layout.slices()
    v = m.values
    real = np.zeros_like(v)
    period = np.asarray(m.anchors.ring_period)[..., None]
    real[..., s["recurrence"]] = np.hypot(k.recurrence * v[..., s["recurrence"]], k.recurrence_periods * period)
    real[..., s["size"]] = k.size * v[..., s["size"]]
    times = v[..., s["times"]]
    real[..., s["times"]] = k.times * (times[..., -1] - times[..., 0])[..., None]
    real[..., s["overshoot"]] = np.hypot(k.overshoot * v[..., s["overshoot"]], k.overshoot_resolution)
    loudest = np.max(np.abs(v[..., s["ring"]]), axis=-1, keepdims=True)
    real[..., s["ring"]] = np.hypot(k.ring * v[..., s["ring"]], k.ring_loudest * loudest)
    real[..., s["frequency"]] = k.frequency * v[..., s["frequency"]]
    creep = v[..., s["creep"]]
    before = np.asarray(m.anchors.creep)
    slope = np.gradient(creep, axis=-1) / np.gradient(before, axis=-1)
    largest = np.max(np.abs(creep), axis=-1, keepdims=True)
    real[..., s["creep"]] = root_sum(k.creep * creep, k.creep_largest * largest, k.creep_clock * slope, k.resolution)
    real[..., s["settle"]] = root_sum(k.creep * v[..., s["settle"]], k.creep_largest * largest, k.resolution)
    real[..., s["hold"]] = root_sum(k.hold * v[..., s["hold"]], k.creep_largest * largest, k.resolution)
    real[:, 0] *= k.first
    return real


def root_sum(*parts: np.ndarray | float) -> np.ndarray:
    """Root of the sum of squares."""
    return np.sqrt(sum(np.square(p) for p in parts))
