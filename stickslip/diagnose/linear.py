"""What a small change of an effect would do if everything else were refitted with it, to first order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from ..features.measurement import Measurement
from ..fit.common import Common
from ..fit.inertial import HUBER, Fit
from ..fit.problem import Problem
from ..floors import event_widths


@dataclass(frozen=True)
class Step:
    """A linear step of everything.

    Attributes:
        z: change of the base's free parameters on the search scale, shape (k,).
        events: change of the event-wise factors, shape (R, n, 2).
        sizes: along each of the directions asked for, shape (d,).
        share: of the robust cost that it takes away.
    """

    z: np.ndarray
    events: np.ndarray
    sizes: np.ndarray
    share: float


class Linear:
    """The base's residual and Jacobian at its optimum, whitened, with its priors and Huber's weights.

    Args:
        problem, optimum: the base and its fit.
        measurement, floor: the data.
        valid: features that count, shape (R, n, F): those of some cycles.
        factor: on the floors.
    """

    def __init__(
        self, problem: Problem, optimum: Fit, measurement: Measurement, floor: np.ndarray, valid: np.ndarray,
        factor: float = 1.0,
    ) -> None:  # fmt: skip
        self.valid, self.optimum = valid, optimum
        self.common = Common(measurement, floor, np.asarray(valid.any(axis=-1)), factor)
        raw = optimum.features - optimum.offsets
        off = np.clip(np.nan_to_num((measurement.values - raw) / floor, nan=1e4), -1e4, 1e4) * floor
        r = self.common(off[valid])
        self.weight = np.where(np.abs(r) > HUBER, np.sqrt(HUBER / np.maximum(np.abs(r), HUBER)), 1.0)
        event = problem.event_columns(optimum.columns, optimum.z, optimum.events)
        self.cells = np.argwhere(valid.any(axis=-1))
        index = np.full(valid.shape[:2], -1)
        index[valid.any(axis=-1)] = np.arange(len(self.cells))
        owner = np.broadcast_to(index[..., None], valid.shape)[valid]
        rows = np.arange(owner.size)
        own = np.nan_to_num(event)[valid]
        blocks = np.zeros((owner.size, 2 * len(self.cells)))
        blocks[rows, 2 * owner], blocks[rows, 2 * owner + 1] = own[:, 0], own[:, 1]
        widths = np.array([min(f.width, 1e3) for f in optimum.free])
        away = [(v - f.inward(f.prior)) / w for v, f, w in zip(optimum.z, optimum.free, widths, strict=True)]
        each = event_widths(measurement)[tuple(self.cells.T)]
        at = optimum.events[tuple(self.cells.T)] / each
        prior = np.concatenate([1.0 / widths, 1.0 / each.ravel()])
        slopes = self._weighed(np.hstack([np.nan_to_num(optimum.columns)[valid], blocks]))
        self.rows = len(slopes)
        matrix = np.vstack([slopes, np.diag(prior)])
        self.target = np.concatenate([r * self.weight, -np.array(away), -at.ravel()])
        # columns of very different size: scaled, so that what is small beside its own size means something
        self.size = np.linalg.norm(matrix, axis=0)
        self.basis, self.triangle = np.linalg.qr(matrix / self.size)
        self.left = self._without_base(self.target)

    def _weighed(self, columns: np.ndarray) -> np.ndarray:
        """Changes of the features used (SI, shape (N, k)) as changes of the whitened residuals."""
        return np.clip(self.common(columns) * self.weight[:, None], -1e6, 1e6)

    def _without_base(self, v: np.ndarray) -> np.ndarray:
        """What the base cannot describe of a vector, or of the columns of a matrix."""
        return v - self.basis @ (self.basis.T @ v)

    def step(self, directions: list[np.ndarray]) -> Step:
        """The least-squares step along features' ``directions`` (R, n, F) together with everything in the base."""
        columns = np.zeros((self.target.size, len(directions)))
        columns[: self.rows] = self._weighed(np.nan_to_num(np.stack([d[self.valid] for d in directions], axis=-1)))
        own = self._without_base(columns)
        size = np.linalg.norm(columns, axis=0)
        size[size == 0.0] = 1.0
        sizes = np.linalg.lstsq(own / size, self.left, rcond=1e-9)[0] / size
        after = self.left - own @ sizes
        rest = self.basis.T @ (self.target - columns @ sizes)
        found = solve_triangular(self.triangle, rest) / self.size
        k = len(self.optimum.free)
        events = np.zeros_like(self.optimum.events)
        events[tuple(self.cells.T)] = found[k:].reshape(-1, 2)
        total = float(self.left @ self.left)
        share = 1.0 - float(after @ after) / total if total > 0 else 0.0
        return Step(found[:k], events, sizes, share)
