"""The static model fitted to creep processes: Grzemba et al. 2014, H and h_rms of each by least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...errors import ArgumentError, FitError, InputError
from .creep_process import CreepProcess
from .static_table import HURST, StaticRig, StaticTable, VirtualCurve, static_table, virtual_curve

Array = NDArray[np.float64]
Align = Literal["consistent", "paper"]
Form = Literal["exact", "paper"]
SATISFYING = 0.02  # of the creep amplitude; single realisations of one contact reach 1 to 2 %
_STARTS = ((0.3, 0.35), (0.7, 0.55), (0.12, 0.15))  # (H, place of ln h_rms within its range)


@dataclass(frozen=True)
class CreepFit:
    """One fitted process.

    Attributes:
        process: what was fitted.
        hurst, h_rms: Hurst exponent and rms height (m) of the line.
        hurst_std, h_rms_std: from the covariance; nan at a bound.
        u_max: displacement at full sliding, m.
        nrmse: rms of the residual over the creep amplitude.
        model: displacements of the model at the process's times, m.
        at_bound: names of parameters that ended at the edge of their range.
    """

    process: CreepProcess
    hurst: float
    h_rms: float
    hurst_std: float
    h_rms_std: float
    u_max: float
    nrmse: float
    model: Array
    at_bound: tuple[str, ...] = ()

    @property
    def satisfying(self) -> bool:
        """Whether the residual is below 2 % of the creep amplitude."""
        return self.nrmse < SATISFYING


@dataclass(frozen=True)
class StaticFit:
    """All processes of a campaign. Every H means nothing without ``rig.n_springs`` (N) and ``rig.length`` (L)."""

    fits: tuple[CreepFit, ...]
    rig: StaticRig
    align: Align
    form: Form

    @property
    def good(self) -> tuple[CreepFit, ...]:
        """Those that satisfy."""
        return tuple(f for f in self.fits if f.satisfying)

    @property
    def share(self) -> float:
        """Share of processes whose fit satisfies."""
        return len(self.good) / len(self.fits) if self.fits else float("nan")

    def summary(self) -> dict[str, float]:
        """Mean and standard deviation of H and h_rms (m) over the satisfying fits, and the median error of all."""
        h = np.array([[f.hurst, f.h_rms] for f in self.good]).reshape(-1, 2)
        mean = h.mean(axis=0) if len(h) else np.full(2, np.nan)
        std = h.std(axis=0, ddof=1) if len(h) > 1 else np.full(2, np.nan)
        middle = float(np.median([f.nrmse for f in self.fits])) if self.fits else float("nan")
        return {
            "hurst": float(mean[0]),
            "hurst_std": float(std[0]),
            "h_rms": float(mean[1]),
            "h_rms_std": float(std[1]),
            "median_nrmse": middle,
            "share": self.share,
        }


def fit_static(
    processes: Sequence[CreepProcess],
    rig: StaticRig | Sequence[StaticRig],
    *,
    align: Align = "consistent",
    form: Form = "exact",
    progress: Callable[[int, int], None] | None = None,
) -> StaticFit:
    """Fit (H, h_rms) to every process by itself.

    Args:
        processes: what `creep_processes` gives.
        rig: what is known; one for all, or one for each process (a run may have its own spring).
        align: "consistent" puts the model's passage of v_lim on the measured one; "paper" puts the end of the model's
            curve (full sliding) there, which the model contradicts: its own curve passes 1 um/s well before its end.
        form: of virtual time, "exact" or "paper".
        progress: told how many are done, of how many.

    Raises:
        InputError: no process, or an unknown option.
    """
    if align not in ("consistent", "paper"):
        raise ArgumentError("unknown alignment", key="align", value=align, allowed="consistent, paper")
    if not processes:
        raise InputError(
            "there is no creep process to fit", hint="`stickslip inspect` says why every stick was left out"
        )
    rigs = [rig] * len(processes) if isinstance(rig, StaticRig) else list(rig)
    fits = []
    for i, (process, own) in enumerate(zip(processes, rigs, strict=True)):
        table = static_table(own.n_springs, own.lines, own.seed)
        fits.append(_fit_one(process, own, table, align, form))
        if progress is not None:
            progress(i + 1, len(processes))
    return StaticFit(tuple(fits), rigs[0], align, form)


def static_model(
    process: CreepProcess,
    rig: StaticRig,
    table: StaticTable,
    hurst: float,
    h_rms: float,
    align: Align = "consistent",
    form: Form = "exact",
) -> Array:
    """Displacement (m) of the static model at a process's times, relative to its end, shape (n,)."""
    curve = virtual_curve(rig, process.velocity, table.tau, table.displacement(rig, hurst, h_rms), form)
    end = float(curve.t[-1]) if align == "paper" else _passage(curve, process.v_lim)
    return np.interp(process.time + end, curve.t, curve.u) - np.interp(end, curve.t, curve.u)


def _passage(curve: VirtualCurve, v_lim: float) -> float:
    """Virtual time (s) at which the curve passes v_lim, linear in ln v; its end where it stays slower."""
    slow = np.flatnonzero(curve.v <= v_lim)
    i = int(slow[-1]) if slow.size else 0
    if i + 1 >= curve.v.size:
        return float(curve.t[-1])
    a, b = np.log(np.maximum(curve.v[i : i + 2], 1e-300))
    share = np.clip((np.log(v_lim) - a) / max(b - a, 1e-300), 0.0, 1.0)
    return float(curve.t[i] + share * (curve.t[i + 1] - curve.t[i]))


def _fit_one(process: CreepProcess, rig: StaticRig, table: StaticTable, align: Align, form: Form) -> CreepFit:
    low, high = np.log(rig.rms_range())
    bounds = (np.array([HURST[0], low]), np.array([HURST[1], high]))
    amplitude = process.amplitude

    def residual(x: Array) -> Array:
        model = static_model(process, rig, table, float(x[0]), float(np.exp(x[1])), align, form)
        return (model - process.displacement) / amplitude

    best = None
    for hurst, place in _STARTS:
        start = np.array([hurst, _matching(process, rig, table, hurst, low + place * (high - low), (low, high))])
        found = least_squares(residual, start, bounds=bounds, x_scale=(0.1, 0.3), diff_step=1e-4, max_nfev=60)
        if best is None or found.cost < best.cost:
            best = found
        if np.sqrt(2 * best.cost / process.time.size) < 0.25 * SATISFYING:
            break
    if best is None or not np.all(np.isfinite(best.fun)):
        raise FitError(f"{process.trace}, event {process.event + 1}: the static model gives no finite curve")
    x, n = best.x, best.fun.size
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * float(best.fun @ best.fun) / max(n - 2, 1)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    edge = 1e-3 * (bounds[1] - bounds[0])
    at = [(x[k] < bounds[0][k] + edge[k]) or (x[k] > bounds[1][k] - edge[k]) for k in (0, 1)]
    height = float(np.exp(x[1]))
    return CreepFit(
        process,
        float(x[0]),
        height,
        float("nan") if at[0] else float(sd[0]),
        float("nan") if at[1] else float(sd[1] * height),
        float(table.displacement(rig, float(x[0]), height)[-1]),
        float(np.sqrt(np.mean(best.fun**2))),
        best.fun * amplitude + process.displacement,
        tuple(name for name, edge_hit in zip(("H", "h_rms"), at, strict=True) if edge_hit),
    )


def _matching(
    process: CreepProcess, rig: StaticRig, table: StaticTable, hurst: float, guess: float, bounds: tuple[float, float]
) -> float:
    """ln h_rms at which the model creeps about as far as the data, for a start; the scale is nearly linear in u_max."""
    at = guess
    for _ in range(4):
        model = static_model(process, rig, table, hurst, float(np.exp(at)))
        ratio = process.amplitude / max(float(np.ptp(model)), 1e-15)
        at = float(np.clip(at + np.clip((1 + hurst) * np.log(ratio), -1.0, 1.0), bounds[0] + 0.01, bounds[1] - 0.01))
    return at


def tied_quantities(fit: CreepFit, rig: StaticRig) -> str:
    """Which of h_rms, L, F_n and E* a creep curve fixes, in words, from the derivatives of the curve at a fit.

    The curve at given shares of full friction is differentiated in the logarithms of the four; singular values tell
    how many numbers the curve contains of them.
    """
    table = static_table(rig.n_springs, rig.lines, rig.seed)
    q, step = rig.crowding(fit.h_rms), 0.05

    def log_curve(crowding: float) -> Array:
        return np.log(table.shape(fit.hurst, crowding)[20:])

    # L, F_n and E* act through q alone; h_rms through q and as the scale
    dq = (log_curve(q * np.exp(step)) - log_curve(q * np.exp(-step))) / (2 * step)
    columns = np.stack([1.0 - dq, -dq, dq, -dq], axis=1)
    s = np.linalg.svd(columns, compute_uv=False)
    numbers = int(np.count_nonzero(s > 0.05 * s[0]))
    power = float(np.mean(dq))
    law = f"u_max ~ h_rms^{1 - power:.2f} (F_n / (E* L))^{power:.2f}"
    if numbers == 1:
        return f"h_rms, L, F_n and E* act only together: of the four the curve determines one number, {law}"
    return f"of h_rms, L, F_n and E* the curve determines {numbers} numbers, the first of them {law}"
