"""Errors that events have in common: all events of a run, and all events, marginalised.

A bank of few parameters is no rough line. What it gets wrong is much the same in every event, and is no sign of a
missing effect: each feature has an offset common to all events and one common to every run, with a prior around zero.
Both are linear, so they are found for any model without a search.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_array, csr_array

from ..features.layout import PHASES
from ..features.measurement import Measurement
from ..floors import common


class Common:
    """The map from residuals to those that are left with the most probable offsets, and to these.

    Args:
        measurement: the data.
        floor: standard deviation of what is wrong in a single event (SI), shape (R, n, F).
        use: cycles that are fitted, shape (R, n).
        factor: on the floor.
        widths: standard deviations of what all events of a run, and of what all events, have alike (SI, shape (R, n, F)
            each); default those of rough lines, :func:`stickslip.floors.common`.
    """

    def __init__(
        self,
        measurement: Measurement,
        floor: np.ndarray,
        use: np.ndarray,
        factor: float = 1.0,
        widths: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self.valid = measurement.valid & (use & np.asarray(measurement.cycles.used))[..., None]
        self.shape = measurement.values.shape
        runs, _, features = self.shape
        of_run, of_all = common(measurement) if widths is None else widths
        index = np.full(self.shape, -1)
        index[self.valid] = np.arange(int(self.valid.sum()))
        self._loads: list[np.ndarray] = []  # offsets -> feature, of all cells
        self._gain: list[np.ndarray] = []  # residuals of the cells used -> offsets
        self._phase = measurement.layout.phase_index()
        own, shift, place = [], [], []
        run = np.broadcast_to(np.arange(runs)[:, None], self.shape[:2])
        for j in range(features):
            each = (run[..., None] == np.arange(runs)) * of_run[..., j, None]
            load = np.concatenate([of_all[..., j, None], each], axis=-1)
            mask = self.valid[..., j]
            s, d = load[mask], (factor * floor[..., j])[mask]
            weighted = s.T / d**2
            left = np.linalg.inv(weighted @ s + np.eye(1 + runs))
            gain = left @ weighted
            self._loads.append(load)
            self._gain.append(gain)
            own.append((np.eye(d.size) - s @ gain) / d[:, None])
            shift.append(gain)
            place.append(index[..., j][mask])
        self._map = self._assemble(own, shift, place)

    def _assemble(self, own: list[np.ndarray], shift: list[np.ndarray], place: list[np.ndarray]) -> csr_array:
        n, runs = int(self.valid.sum()), self.shape[0]
        rows = [np.broadcast_to(p[:, None], (p.size, p.size)).ravel() for p in place]
        columns = [np.broadcast_to(p[None, :], (p.size, p.size)).ravel() for p in place]
        values = [o.ravel() for o in own]
        upper = csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n))
        rows = [np.repeat(np.arange(j * (1 + runs), (j + 1) * (1 + runs)), p.size) for j, p in enumerate(place)]
        columns = [np.tile(p, 1 + runs) for p in place]
        values = [g.ravel() for g in shift]
        size = len(place) * (1 + runs)
        lower = csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(size, n))
        return csr_array(block_array([[upper], [lower]]))

    def __call__(self, residual: np.ndarray) -> np.ndarray:
        """Residuals of the cells used (SI), shape (N,) or (N, k), in floors and without the offsets; then these.

        The sum of squares of the result is the chi-square with the offsets marginalised.
        """
        out: np.ndarray = self._map @ residual
        return out

    def alike(self, residual: np.ndarray) -> dict[str, float]:
        """Phase -> root mean square of the offsets that :meth:`__call__` finds, in their widths; the worse level."""
        offsets = self(residual)[int(self.valid.sum()) :].reshape(self.shape[2], -1)
        known = np.concatenate([self.valid.any(axis=(0, 1))[None], self.valid.any(axis=1)]).T
        out = {}
        for i, phase in enumerate(PHASES):
            mine, seen = offsets[self._phase == i], known[self._phase == i]
            if seen.any():
                levels = [(mine[:, :1], seen[:, :1]), (mine[:, 1:], seen[:, 1:])]
                out[phase] = max(float(np.sqrt(np.mean(b[ok] ** 2))) for b, ok in levels)
        return out

    def offsets(self, residual: np.ndarray) -> np.ndarray:
        """The most probable offsets of every cell (SI, shape (R, n, F)), from residuals of all cells in that shape."""
        out = np.zeros(self.shape)
        for j, (load, gain) in enumerate(zip(self._loads, self._gain, strict=True)):
            r = residual[..., j][self.valid[..., j]]
            out[..., j] = load @ (gain @ np.where(np.isfinite(r), r, 0.0))
        return out
