"""How the inertial model approaches the static one: what the tests assert and docs/verification draws."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stickslip.physics.model import Model
from stickslip.simulation.solve import Tolerance, integrate

from .rig import MASS, STRENGTH, U_MAX, P, already_creeping, bank, rig, tighter

FINE = 4000  # elements; few elements sliding one by one kick an undamped block, which has nothing to do with inertia


class Departure(NamedTuple):
    """Share of full friction by which the spring's force departs from the static curve, against w = u/u_max."""

    w: np.ndarray
    error: np.ndarray


def departure(model: Model, velocity: float, w_max: float, tolerance: Tolerance) -> Departure:
    """The virgin branch up to ``w_max``, from the velocity of quasi-static creep."""
    c_s = float(model.block.spring_stiffness)
    end = 1.02 * (float(model.bank.backbone(w_max * U_MAX)) / c_s + w_max * U_MAX) / velocity
    trajectory, _ = integrate(model, end, state=already_creeping(model, velocity), tolerance=tolerance)
    s = trajectory.steps
    w = s.x / U_MAX
    inside = (w > 0.02) & (w < w_max)
    static = np.asarray(model.bank.backbone(s.x[inside]))
    return Departure(w[inside], np.abs(s.spring_force[inside] - static) / STRENGTH)


def constant_friction(velocity: float, w_max: float = 0.5) -> Departure:
    return departure(rig(velocity, springs=bank(FINE), damping=0.0, ratio=1.0), velocity, w_max, tighter(100.0))


def base_law(velocity: float, w_max: float = 0.5) -> Departure:
    return departure(rig(velocity, springs=bank(FINE), damping=0.0), velocity, w_max, tighter(10.0))


def base_law_prediction(velocity: float, w: np.ndarray, ratio: float = 0.85, critical: float = 5e-5) -> np.ndarray:
    """(1 - r) times the share of strength that slides times v/v_c, v the velocity of quasi-static creep."""
    tangent = P * STRENGTH / U_MAX * (1.0 - w) ** (P - 1.0)
    slides = 1.0 - (1.0 - w) ** P - P * w * (1.0 - w) ** (P - 1.0)
    return (1.0 - ratio) * slides * 1000.0 * velocity / (tangent + 1000.0) / critical


def breakaway_lag(velocity: float, spring_stiffness: float = 1000.0) -> tuple[float, float]:
    """By how much later than statically the last element slides (s), and the scale T* of the boundary layer (s)."""
    model = rig(velocity, springs=bank(FINE), damping=0.0, ratio=1.0, spring_stiffness=spring_stiffness)
    static = (STRENGTH / spring_stiffness + U_MAX) / velocity
    loading = STRENGTH / (spring_stiffness * velocity)
    scale = loading * (MASS * U_MAX / (STRENGTH * loading**2)) ** (P / (3.0 * P - 1.0))
    trajectory, _ = integrate(
        model, static + 4.0 * scale, state=already_creeping(model, velocity), tolerance=tighter(10.0)
    )
    s = trajectory.steps
    after = int(np.argmax(s.x > U_MAX))
    return float(np.interp(U_MAX, s.x[after - 1 : after + 1], s.t[after - 1 : after + 1])) - static, scale
