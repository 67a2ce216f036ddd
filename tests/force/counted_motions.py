"""Motions of the solver, and campaigns of them through a sensor that counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicHermiteSpline

import stickslip as ss
from stickslip.physics.effects.base import Effect
from stickslip.physics.model import Model
from stickslip.simulation.conformance.rig import base_model
from stickslip.simulation.solve import Tolerance, integrate

RATE, COUNT, NOISE = 1e4, 7.9e-9, 1.3e-9  # Hz, m, m
MASS, STIFFNESS = 0.0894, 1000.0  # kg, N/m
RIG = {
    "mass": f"{MASS} kg", "spring_stiffness": f"{STIFFNESS} N/m", "contacts": 4, "normal_force": "0.31 N",
    "friction_coefficient": {"guess": 0.21, "lower": 0.15, "upper": 0.3},
}  # fmt: skip


class Moved(NamedTuple):
    """A run of the solver: the model, its motion (s to m), how long it is (s), and the velocity of its drive (m/s).

    ``drive`` are the times (s) and positions (m) between which that is linear.
    """

    model: Model
    course: CubicHermiteSpline
    end: float
    speed: float
    drive: tuple[np.ndarray, np.ndarray]


def moved(
    speed: float, end: float, tolerance: float = 1e-4, effects: Sequence[Effect] = (), turn: float | None = None,
    holds: Sequence[tuple[float, float]] = (), **weakening: float,
) -> Moved:  # fmt: skip
    """The base model, with ``effects``, under a steady drive that may turn at a time (s) and go back.

    In ``holds``, each from a time on and as long (s), it stands; such a drive does not turn.

    ``damping`` and ``healing_time`` may be others than the rig's.
    """
    assert turn is None or not holds
    times = np.array([0.0, *(t for at, long in holds for t in (at, at + long)), *([] if turn is None else [turn]), end])
    moves = np.where(np.isin(times[:-1], [at for at, _ in holds]), 0.0, speed)
    moves = np.where(times[:-1] == turn, -moves, moves)
    positions = np.concatenate([[0.0], np.cumsum(moves * np.diff(times))])
    values = [times, positions, MASS, STIFFNESS]

    def of(m: Model) -> list[object]:
        own = {"damping": m.block.damping, "healing_time": m.weakening.healing_time}
        fields = [m.load_point.times, m.load_point.positions, m.block.mass, m.block.spring_stiffness]
        return [*fields, *(own[name] for name in weakening)]

    model = eqx.tree_at(of, base_model(tuple(effects)), [jnp.asarray(a) for a in (*values, *weakening.values())])
    steps = integrate(model, end, tolerance=Tolerance(tolerance, 1e-12, 1e-9), largest_step=4e-3)[0].steps
    return Moved(model, CubicHermiteSpline(steps.t, steps.x, steps.v), float(steps.t[-1]), speed, (times, positions))


def read(runs: Sequence[Moved], seed: int, noise: float = NOISE, count: float = COUNT) -> ss.Campaign:
    """A campaign of runs, seen with white noise (m) and in counts (m), of which there may be none."""
    random, traces = np.random.default_rng(seed), []
    for number, run in enumerate(runs, 1):
        t = np.arange(0.0, run.end, 1.0 / RATE)
        x = run.course(t) + noise * random.standard_normal(t.size)
        x = count * np.round(x / count) if count else x
        name = f"{number}-v{1e6 * run.speed:.0f}"
        drive = {"drive_velocity": run.speed}
        if run.drive[0].size > 2:
            drive = {"drive_position": np.interp(t, *run.drive)}
        traces.append(ss.Trace.from_arrays(name, time=t, displacement=x, resolution=count or 1e-13, **drive))
    return ss.Campaign.from_traces(traces, RIG)
