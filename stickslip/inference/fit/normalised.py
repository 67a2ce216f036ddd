"""The static model's normalised curve fitted to break-away ramps: u/u_max against the share of the break-away force.

For contacts whose geometry nobody knows. The Hurst exponent sets the shape of the curve, everything else (h_rms, load,
moduli, length of the line) only its scale u_max, so those two are all that can be had from a ramp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...data.segment import Dropped, Segmentation
from ...data.trace import Trace
from ...errors import InputError
from .static import SATISFYING
from .static_table import HURST, StaticTable, static_table

Array = NDArray[np.float64]
POINTS = 160
CROWDING = 5e-2  # q = F_n / (E* L h_rms) of the paper's example; the shape hardly depends on it
_LEAST = 12.0  # displacement in noise levels
BEYOND = 0.05  # by which share full friction may exceed the force at which the slip was seen to begin


@dataclass(frozen=True)
class Ramp:
    """Displacement under a slowly rising force, from rest to break-away.

    Args:
        trace: where it comes from.
        tau: share of the break-away force, increasing, shape (n,).
        displacement: m, from the beginning of the ramp, shape (n,).
        force: at break-away, N.
    """

    trace: str
    tau: Array
    displacement: Array
    force: float


@dataclass(frozen=True)
class RampFit:
    """One fitted ramp.

    Attributes:
        ramp: what was fitted.
        hurst, hurst_std: Hurst exponent of lines of ``n_springs`` springs, and its standard deviation.
        u_max, u_max_std: displacement at full sliding, m.
        friction_force: force at full sliding, N; up to 5 % more than where the slip was seen to begin.
        nrmse: rms of the residual over the displacement at break-away.
        model: displacements of the model, m, shape (n,).
        n_springs: springs of a line, without which H means nothing.
    """

    ramp: Ramp
    hurst: float
    hurst_std: float
    u_max: float
    u_max_std: float
    friction_force: float
    nrmse: float
    model: Array
    n_springs: int
    at_bound: tuple[str, ...] = ()

    @property
    def satisfying(self) -> bool:
        """Whether the residual is below 2 % of the displacement at break-away."""
        return self.nrmse < SATISFYING


def is_ramp(trace: Trace) -> bool:
    """Whether a trace is a force ramp: displacement and force measured, no load point that moves."""
    return (
        trace.displacement is not None
        and trace.spring_force is not None
        and (trace.drive is None or trace.drive.speed == 0.0)
    )


def break_away(trace: Trace, segmentation: Segmentation, points: int = POINTS) -> Ramp | Dropped:
    """The ramp up to the first slip, as means over windows even in force; or why it cannot be used."""

    def left_out(reason: str) -> Dropped:
        return Dropped("ramp", 1, trace.name, reason)

    if not is_ramp(trace):
        return left_out("not a ramp: it needs displacement and force, and no moving drive")
    if not segmentation.events:
        return left_out(f"it never breaks away ({segmentation.reason})")
    assert trace.displacement is not None and trace.spring_force is not None
    event = segmentation.events[0]
    force, u = trace.spring_force[: event.i_onset], event.direction * trace.displacement[: event.i_onset]
    force = force * (np.sign(force[-1]) or 1.0)
    rising = np.maximum.accumulate(force)
    if force.size < 20 or np.max(rising - force) > 0.2 * np.ptp(force):
        return left_out("the force does not rise steadily up to the first slip")
    first = int(np.flatnonzero(rising <= rising[0] + 0.02 * np.ptp(rising))[-1])
    force, u = rising[first:], u[first:] - u[: first + 1].mean()
    if np.ptp(u) < _LEAST * segmentation.settings.noise:
        return left_out("its creep does not stand out of the noise")
    bucket = np.searchsorted(np.linspace(force[0], force[-1], points + 1)[1:-1], force)
    starts = np.flatnonzero(np.diff(np.concatenate([[-1], bucket])))
    n = np.diff(np.append(starts, force.size))
    tau = np.add.reduceat(force, starts) / n / force[-1]
    return Ramp(trace.name, tau, np.add.reduceat(u, starts) / n, float(force[-1]))


def fit_ramps(ramps: Sequence[Ramp], n_springs: int = 4096, lines: int = 100, seed: int = 0) -> tuple[RampFit, ...]:
    """Fit (H, u_max) and full friction to every ramp by itself, with the mean curve of the lines.

    Raises:
        InputError: no ramp.
    """
    if not ramps:
        raise InputError("there is no break-away ramp to fit", hint="`stickslip inspect` shows what the traces hold")
    table = static_table(n_springs, lines, seed)
    return tuple(_fit_one(ramp, table, n_springs) for ramp in ramps)


def _fit_one(ramp: Ramp, table: StaticTable, n_springs: int) -> RampFit:
    span = float(np.ptp(ramp.displacement))

    def residual(x: Array) -> Array:
        shape = table.shape(float(x[0]), CROWDING)
        model = np.interp(ramp.tau / (1.0 + x[2]), table.tau, shape / shape[-1])
        return (x[1] * span * model - ramp.displacement) / span

    # the onset is seen at a speed, a little before the last spring slides: full friction is a third unknown
    bounds = ([HURST[0], 0.1, 0.0], [HURST[1], 10.0, BEYOND])
    runs = [least_squares(residual, [h, 1.2, 0.02], bounds=bounds, diff_step=1e-4) for h in (0.15, 0.6)]
    best = min(runs, key=lambda r: float(r.cost))
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * float(best.fun @ best.fun) / max(best.fun.size - 3, 1)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    edge = min(best.x[0] - HURST[0], HURST[1] - best.x[0]) < 1e-3
    return RampFit(
        ramp,
        float(best.x[0]),
        float("nan") if edge else float(sd[0]),
        float(best.x[1] * span),
        float(sd[1] * span),
        float(ramp.force * (1.0 + best.x[2])),
        float(np.sqrt(np.mean(best.fun**2))),
        best.fun * span + ramp.displacement,
        n_springs,
        ("H",) if edge else (),
    )
