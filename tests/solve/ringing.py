"""Ring-down of the block on its contact: what the tests assert and docs/verification draws."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from stickslip.physics.model import Model
from stickslip.simulation.solve import Tolerance, integrate

from .rig import FAR, MASS, STRENGTH, U_MAX, P, drive, fine_start_bank, rig, tighter

TANGENT = P * STRENGTH / U_MAX  # N/m, stiffness of the virgin contact


def microslip_ring_down(t: np.ndarray, start: float, angular_frequency: float, u_max: float, p: float) -> np.ndarray:
    """Amplitude (m) at time ``t`` (s) of ringing that only microslip damps, while it is small against ``u_max``.

    A small cycle loses as much as a damper of the ratio (p - 1) A/(3 pi u_max).
    """
    return start / (1.0 + (p - 1.0) * start / (3.0 * np.pi * u_max) * angular_frequency * t)


class Ringing(NamedTuple):
    """Turning points on the far side: time (s) and displacement from rest (m)."""

    t: np.ndarray
    amplitude: np.ndarray


def free_ringing(model: Model, velocity: float, duration: float, tolerance: Tolerance) -> Ringing:
    """A kick of ``velocity`` (m/s) to a block whose load point stands still."""
    trajectory, _ = integrate(model, duration, state=model.rest(v=velocity), tolerance=tolerance)
    s = trajectory.steps
    curve = CubicHermiteSpline(s.t, s.x, s.v)
    top = np.flatnonzero((s.v[:-1] > 0.0) & (s.v[1:] <= 0.0))
    # the velocity crosses zero linearly to the accuracy of a step
    t = s.t[top] + (s.t[top + 1] - s.t[top]) * s.v[top] / (s.v[top] - s.v[top + 1])
    return Ringing(t, curve(t))


def undriven(spring_stiffness: float = 1000.0, **options: float):
    return rig(
        springs=fine_start_bank(4000), load_point=drive((FAR, 0.0)), damping=0.0, ratio=1.0,
        spring_stiffness=spring_stiffness, **options,
    )  # fmt: skip


def microslip(amplitude: float, cycles: int = 60) -> tuple[Ringing, np.ndarray]:
    """Ringing that starts at about ``amplitude`` (m) and is damped by microslip alone, and the hyperbolic law."""
    model = undriven()
    omega = np.sqrt((TANGENT + 1000.0) / MASS)
    ringing = free_ringing(model, amplitude * omega, cycles * 2.0 * np.pi / omega, tighter(30.0))
    law = microslip_ring_down(ringing.t - ringing.t[0], ringing.amplitude[0], omega, U_MAX, P)
    return ringing, np.asarray(law)


def frequency(amplitude: float = 1e-9, spring_stiffness: float = 1000.0) -> tuple[float, float]:
    """Frequency of small ringing, seen and expected (Hz)."""
    omega = np.sqrt((TANGENT + spring_stiffness) / MASS)
    ringing = free_ringing(undriven(spring_stiffness), amplitude * omega, 20 * 2.0 * np.pi / omega, tighter(30.0))
    return (len(ringing.t) - 1) / (ringing.t[-1] - ringing.t[0]), omega / (2.0 * np.pi)
