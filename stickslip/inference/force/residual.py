"""Structure that no effect of the catalogue takes: the residual force as a smooth function of one variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from .fit import Fit
from .knots import RING
from .linearised import Array
from .problem import CREEPING
from .signatures import Explained

NODES = 7
# where a drive goes one way these go with place and time: they are looked at, and not tried by themselves
VARIABLES = {
    "time": "s", "displacement": "m", "velocity": "m/s", "spring force": "N", "time in contact": "s",
    "number of the event": "1",
}  # fmt: skip
PULLED = "spring force"
BENT = ("velocity", "time in contact")  # over decades
WAYS = {"slip path": "m", "load point": "m"}


@dataclass(frozen=True)
class Structure:
    """What the residual force says of a variable.

    Attributes:
        variable, unit: which.
        fall: of the cost with a smooth force of it.
        chance: of such a fall where there is nothing, corrected for the variables tried.
        at, force: the smooth force (N) over the variable, shape (NODES,).
    """

    variable: str
    unit: str
    fall: float
    chance: float
    at: Array
    force: Array


def coordinates(fit: Fit) -> dict[str, Array]:
    """The variables at the points, and the ways of block and load point, shape (p,) each."""
    problem = fit.problem
    runs = problem.runs
    x = np.concatenate([k.mean @ k.x for k in runs])
    drive = np.concatenate([k.mean @ k.drive for k in runs])
    # while it rings the noise of the rate is that of the force a sample or two later, and would look like a law
    rate = np.where(problem.phase == RING, 0.0, np.concatenate([k.rate for k in runs]))
    shared = fit.values.get("rig.spring_stiffness", np.nan)
    stiffness = np.concatenate([np.full(k.at.size, shared if k.stiffness is None else k.stiffness) for k in runs])
    number = problem.of - problem.first[problem.run]
    path = np.concatenate([k.mean @ np.concatenate([[0.0], np.cumsum(np.abs(np.diff(k.x)))]) for k in runs])
    pulled = stiffness * (drive - x) + np.concatenate([k.mean @ k.force for k in runs])
    values = (problem.at, x, rate, pulled, problem.elapsed, number.astype(float), path, drive)
    return dict(zip((*VARIABLES, *WAYS), values, strict=True))


def smooth_force(fit: Fit, name: str, values: Array) -> tuple[Array, Array]:
    """A force that is a broken line over a variable.

    Args:
        fit: the model without it.
        name, values: of the variable, shape (p,).

    Returns:
        Places of its nodes, shape (m,), and what one strength of the contact there changes of the residuals (N), shape
        (p, m).
    """
    scaled = np.arcsinh(values / (0.02 * np.abs(values).max())) if name in BENT else values
    nodes = np.unique(np.quantile(scaled, np.linspace(0.0, 1.0, NODES)))
    hats = np.stack([np.interp(scaled, nodes, row) for row in np.eye(nodes.size)], axis=1)
    columns = -fit.forces.share[:, None] * hats
    if name == PULLED and nodes.size > 1:  # it makes the spring another one, for which a reading counts differently
        steeper = np.stack([_slope(scaled, nodes, row) for row in np.eye(nodes.size)], axis=1)
        common = fit.point.common
        forces = fit.residual - fit.problem.offset - fit.problem.beyond - fit.slopes.shared[:, -common.size :] @ common
        columns += steeper * (forces * (fit.problem.phase == CREEPING))[:, None]
    return np.interp(nodes, np.sort(scaled), np.sort(values)), columns * fit.strength


def structures(fit: Fit, explained: Explained, dispersion: float = 1.0) -> list[Structure]:
    """All variables, the most telling first."""
    out = []
    found = coordinates(fit)
    prescribed = any(k.prescribed for k in fit.problem.runs)
    for name, unit in VARIABLES.items():
        if prescribed and name == PULLED:  # which is what was measured itself
            continue
        at, columns = smooth_force(fit, name, found[name])
        if at.size < 3:
            continue
        fall, sizes = explained.gain(columns)
        chance = float(chdtrc(at.size, fall / dispersion) * len(VARIABLES))
        out.append(Structure(name, unit, fall, min(chance, 1.0), at, sizes * fit.strength))
    return sorted(out, key=lambda s: s.chance)


def _slope(values: Array, nodes: Array, heights: Array) -> Array:
    """Derivative of the broken line through nodes at some values."""
    piece = np.clip(np.searchsorted(nodes, values, side="right") - 1, 0, nodes.size - 2)
    return np.asarray(np.diff(heights) / np.diff(nodes))[piece]
