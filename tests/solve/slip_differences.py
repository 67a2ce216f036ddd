"""Derivatives of every slip: those of the solver, and differences of the brute-force simulation."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.physics.model import Model
from stickslip.simulation.solve import Tolerance, integrate
from stickslip.simulation.solve.derivatives import EXACT, GRIDS, Slips, mean_slips, slip_derivatives, slip_grid

from . import brute_force
from .derivatives import BASE, build
from .rig import bank, tighter

END = 7.1  # s; three slips
SHOWN = ("onset", "recurrence", "slip", "peak_velocity")


def table(slips: Slips) -> dict[str, np.ndarray]:
    """First onset, recurrences, slips and peak velocities (or their derivatives, parameters first)."""
    onset = np.asarray(slips.onset)
    return {
        "onset": onset[..., :1],
        "recurrence": np.diff(onset),
        "slip": np.asarray(slips.slip),
        "peak_velocity": np.asarray(slips.peak_velocity),
    }


def _march(theta: np.ndarray, dt: float) -> brute_force.Path:
    m, c_s, c, r, d_c, t_h, u_max, p, strength, v = BASE * np.exp(theta)
    b = bank(128, u_max, p, strength)
    return brute_force.simulate(
        np.asarray(b.stiffness), np.asarray(b.strength), duration=END, mass=m, spring_stiffness=c_s, damping=c,
        ratio=r, slip_distance=d_c, healing_time=t_h, times=[0.0, 1.0], positions=[0.0, v], dt=dt, every=10,
    )  # fmt: skip


def path_slips(path: brute_force.Path, speed: float) -> Slips:
    """Slips of a path: from where it begins to outrun the load point (m/s) to where it no longer does."""
    t, x, v = path
    found = []
    i = 0
    while np.any(fast := v[i:] > 10.0 * speed):
        a = i + int(np.argmax(fast))
        first = int(np.flatnonzero(v[:a] <= speed)[-1]) + 1
        after = a + int(np.argmax(v[a:] <= speed))
        onset, arrest = (_through(t, v, k, speed) for k in (first, after))
        begin, end = (_at(t, x, v, k, moment) for k, moment in ((first, onset), (after, arrest)))
        top = first + int(np.argmax(v[first:after]))
        bend = np.polyfit(t[top - 4 : top + 5] - t[top], v[top - 4 : top + 5], 2)
        found.append((onset, arrest, end - begin, bend[2] - bend[1] ** 2 / (4.0 * bend[0]), begin))
        i = after
    return Slips(*np.array(found).T)


def _through(t: np.ndarray, v: np.ndarray, i: int, level: float) -> float:
    return float(t[i - 1] + (t[i] - t[i - 1]) * (level - v[i - 1]) / (v[i] - v[i - 1]))


def _at(t: np.ndarray, x: np.ndarray, v: np.ndarray, i: int, moment: float) -> float:
    """Displacement between two samples, with the velocity linear in between."""
    s = moment - t[i - 1]
    return float(x[i - 1] + v[i - 1] * s + 0.5 * (v[i] - v[i - 1]) / (t[i] - t[i - 1]) * s * s)


def brute_slips(theta: np.ndarray, dt: float = 4e-6) -> Slips:
    """Slips of the rig by brute force."""
    return path_slips(_march(theta, dt), float(BASE[-1] * np.exp(theta[-1])))


@functools.cache
def brute_differences(step: float) -> dict[str, np.ndarray]:
    """Central differences of `table` by brute force in every parameter, shape (parameters, ...)."""
    moves = step * np.eye(len(BASE))
    there, back = ([brute_slips(sign * move) for move in moves] for sign in (1.0, -1.0))
    columns = [
        {name: (a - b) / (2.0 * step) for (name, a), b in zip(table(p).items(), table(q).values(), strict=True)}
        for p, q in zip(there, back, strict=True)
    ]
    return {name: np.stack([c[name] for c in columns]) for name in SHOWN}


@functools.cache
def solved(
    factor: float = 10.0, refine: int = 2, grids: int = GRIDS
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """`table` of the solver's slips and of their derivatives, the steps taken from a run this much tighter."""
    values, columns = slip_derivatives(
        build, np.zeros(len(BASE)), END, tolerance=tighter(factor), refine=refine, grids=grids
    )
    return table(values), table(columns)


@functools.cache
def on_tied_steps(factor: float = 10.0, refine: int = 2, grids: int = GRIDS):
    """The slips as a function of theta, on steps tied to the motion."""
    model: Model = build(jnp.zeros(len(BASE)))
    tolerance: Tolerance = tighter(factor)
    trajectory, _ = integrate(model, END, tolerance=tolerance)
    grid = slip_grid(model, trajectory, refine, grids)
    exact = jax.tree.map(lambda a: EXACT * a, tolerance)

    @jax.jit
    def slips(theta: jax.Array) -> Slips:
        model = build(theta)
        return mean_slips(model, model.rest(), grid, exact, refine)

    return slips


def errors(seen: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> dict[str, float]:
    """Largest difference of two tables of derivatives, over the largest derivative of the same quantity."""
    return {k: float(np.max(np.abs(seen[k] - expected[k])) / np.max(np.abs(expected[k]))) for k in SHOWN}
