"""Which periods the base's residuals hint at, for effects that come back in time, in travel or along the track."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..features.measurement import Measurement

Variable = Literal["time", "load point", "displacement"]
MOST = 400  # frequencies tried
KEPT = 5


def periods(
    variable: Variable, measurement: Measurement, residual: np.ndarray, use: np.ndarray, bounds: tuple[float, float]
) -> list[float]:
    """Periods (s or m) with which recurrence and slip size deviate most, the strongest first.

    A sine and a cosine over ``variable`` at the slips are fitted to the two residuals for every frequency that the
    record resolves; neighbours of a frequency already taken are left out.

    Args:
        variable: over which the effect is periodic.
        measurement: the data.
        residual: of the base over its floors, shape (R, n, F).
        use: cycles to look at, shape (R, n).
        bounds: shortest and longest period.
    """
    m, s = measurement, measurement.layout.slices()
    ok = use & m.valid[..., s["recurrence"].start] & m.valid[..., s["size"].start]
    if ok.sum() < 6:
        return []
    start = np.asarray(m.cycles.start)
    slip = start + m.values[..., s["recurrence"].start]
    if variable == "time":
        at = slip[ok]
    elif variable == "displacement":
        at = np.asarray(m.cycles.position)[ok]
    else:
        nodes = zip(np.asarray(m.cycles.load_times), np.asarray(m.cycles.load_positions), strict=True)
        travel = np.stack([_along(t, p, row) for (t, p), row in zip(nodes, slip, strict=True)])
        at = travel[ok]
    data = np.stack([residual[..., s["recurrence"].start][ok], residual[..., s["size"].start][ok]], axis=1)
    data = np.clip(data, -50, 50) - np.clip(data, -50, 50).mean(axis=0)
    span = float(np.ptp(at))
    if span <= 0:
        return []
    low, high = max(1.0 / bounds[1], 0.3 / span), 1.0 / bounds[0]
    # half the record's own resolution; where the band is wider than that allows, its lower part
    frequency = np.arange(low, high, max(0.3 / span, 1e-12))[:MOST]
    if frequency.size == 0:
        return [bounds[1]]
    power = np.empty(frequency.size)
    for i, f in enumerate(frequency):
        basis = np.stack([np.sin(2 * np.pi * f * at), np.cos(2 * np.pi * f * at), np.ones_like(at)], axis=1)
        rest = data - basis @ np.linalg.lstsq(basis, data, rcond=None)[0]
        power[i] = 1.0 - np.sum(rest**2) / max(np.sum(data**2), 1e-30)
    out: list[float] = []
    for i in np.argsort(power)[::-1]:
        if all(abs(frequency[i] - 1.0 / p) > 0.5 / span for p in out):
            out.append(float(1.0 / frequency[i]))
        if len(out) == KEPT:
            break
    return out


def _along(times: np.ndarray, positions: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Load point at ``t``; beyond the last node it goes on at the last velocity."""
    last = (positions[-1] - positions[-2]) / (times[-1] - times[-2])
    return np.interp(t, times, positions) + np.maximum(t - times[-1], 0.0) * last
