"""The same physics once more, by brute force: every spring, leapfrog, a fixed step. Shares nothing with the solver.

``m v' = c_s (lead - x) - c v - sum(f_i)``, ``f_i`` follows ``k_i x`` and is cut back to ``+-cap_i (r + (1 - r) psi)``,
``psi' = (1 - psi)/t_h - |v| psi/D_c``. Velocity lives at half steps, displacement, forces and psi at whole steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np


class Path(NamedTuple):
    """Every ``every``-th whole step: time (s), displacement (m), velocity (m/s, mean of two half steps)."""

    t: np.ndarray
    x: np.ndarray
    v: np.ndarray


# numba's cache names the module that filled it, and the benchmarks have this one under another name
@numba.njit(fastmath=True, cache=not __name__.startswith("tests."))
def _march(dt, n, every, m, c_s, c, stiffness, cap, ratio, d_c, t_h, times, positions, x, v, force, psi):
    out = np.empty((n // every, 2))
    mean = v
    node = 0
    slope = (positions[1] - positions[0]) / (times[1] - times[0])
    total = force.sum()
    for j in range(n):
        t = j * dt
        while node < times.size - 2 and t >= times[node + 1]:
            node += 1
            slope = (positions[node + 1] - positions[node]) / (times[node + 1] - times[node])
        lead = positions[node] + slope * (t - times[node])
        step = 0.5 * dt if j == 0 else dt  # the start velocity is at a whole step
        pull = c_s * (lead - x) - total
        new = ((m - 0.5 * c * step) * v + step * pull) / (m + 0.5 * c * step)
        mean = 0.5 * (v + new)
        if j > 0 and j % every == 0:
            out[j // every - 1, 0] = x
            out[j // every - 1, 1] = mean
        v = new
        dx = dt * v
        x += dx
        rate = 1.0 / t_h + abs(v) / d_c
        rest = 1.0 / (t_h * rate)
        psi = rest + (psi - rest) * math.exp(-rate * dt)
        mu = ratio + (1.0 - ratio) * psi
        total = 0.0
        for i in range(force.size):
            high = mu * cap[i]
            f = min(max(force[i] + stiffness[i] * dx, -high), high)
            force[i] = f
            total += f
    if n % every == 0:
        out[n // every - 1, 0] = x
        out[n // every - 1, 1] = v
    return out


def springs(gaps: np.ndarray, dx: float, load: float, friction: float, normal: float, tangential: float) -> tuple:
    """Stiffness (N/m) and cap (N) of every touching spring of one line, pressed by ``load`` (N).

    ``gaps`` (m) below the highest point; ``normal`` and ``tangential`` are the moduli E*, G* (Pa).
    The depth is found by bisection.
    """
    low, high = 0.0, float(gaps.max() - gaps.min()) + load / (normal * dx)
    for _ in range(200):
        middle = 0.5 * (low + high)
        if normal * dx * np.maximum(middle - gaps, 0.0).sum() < load:
            low = middle
        else:
            high = middle
    depth = np.maximum(high - gaps, 0.0)
    depth = depth[depth > 0.0]
    return np.full(depth.size, tangential * dx), friction * normal * dx * depth


def simulate(
    stiffness: np.ndarray,
    cap: np.ndarray,
    *,
    duration: float,
    mass: float,
    spring_stiffness: float,
    damping: float,
    ratio: float,
    slip_distance: float,
    healing_time: float,
    times: np.ndarray,
    positions: np.ndarray,
    dt: float = 1e-6,
    every: int = 20,
    x: float = 0.0,
    v: float = 0.0,
    force: np.ndarray | None = None,
    psi: float = 1.0,
) -> Path:
    """March for ``duration`` (s) with the step ``dt`` (s); the load point is linear between its nodes. SI units."""
    force = np.zeros(len(cap)) if force is None else np.array(force, float)
    n = round(duration / dt / every) * every
    out = _march(
        dt, n, every, mass, spring_stiffness, damping, np.ascontiguousarray(stiffness, float),
        np.ascontiguousarray(cap, float), ratio, slip_distance, healing_time, np.asarray(times, float),
        np.asarray(positions, float), x, v, force, psi,
    )  # fmt: skip
    return Path(dt * every * np.arange(1, len(out) + 1), out[:, 0], out[:, 1])
