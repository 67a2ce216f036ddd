"""Rough lines in parallel: the mean curve of such contacts, and how those of one rig differ from those of another.

A block stands on a few contacts with a line of its own each. Their forces add at the same displacement, so the curve
of the block is not the mean of the curves of single lines: where the displacements at full sliding differ, the end of
the common curve is drawn out. Here blocks of as many lines as the rig has contacts are put together, and mean and
covariance are those of the logarithm of the blocks' displacement at a given share of the full friction: most of what
differs is a stretch of the whole curve. Like the mean line's curve they depend, in units of mu E*/G* h_rms, on H and on
q = F_n / (E* L h_rms) only (:mod:`..fit.static_table`).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...physics.contact import RoughLines, default_edges, default_loads
from ..fit.static_table import HURST, LOAD_RANGE, Bicubic, StaticRig

Array = NDArray[np.float64]
LOADS, EVERY = 384, 4  # shares of the friction, and of how many one has a covariance
LINES = 300
BLOCKS = 1000
HURST_NODES, LOAD_NODES = 11, 10
MOST = 16  # lines of a block; more of them scatter less, and their mean curve does not change any more
ROUNDING = 1e-12
GRID = 256  # displacements at which forces are added


class RoughContacts:
    """Displacement of blocks on rough contacts over (H, q, tau).

    Args:
        contacts: of a block.
        n_springs, lines, seed: of the lines of which blocks are made.

    Attributes:
        tau: shares of the full friction, shape (T,), above 0 and up to 1.
        sparse: places among them that have a covariance, shape (S,).
    """

    def __init__(self, contacts: int, n_springs: int, lines: int = LINES, seed: int = 0) -> None:
        self.tau = default_loads(LOADS + 1)[1:]
        self.sparse = np.arange(EVERY - 1, LOADS, EVERY)
        self._hurst = np.linspace(*HURST, HURST_NODES)
        self._load = np.linspace(np.log(LOAD_RANGE[0]), np.log(LOAD_RANGE[1]), LOAD_NODES)
        size = min(contacts, MOST)
        draws = np.random.default_rng([seed, size]).random((lines if size == 1 else BLOCKS, lines))
        blocks = np.arange(lines)[:, None] if size == 1 else np.argpartition(draws, size, axis=1)[:, :size]
        chosen = np.zeros((len(blocks), lines))
        np.put_along_axis(chosen, blocks, 1.0 / size, axis=1)
        mean = np.empty((HURST_NODES, LOAD_NODES, LOADS))
        self._covariance = np.empty((HURST_NODES, LOAD_NODES, self.sparse.size, self.sparse.size))
        for i, hurst in enumerate(self._hurst):
            table = RoughLines(float(hurst), 1.0, 1.0, n_springs=n_springs, lines=lines, seed=seed).indentation
            gaps, sums = np.asarray(table.gaps), np.asarray(table.sums) / n_springs
            for j, load in enumerate(np.exp(self._load)):
                logs = np.log(_displacements(gaps, sums, float(load), chosen, self.tau))
                mean[i, j] = logs.mean(axis=0)
                differ = (logs - mean[i, j])[:, self.sparse]
                # blocks share lines; fewer of them than the rig's contacts differ more; and the mean is of some lines
                factor = size / contacts * (1.0 + contacts / lines) / (1.0 - size / lines) / (len(chosen) - 1)
                self._covariance[i, j] = factor * (differ.T @ differ)
        self._mean = Bicubic(self._hurst, self._load, mean)

    def displacement(self, rig: StaticRig, hurst: float, h_rms: float) -> Array:
        """Displacement (m) at the shares ``tau`` of the full friction, mean of the logarithm, shape (T,)."""
        return rig.reach * h_rms * np.exp(self._mean(hurst, float(np.log(rig.crowding(h_rms)))))

    def covariance(self, rig: StaticRig, hurst: float, h_rms: float) -> Array:
        """Covariance of the logarithm of the displacement from one rig's contacts to another's, shape (S, S)."""
        (i, a), (j, b) = (
            _between(nodes, x) for nodes, x in ((self._hurst, hurst), (self._load, np.log(rig.crowding(h_rms))))
        )
        c = self._covariance
        low, high = ((1.0 - b) * c[k, j] + b * c[k, j + 1] for k in (i, i + 1))
        return np.asarray((1.0 - a) * low + a * high)


@lru_cache(maxsize=4)
def rough_contacts(contacts: int, n_springs: int) -> RoughContacts:
    """The table for blocks on so many contacts, made once."""
    return RoughContacts(contacts, n_springs)


def _displacements(gaps: Array, sums: Array, load: float, chosen: Array, tau: Array) -> Array:
    """Displacement of each block at the loads ``tau``, in units of mu E*/G* h_rms, shape (blocks, T).

    Args:
        gaps, sums: of lines of unit rms height, ascending, and the load (F_n/(E* L h_rms)) at which each is reached,
            shape (lines, n).
        load: of every contact.
        chosen: share of each line in the load of each block, shape (blocks, lines).
    """
    depth = np.array([_inverse(s, g, load) for g, s in zip(gaps, sums, strict=True)])
    u = np.concatenate([[0.0], default_edges(GRID) * depth.max()])
    left = np.array([np.interp(d - u, g, s, left=0.0) + np.maximum(d - u - g[-1], 0.0)
                     for d, g, s in zip(depth, gaps, sums, strict=True)])  # fmt: skip
    force = chosen @ (1.0 - left / load)
    last = np.argmax(force > 1.0 - ROUNDING, axis=1) + 1  # where all of a block slides
    return np.array([np.interp(tau, f[:k], u[:k]) for f, k in zip(force, last, strict=True)])


def _inverse(sums: Array, gaps: Array, load: float) -> float:
    """Depth under a load; where all springs touch they do so evenly."""
    return float(np.interp(load, sums, gaps)) + max(load - float(sums[-1]), 0.0)


def _between(nodes: Array, x: float) -> tuple[int, float]:
    """The node below and the share of the way to the next, held at the ends."""
    at = float(np.clip((x - nodes[0]) / (nodes[1] - nodes[0]), 0.0, nodes.size - 1.0))
    i = min(int(at), nodes.size - 2)
    return i, at - i
