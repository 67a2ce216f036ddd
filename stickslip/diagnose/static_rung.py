"""The lowest rung of the ladder: the paper's static model, which creeps along a virgin curve and never slips."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from ..features.measurement import Measurement
from ..fit.inertial import HUBER, Fit


def static_features(
    measurement: Measurement, floor: np.ndarray, base: Fit, stiffness: float, use: np.ndarray
) -> np.ndarray:
    """Features of the best static model, SI, shape (R, n, F).

    Every creep curve is the virgin power-law backbone, aligned at its slip (Grzemba 2014): force F_s - c_s v s at the
    time s before. Its u_max and exponent are fitted to the creep of the cycles in ``use``. It has no slip, no ringing
    and no relaxation, and each event needs the whole load anew.
    """
    m, s = measurement, measurement.layout.slices()
    values = base.values
    strength = values["contact.strength"]
    own = np.asarray(m.cycles.stiffness)
    c = np.where(np.isfinite(own), own, stiffness)[:, None]
    rate = c * m.velocities[:, None]  # N/s
    before = np.asarray(m.anchors.creep)
    begun = (before[..., -1] + m.layout.shortest)[..., None]

    def creep(u_max: float, p: float, at: np.ndarray) -> np.ndarray:
        left = np.clip(rate[..., None] * at / strength, 0.0, 1.0)
        return u_max * (1.0 - left ** (1.0 / p))

    def curves(x: np.ndarray) -> np.ndarray:
        u_max, p = np.exp(x[0]), 1.0 + np.exp(x[1])
        return creep(u_max, p, before) - creep(u_max, p, begun)

    ok = (m.valid & use[..., None])[..., s["creep"]]
    weight = 1.0 / floor[..., s["creep"]]

    def residual(x: np.ndarray) -> np.ndarray:
        return ((curves(x) - m.values[..., s["creep"]]) * weight)[ok]

    start = np.array([np.log(values["contact.u_max"]), np.log(max(values["contact.p"] - 1.0, 0.1))])
    found = least_squares(residual, start, loss="huber", f_scale=HUBER) if ok.any() else None
    out = np.zeros_like(m.values)
    out[..., s["creep"]] = curves(start if found is None else found.x)
    out[..., s["recurrence"]] = (strength / rate)[..., None]
    return out
