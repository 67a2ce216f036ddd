"""The same rig by solvers of scipy and diffrax, in a form they can take: sliding as fast relaxation to the cap."""

from __future__ import annotations

import time
from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
import numba
import numpy as np
from scipy.integrate import solve_ivp

from .case import C_S, D_C, DAMPING, MASS, RATIO, T_H, Answer, Case, on_grid

RELAXATION = 1e-5  # s; a cap is overrun by k v times this, 1e-4 of all strength at the slip's peak
SCIPY = ("LSODA", "RK45", "Radau", "BDF")
# with the steps between two looks at the clock
DIFFRAX = {"Tsit5": (diffrax.Tsit5, 10_000), "Kvaerno5": (diffrax.Kvaerno5, 200)}


class OverTime(Exception):
    """The allowed time is used up."""


def _typical(case: Case) -> np.ndarray:
    """Of the state: m, m/s, 1, N."""
    return np.concatenate([[1e-6, 1e-4, 1e-1], np.full(case.springs, 0.0256 / case.springs)])


@numba.njit(cache=True)
def _rates(t, y, stiffness, cap, m, c_s, c, v0, ratio, d_c, t_h, relaxation):
    rates = np.empty_like(y)
    x, v, psi = y[0], y[1], y[2]
    mu = ratio + (1.0 - ratio) * psi
    total = 0.0
    for i in range(cap.size):
        f, high = y[3 + i], mu * cap[i]
        held = min(max(f, -high), high)
        total += held
        rates[3 + i] = stiffness[i] * v - (f - held) / relaxation
    rates[0] = v
    rates[1] = (c_s * (v0 * t - x) - total - c * v) / m
    rates[2] = (1.0 - psi) / t_h - abs(v) * psi / d_c
    return rates


def scipy_answer(case: Case, method: str, rtol: float, until: float) -> tuple[Answer, int]:
    """Trace and number of evaluations; OverTime once the processor time of this process (s) is beyond ``until``."""
    count = 0

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        if count % 64 == 0 and time.process_time() > until:
            raise OverTime(f"reached {t:.2f} s of {case.duration:g} s")
        return _rates(t, y, case.stiffness, case.cap, MASS, C_S, DAMPING, case.velocity, RATIO, D_C, T_H, RELAXATION)

    start = np.zeros(3 + case.springs)
    start[2] = 1.0
    solution = solve_ivp(
        rates, (0.0, case.duration), start, method=method, t_eval=case.grid, rtol=rtol,
        atol=1e-2 * rtol * _typical(case),
    )  # fmt: skip
    if not solution.success:
        raise OverTime(solution.message)
    return Answer(solution.y[0], solution.y[1]), count


def diffrax_solver(case: Case, name: str) -> Callable[[float, float], tuple[Answer, int]]:
    """A stock solver of diffrax, compiled: from rtol and the time limit (as of `scipy_answer`) to trace and steps."""
    method, steps = DIFFRAX[name]
    steps = max(2, round(steps * min(1.0, (256 / case.springs) ** 2)))  # a matrix of 4000 rows takes seconds a step
    typical, stiffness, cap = (jnp.asarray(a) for a in (_typical(case), case.stiffness, case.cap))

    def rates(t, scaled, args):
        y = scaled * typical
        x, v, psi, f = y[0], y[1], y[2], y[3:]
        high = (RATIO + (1.0 - RATIO) * psi) * cap
        held = jnp.clip(f, -high, high)
        first = jnp.stack([
            v,
            (C_S * (case.velocity * t - x) - jnp.sum(held) - DAMPING * v) / MASS,
            (1.0 - psi) / T_H - jnp.abs(v) * psi / D_C,
        ])  # fmt: skip
        return jnp.concatenate([first, stiffness * v - (f - held) / RELAXATION]) / typical

    @jax.jit
    def piece(t, dt, y, rtol):
        return diffrax.diffeqsolve(
            diffrax.ODETerm(rates), method(), t, case.duration, dt, y,
            saveat=diffrax.SaveAt(subs=[
                diffrax.SubSaveAt(steps=True, fn=lambda t, y, args: (t, y[:2])),
                diffrax.SubSaveAt(t1=True),
            ]),
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=1e-2 * rtol), max_steps=steps, throw=False,
            adjoint=diffrax.ForwardMode(),
        )  # fmt: skip

    start = jnp.zeros(3 + case.springs).at[2].set(1.0 / typical[2])
    piece(case.duration - 1e-9, 1e-9, start, 1e-4)  # compiles

    def solve(rtol: float, until: float) -> tuple[Answer, int]:
        t, dt, y, count, path = 0.0, 1e-6, start, 0, [(np.zeros(1), np.zeros((1, 2)))]
        while t < case.duration:
            solution = piece(t, dt, y, rtol)
            n = int(solution.stats["num_accepted_steps"])
            count += int(solution.stats["num_steps"])
            (times, values), last = solution.ys
            if n == 0 or not bool(jnp.all(jnp.isfinite(last))):
                raise OverTime(f"gave up at {t:.2f} s of {case.duration:g} s")
            path.append((np.asarray(times)[:n], np.asarray(values)[:n] * np.asarray(typical)[:2]))
            dt, t, y = float(path[-1][0][-1] - (path[-1][0][-2] if n > 1 else t)), float(path[-1][0][-1]), last[0]
            if t < case.duration and time.process_time() > until:
                raise OverTime(f"reached {t:.2f} s of {case.duration:g} s")
        at, values = (np.concatenate(parts) for parts in zip(*path, strict=True))
        return on_grid(case, at, *values.T), count

    return solve
