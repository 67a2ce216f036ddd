"""Where the reading jumps: at a speckle of the laser or a lost fringe, unseen while the block slips.

After a jump by delta the spring is read as shorter by it, so that all forces of the run are off by c delta from then
on; what sticks has its place from the arrest after. Along a run this looks like a drift, or like wear.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...system.units import shown
from .linearised import Array, Linearised
from .problem import JUMP

if TYPE_CHECKING:
    from .fit import Fit

LEAST = 3.0  # standard deviations of a jump that is told of


def jumping(system: Linearised) -> int | None:
    """The event before which the reading most likely jumps, if anywhere, all else adjusted; None where it cannot.

    The test is Rao's score test of a column for each event that is not the first of its run.

    Args:
        system: at the optimum, without that jump.
    """
    problem, blocks = system.problem, system.problem.blocks
    tried = np.setdiff1d(np.flatnonzero(~problem.begins), problem.jumps)
    if tried.size == 0 or any(run.prescribed for run in problem.runs):
        return None
    columns = system.white(np.stack([blocks(problem.jumped(int(e))) for e in tried], axis=2))
    rows = system.rows
    shared = np.vstack([rows.reshape(-1, rows.shape[-1]), system.prior])
    turned, _ = np.linalg.qr(shared)

    def beside(values: Array) -> Array:
        """What the parameters do not take; priors are met at the optimum."""
        whole = np.zeros((shared.shape[0], values.shape[-1]))
        whole[: rows.shape[0] * rows.shape[1]] = values.reshape(-1, values.shape[-1])
        return np.asarray(whole - turned @ (turned.T @ whole))

    columns = beside(columns)
    size = (columns**2).sum(axis=0) + JUMP**-2.0
    sure = np.abs(columns.T @ beside(system.rest[..., None])[:, 0]) / np.sqrt(size)
    return int(tried[np.argmax(sure)])


def jumps(found: Fit) -> list[str]:
    """Those that a fit is sure of, in words: of others a law that was added needs none."""
    problem, number = found.problem, len(found.problem.jumps)
    first = found.point.common.size - number
    deviations = np.sqrt(np.diag(found.covariance)[len(found.covariance) - number :])
    out = []
    for event, size, deviation in zip(problem.jumps, found.point.common[first:], deviations, strict=True):
        if abs(size) > LEAST * deviation:
            run = int(problem.event_run[event])
            slip = event - int(problem.first[run])
            text = f"jumps by {shown(float(size), 'm', 2)} during slip {slip}; the fit takes it off"
            out.append(f"{problem.runs[run].name}: the reading {text}")
    return out
