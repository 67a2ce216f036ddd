"""A velocity step as rock mechanics reads it: rate-and-state friction behind the machine's spring, nothing else.

Not the program's model, but an independent computation (Marone, Annu. Rev. Earth Planet. Sci. 26 (1998) 643, eq. 4 to
7): the load point moves at v1, then at v2; the force of the spring is the friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares, minimize

LAWS = ("ageing", "slip")
BEFORE, DURING, AFTER = (
    300,
    600,
    500,
)  # points before the step, over its first fifty micrometres, and spaced as log time
NEAR, TRANSIENT = (
    10e-6,
    50e-6,
)  # m of the load point, over which misfits are correlated, and that count as the transient
SLOPES: dict[str, Any] = {"jac": "3-point", "diff_step": 1e-4}  # above the error of the integration
FINE = {"xatol": 0.02, "fatol": 0.02}
NAMES = ("mu", "a", "b", "L", "k", "trend", "late")
SCALE = (1e-3, 1e-3, 1e-3, 0.3, 0.3, 1e-6, 0.1)
LOWER = (0.0, 1e-4, -0.1, np.log(1e-7), np.log(10.0), -1.0, -5.0)
UPPER = (1.0, 0.1, 0.1, np.log(2e-3), np.log(1e6), 1.0, 5.0)


@dataclass(frozen=True)
class Step:
    """Friction (1) at times (s) around a step of the load point at ``step`` (s) from ``v1`` to ``v2`` (m/s)."""

    time: np.ndarray
    friction: np.ndarray
    step: float
    v1: float
    v2: float

    @classmethod
    def of(cls, t: np.ndarray, x: np.ndarray, mu: np.ndarray) -> Step:
        """The step where two straight lines describe the motion of the load point best."""

        def lines(at: float) -> tuple[float, np.ndarray]:
            columns = np.stack([np.ones_like(t), t - at, np.maximum(t - at, 0.0)], axis=1)
            found, left, _, _ = np.linalg.lstsq(columns, x, rcond=None)
            return float(left[0]), found

        tried = np.linspace(t[0], t[-1], 402)[20:-20]
        for width in (t[-1] - t[0], 0.02 * (t[-1] - t[0])):
            centre = min(tried, key=lambda at: lines(at)[0])
            tried = np.linspace(-0.01, 0.01, 101) * width + centre
        at = float(min(tried, key=lambda at: lines(at)[0]))
        _, (_, v1, more) = lines(at)
        v2 = float(v1 + more)
        wanted = [
            np.linspace(t[0], at, BEFORE), at + np.linspace(0.0, TRANSIENT / v2, DURING),
            at + np.geomspace(0.1 * NEAR / v2, t[-1] - at, AFTER),
        ]  # fmt: skip
        own = np.unique(np.searchsorted(t, np.concatenate(wanted)).clip(0, t.size - 1))
        return cls(t[own], mu[own], at, float(v1), v2)

    def model(self, p: np.ndarray, law: str) -> np.ndarray:
        """Friction of a law with ``NAMES``: L in log m, k in log 1/m, the trend in 1/s, a late step in s."""
        mu, a, b, length, k, trend, late = p
        length, k, at = np.exp(length), np.exp(k), self.step + late

        def rates(t: float, y: np.ndarray) -> list[float]:
            speed = self.v1 * np.exp(np.clip((y[0] - mu - b * y[1]) / a, -50.0, 50.0))
            shown = speed * np.exp(y[1]) / self.v1  # V theta / L
            state = self.v1 / length * (np.exp(-y[1]) - speed / self.v1)
            if law == "slip":
                state = -speed / length * np.log(shown)
            return [k * ((self.v1 if t < at else self.v2) - speed), state]

        out = np.full(self.time.shape, mu)
        after = self.time > at
        done = solve_ivp(
            rates, (at, self.time[-1]), [mu, 0.0], method="LSODA", t_eval=self.time[after], rtol=1e-7, atol=1e-10
        )
        if done.y.shape[1] != after.sum():
            return np.full(self.time.shape, 10.0)
        out[after] = done.y[0]
        return out + trend * (self.time - self.step)

    def residual(self, p: np.ndarray, law: str) -> np.ndarray:
        """What a law leaves of the friction (1e-3)."""
        return 1e3 * (self.model(p, law) - self.friction)

    def distance(self) -> np.ndarray:
        """Between all points, 1 where misfits are hardly correlated: path before the step, its logarithm after it."""
        since = (self.time - self.step) * np.where(self.time < self.step, self.v1, self.v2) / NEAR
        place = np.where(since < 0.0, since, 3.0 * np.log1p(10.0 * np.maximum(since, 0.0)))
        return np.abs(place[:, None] - place[None, :])


def covariance(step: Step, sizes: np.ndarray) -> np.ndarray:
    """Of a misfit (Matern 3/2) and of noise, from the logarithms of misfit, its length and noise."""
    misfit, length, noise = np.exp(sizes)
    r = np.sqrt(3.0) * step.distance() / length
    return np.asarray(misfit**2 * (1.0 + r) * np.exp(-r) + noise**2 * np.eye(step.time.size))


def cost(step: Step, left: np.ndarray, sizes: np.ndarray) -> float:
    """Twice the negative logarithm of the likelihood, but for a constant."""
    half = cholesky(covariance(step, sizes), lower=True)
    return float(np.sum(solve_triangular(half, left, lower=True) ** 2) + 2.0 * np.log(np.diag(half)).sum())


def fitted(step: Step, law: str, starts: list[tuple[float, float, float, float]]) -> dict[str, Any]:
    """A law at its best: parameters with deviations, what it leaves, and its cost with misfit and noise at theirs.

    ``starts`` are a, b, L (m) and k (1/m).
    """
    bounds, usual = (LOWER, UPPER), float(step.friction[:100].mean())
    ends = [
        least_squares(
            step.residual, [usual, a, b, np.log(length), np.log(k), 0.0, 0.0], x_scale=SCALE, bounds=bounds,
            args=(law,), max_nfev=60, **SLOPES,
        )
        for a, b, length, k in starts
    ]  # fmt: skip
    best = min(ends, key=lambda end: end.cost).x
    sizes = np.log([0.3, 1.0, 0.4])
    for _ in range(2):
        left = step.residual(best, law)
        sizes = minimize(lambda s, r=left: cost(step, r, s), sizes, method="Nelder-Mead", options=FINE).x
        half = cholesky(covariance(step, sizes), lower=True)

        def whitened(p: np.ndarray, half: np.ndarray = half) -> np.ndarray:
            return np.asarray(solve_triangular(half, step.residual(p, law), lower=True))

        again = least_squares(whitened, best, x_scale=SCALE, bounds=bounds, max_nfev=60, **SLOPES)
        best = again.x
    left = step.residual(best, law)
    std = np.sqrt(np.diag(np.linalg.inv(again.jac.T @ again.jac)))
    values = {name: [float(v), float(e)] for name, v, e in zip(NAMES, best, std, strict=True)}
    for name in ("L", "k"):
        value = float(np.exp(values[name][0]))
        values[name] = [value, value * values[name][1]]
    misfit, _, noise = 1e-3 * np.exp(sizes)
    return {
        "values": values, "rms": float(1e-3 * np.sqrt(np.mean(left**2))), "cost": cost(step, left, sizes),
        "misfit": float(misfit), "noise": float(noise),
    }  # fmt: skip


def usual(t: np.ndarray, x: np.ndarray, mu: np.ndarray) -> dict[str, Any]:
    """Both laws of the state on one step: t in s, the load point's way x in m, friction mu."""
    step = Step.of(t, x, mu)
    starts = [(0.008, 0.009, 8e-6, 4e3), (0.013, -0.007, 7e-5, 2e3), (0.01, 0.005, 2e-5, 2e3)]
    laws = {law: fitted(step, law, starts) for law in LAWS}
    line = np.polynomial.Polynomial.fit(step.time, step.friction, 1)(step.time)
    return {
        "v1": step.v1, "v2": step.v2, "points": step.time.size, "laws": laws,
        "line": float(np.std(step.friction - line)), "peak": float(np.ptp(step.model(_best(laws["slip"]), "slip"))),
    }  # fmt: skip


def _best(found: dict[str, Any]) -> np.ndarray:
    """Parameters as the model takes them."""
    return np.array([np.log(found["values"][n][0]) if n in ("L", "k") else found["values"][n][0] for n in NAMES])
