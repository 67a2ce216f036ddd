"""Slip events, sliding and what follows them: what the tests assert and docs/verification draws."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from stickslip.physics.model import Model
from stickslip.simulation.solve import Tolerance, Trajectory, integrate

from .rig import MASS, STRENGTH, Slips, bank, rig, sliding, slips, tighter

DROP = 0.15 * STRENGTH  # N, static minus kinetic friction


class Run(NamedTuple):
    trajectory: Trajectory
    events: Slips


def run(model: Model, duration: float, tolerance: Tolerance | None = None, **options: Any) -> Run:
    trajectory, _ = integrate(model, duration, tolerance=tolerance, **options)
    s = trajectory.steps
    return Run(trajectory, slips(s.t, s.x, s.v))


class Classical(NamedTuple):
    """A rigid block on a spring with a drop of friction: slip (m), duration (s), peak velocity (m/s), force left."""

    slip: float
    duration: float
    peak: float
    left: float


def classical(spring_stiffness: float, damping: float) -> Classical:
    """Quarter and half period of the oscillator m, c_s, c that is released DROP above its equilibrium."""
    root = np.sqrt(MASS * spring_stiffness)
    ratio = damping / (2.0 * root)
    overshoot = np.exp(-np.pi * ratio)
    return Classical(
        DROP * (1.0 + overshoot) / spring_stiffness,
        np.pi * np.sqrt(MASS / spring_stiffness),
        DROP / root * np.exp(-0.5 * np.pi * ratio),
        STRENGTH - DROP - DROP * overshoot,
    )


def growth(velocity: float, damping: float = 0.5, duration: float = 0.5) -> float:
    """Rate (1/s) at which a small oscillation about steady sliding grows."""
    model = rig(velocity, damping=damping)
    trajectory, _ = integrate(model, duration, state=sliding(model, velocity, 1e-3), tolerance=tighter(100.0))
    s = trajectory.steps
    away = s.v - velocity
    top = 1 + np.flatnonzero((away[1:-1] > away[:-2]) & (away[1:-1] >= away[2:]) & (away[1:-1] > 0.0))
    top = top[1:]
    return float(np.polyfit(s.t[top], np.log(away[top]), 1)[0])


def critical_velocity(damping: float = 0.5, d_c: float = 1e-6, t_h: float = 0.02, c_s: float = 1000.0) -> float:
    """Velocity (m/s) above which steady sliding is stable: all roots of its cubic to the left (Routh and Hurwitz)."""
    low, high = d_c / t_h, 1.0
    for _ in range(100):
        middle = np.sqrt(low * high)
        over = middle * t_h / d_c
        rate = (1.0 + over) / t_h
        weakening = DROP / (d_c * (1.0 + over))
        stable = (damping + MASS * rate) * (c_s + damping * rate - weakening) > MASS * c_s * rate
        low, high = (low, middle) if stable else (middle, high)
    return float(high)


def creep_to(made: Run, speed: float) -> list[float]:
    """Creep (m) of every stick phase up to the last time before the slip at which it is as slow as ``speed`` (m/s).

    It is counted from where the block comes to rest, ringing averaged out and the drive's motion since then taken off.
    """
    s, e = made.trajectory.steps, made.events
    tangent = float(bank().total_stiffness)
    found = []
    for i, onset in enumerate(e.onset):
        last = np.flatnonzero((s.t < onset) & (s.v < speed))[-1]
        rest = 0.0
        if i > 0:
            arrest = e.arrest[i - 1]
            stick = made.trajectory.at(arrest + np.linspace(0.3, 0.6, 3000) * (onset - arrest))
            loaded = stick.spring_force.mean() - np.interp(arrest, s.t, s.spring_force)
            rest = stick.x.mean() - loaded / tangent
        found.append(float(s.x[last] - rest))
    return found
