"""What events scatter around the mean of their run: floors of a fit in which lines may be new at every event."""

from __future__ import annotations

import numpy as np

from stickslip.inference.features.measurement import Measurement

from .feature_floors import Scatter, level, root_sum

# From base fits of campaigns without a missing effect (docs/measuring): what is left of a fit where the lines are the
# same at every event, ...
ALONE = Scatter(
    recurrence=1.5e-4, recurrence_periods=0.015, size=2.5e-4, times=1e-4, overshoot=0.03, ring=0.02, ring_loudest=0.008,
    frequency=0.015, creep=0.002, creep_largest=0.0012, creep_clock=1e-5, hold=0.01, resolution=0.15e-9,
    overshoot_resolution=1e-9, first=30.0,
)  # fmt: skip
# ... and what new lines at every event add.
LINES = Scatter(
    recurrence=0.0015, recurrence_periods=0.1, size=0.0026, times=3e-4, overshoot=0.03, ring=0.02, ring_loudest=0.01,
    frequency=0.045, creep=0.006, creep_largest=0.004, creep_clock=5e-5, hold=0.01, resolution=0.2e-9,
    overshoot_resolution=1e-9, first=3.0,
)  # fmt: skip
NEW_SIZE, NEW_CREEP = 0.002, 0.012  # scatter of slip size and creep (share of the largest) where the lines are new
CREEP_NOISE = 0.003  # of that of the creep, from the sensor
MOST_VARIED = 1.5
CONTACTS = 4  # of the rigs that all these numbers are of: what rough lines do to the mean of n goes as 1/sqrt(n)
FEWEST = 4  # events of a run that tell scatter
CREEP_MIDDLE = slice(3, 9)  # points of the creep that scatter most with the lines


def floors(measurement: Measurement) -> np.ndarray:
    """Standard deviation of every feature around the mean of its run and a perfect model, SI, shape (R, n, F).

    The part of new lines counts as much as the events of the campaign scatter (:func:`scatter_factor`).
    """
    own, lines = level(measurement, ALONE), lines_share(measurement) * level(measurement, LINES)
    return root_sum(measurement.sensor, own, scatter_factor(measurement) * lines)


def lines_share(measurement: Measurement) -> float:
    """How much more (or less) rough lines do to the mean of this rig's contacts than to that of four."""
    return float(np.sqrt(CONTACTS / measurement.contacts)) if measurement.contacts else 1.0


def scatter_factor(measurement: Measurement) -> float:
    """How much the contact varies from event to event: 0 where the lines are the same, about 1 where they are new.

    What the measurement states, if it does. Else the lesser of what slip sizes and the shape of the creep say, for both
    scatter with the lines, and few effects do that with both. 0.5 where too few events tell.
    """
    if measurement.new_lines is not None:
        return measurement.new_lines
    m, s = measurement, measurement.layout.slices()
    used = np.asarray(m.cycles.used)
    ratios = []
    for r in range(m.runs):
        rows = used[r] & ~m.valid[r][:, s["hold"]].any(axis=1)
        rows[0] = False
        if rows.sum() < FEWEST:
            continue
        size, creep = m.values[r][rows, s["size"]], m.values[r][rows, s["creep"]]
        largest = np.mean(np.max(np.abs(creep), axis=1))
        middle = creep[:, CREEP_MIDDLE][:, m.valid[r][rows, s["creep"]][:, CREEP_MIDDLE].all(axis=0)]
        if middle.size and largest > 0:
            ratios.append((_scatter(size) / np.mean(size), _scatter(middle) / largest))
    if not ratios:
        return 0.5
    size, creep = np.median(ratios, axis=0)
    creep = np.sqrt(max(creep**2 - CREEP_NOISE**2, 0.0))
    varied = min(float(size) / NEW_SIZE, float(creep) / NEW_CREEP) / lines_share(m)
    return float(np.clip(varied, 0.0, MOST_VARIED))


def _scatter(values: np.ndarray) -> float:
    """Median over the columns of the standard deviation around a straight line in the number of the event."""
    t = np.arange(len(values))
    lines = np.polynomial.polynomial.polyval(t, np.polynomial.polynomial.polyfit(t, values, 1)).T
    return float(np.sqrt(np.median(np.sum((values - lines) ** 2, axis=0) / (len(values) - 2))))
