"""Energy balance and hysteresis along a trajectory: what the tests assert and docs/verification draws."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from stickslip.physics.contact import Hysteresis
from stickslip.simulation.solve import Steps, Tolerance, integrate

from .rig import STRENGTH, drive, rig, tighter

PIECES = ((1.0, 0.8e-6), (1.5, -0.8e-6), (1.2, 0.8e-6), (1.4, -0.85e-6))


class Cycle(NamedTuple):
    """Steps of a slow cyclic drive; the exact force of hysteresis at them (N); turning points it still remembers."""

    steps: Steps
    force: np.ndarray
    remembered: int


def path_with_turns(s: Steps) -> tuple[np.ndarray, np.ndarray]:
    """Displacements of the steps and of the turning points between them, in order; which of them are steps."""
    x, own = [s.x[0]], [True]
    for i in range(len(s.t) - 1):
        if s.v[i] * s.v[i + 1] < 0.0:
            inside = CubicHermiteSpline(s.t[i : i + 2], s.x[i : i + 2], s.v[i : i + 2])
            turns = list(inside.derivative().roots(extrapolate=False))
            x += [float(inside(r)) for r in turns]
            own += [False] * len(turns)
        x.append(s.x[i + 1])
        own.append(True)
    return np.array(x), np.array(own)


def slow_cycle(tolerance: Tolerance | None = None) -> Cycle:
    """Out, back beyond rest, out less far, back beyond the first return: an inner loop is closed and forgotten.

    A stiff spring and strong damping keep the block on the load point; friction is constant.
    """
    model = rig(load_point=drive(*PIECES), spring_stiffness=1e8, damping=2e4, ratio=1.0)
    stops = np.cumsum([d for d, _ in PIECES])[:-1]
    trajectory, _ = integrate(model, 5.1, tolerance=tolerance or tighter(100.0), stops=list(stops))
    exact = Hysteresis(model.bank.backbone)
    x, own = path_with_turns(trajectory.steps)
    force = np.array([exact.move_to(float(a)) for a in x])[own]
    return Cycle(trajectory.steps, force, len(exact.turning_points))


def imbalance(s: Steps) -> np.ndarray:
    """Energy that is missing at every step, over the work done by the spring up to the end."""
    gap = s.spring_work - (s.stored - s.stored[0]) - s.friction_work - s.viscous_work
    return gap / np.max(np.abs(s.spring_work))


__all__ = ["STRENGTH", "Cycle", "imbalance", "path_with_turns", "slow_cycle"]
