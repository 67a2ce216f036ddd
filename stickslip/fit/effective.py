"""The rough line (H, h_rms) that fitted contacts would come from: effective numbers, not a topography."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from ..contact.power_law import mixture, power_law_backbone
from .static_table import HURST, StaticRig, static_table


@dataclass(frozen=True)
class EffectiveLine:
    """Lines whose mean creep curve comes nearest to that of contacts on backbones 1 - (1 - u/u_max)^p.

    Attributes:
        hurst, h_rms: of that line (m); they mean nothing without ``n_springs`` and ``length``.
        power_law_hurst: 1/(p - 1), which holds for endlessly fine lines.
        mismatch: rms difference of the two curves over u_max.
        n_springs, length: N and L (m).
        note: what to think of it.
        edge: whether it is the last line that there is, so that deviations mean nothing.
    """

    hurst: float
    h_rms: float
    power_law_hurst: float
    mismatch: float
    n_springs: int
    length: float
    note: str
    edge: bool = False


def effective_line(u_max: float, p: float, rig: StaticRig, spread: float = 0.0) -> EffectiveLine:
    """(H, h_rms) implied by a fitted (u_max, p, spread), with the load, friction, contacts, L and N of ``rig``.

    As in the static fit it is the curve of all contacts together that is compared with the mean line: p and the
    spread of the contacts replace each other in the data, their common curve does not change with that.

    Args:
        u_max: displacement at full sliding of the typical contact, m.
        p: exponent of its backbone, (H + 1)/H in the power-law regime of a self-affine line.
        spread: rms of ln(u_max) over the contacts.
    """
    table = static_table(rig.n_springs, rig.lines, rig.seed)
    part = (table.tau > 0.02) & (table.tau < 0.98)
    wanted = _displacement(table.tau[part], u_max, p, spread, rig.contacts)
    low, high = np.log(rig.rms_range())

    def residual(x: np.ndarray) -> np.ndarray:
        return (table.displacement(rig, float(x[0]), float(np.exp(x[1])))[part] - wanted) / u_max

    starts = [(h, 0.5 * (low + high)) for h in (0.15, 0.4, 0.75)]
    runs = [least_squares(residual, s, bounds=([HURST[0], low], [HURST[1], high]), diff_step=1e-4) for s in starts]
    best = min(runs, key=lambda r: float(r.cost))
    hurst, height = float(best.x[0]), float(np.exp(best.x[1]))
    mismatch = float(np.sqrt(np.mean(best.fun**2)))
    note = "effective parameters of the distribution of gaps, not a topography"
    edge = min(hurst - HURST[0], HURST[1] - hurst) < 1e-3 or min(best.x[1] - low, high - best.x[1]) < 1e-3
    if edge:
        note += "; at the edge of what such lines can do: this contact has no rough line of that kind"
    elif mismatch > 0.02:
        note += "; no such line has quite this curve"
    limit = 1.0 / (p - 1.0) if p > 1.0 else float("nan")
    return EffectiveLine(hurst, height, limit, mismatch, rig.n_springs, rig.length, note, edge)


def _displacement(tau: np.ndarray, u_max: float, p: float, spread: float, contacts: int) -> np.ndarray:
    """Displacement (m) at the loads ``tau`` of contacts on power-law backbones, shape of ``tau``."""
    if contacts == 1 or spread == 0.0:
        return np.asarray(u_max * (1.0 - (1.0 - tau) ** (1.0 / p)))
    mixed, stretch = mixture(lambda u: power_law_backbone(u, u_max, 1.0, p), spread, contacts)
    grid = u_max * float(stretch) * (1.0 - np.linspace(1.0, 0.0, 4000) ** 2)  # finest where the last springs slide
    return np.interp(tau, np.asarray(mixed(jnp.asarray(grid))), grid)
