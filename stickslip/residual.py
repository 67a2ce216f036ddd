"""How far the model is from the data, feature by feature, in units of what the data can tell: the floors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .features.layout import PHASES
from .features.measurement import Measurement


@dataclass(frozen=True)
class Misfit:
    """Root mean square of residual over floor (1 means as good as the data allow), robust against single features.

    Attributes:
        total: over everything.
        by_phase: phase -> error; phases without data are left out.
        by_run: run -> phase -> error.
        alike: phase -> what all events, or all of a run, have in common, in the standard deviations expected of that
            (root mean square over the features; it is not in the errors). Empty where nothing was fitted.
    """

    total: float
    by_phase: dict[str, float]
    by_run: dict[str, dict[str, float]]
    alike: dict[str, float] = field(default_factory=dict)


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
