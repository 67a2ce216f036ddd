"""The same rig by scipy's solvers, in a form they can take: sliding as fast relaxation towards the cap."""

from __future__ import annotations

import time

import numba
import numpy as np
from scipy.integrate import solve_ivp

from .case import C_S, CAP, D_C, DAMPING, DURATION, GRID, MASS, RATIO, STIFFNESS, T_H, VELOCITY, Answer

RELAXATION = 1e-5  # s; a cap is overrun by k v times this, 1e-4 of all strength at the slip's peak
_TYPICAL = np.concatenate([[1e-6, 1e-4, 1e-1], np.full(CAP.size, 1e-4)])  # m, m/s, 1, N: what atol is a share of


class OverTime(Exception):
    """The allowed time is used up."""


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


def scipy_answer(method: str, rtol: float, until: float) -> tuple[Answer, int]:
    """Trace and number of evaluations; OverTime once the processor time of this process (s) is beyond ``until``."""
    count = 0

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        if count % 64 == 0 and time.process_time() > until:
            raise OverTime(f"reached {t:.2f} s of {DURATION:g} s")
        return _rates(t, y, STIFFNESS, CAP, MASS, C_S, DAMPING, VELOCITY, RATIO, D_C, T_H, RELAXATION)

    start = np.zeros(3 + CAP.size)
    start[2] = 1.0
    solution = solve_ivp(
        rates, (0.0, DURATION), start, method=method, t_eval=GRID, rtol=rtol, atol=1e-2 * rtol * _TYPICAL
    )
    if not solution.success:
        raise OverTime(solution.message)
    return Answer(solution.y[0], solution.y[1]), count
