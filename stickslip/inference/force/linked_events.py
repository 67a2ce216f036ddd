"""What goes on from event to event: where the sensor stands, and a level of friction that wanders.

*Sensor.* A reading that is off by w(t) changes the residual force by -c w(t) - k (w(t) - w(t0)): the spring (c) is read
from it, and what sticks (k) remembers where it was at the arrest t0. With w_0 and w_1 at the arrests before and after,
a time T apart, w(t) = (1 - s) w_0 + s w_1 and a Brownian bridge, s = (t - t0) / T. The bridge is an event's own. The
nodes hang together from event to event of a run, w_1 - w_0 ~ N(0, size^2 T), and begin at zero.

*Level.* The strength of an event is partly its own and partly a level l, an Ornstein-Uhlenbeck process along time, slip
path or place with nodes where events end, in the middle of slips: cov(l_i, l_j) = size^2 exp(-|s_i - s_j| / length) in
a run, nothing between runs. Between its nodes it goes straight but for a Brownian bridge, which is an event's own and
has a size by itself: the level may be smoother than its steps from event to event.

Given the nodes events are independent, so that these are eliminated with a banded matrix (Rue & Held 2005, Gaussian
Markov Random Fields, ch. 2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_banded
from scipy.sparse import coo_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

Array = NDArray[np.float64]
Index = NDArray[np.intp]
LEVEL = 2  # columns of the walk, before those of the levels
CLOSEST = 1e-6  # of the usual distance: levels at one place are one


def nodes(spring: Array, tangent: Array, share: Array) -> Array:
    """What a shift of 1 m at the arrest before and at that after does to the force (N), shape (E, n, 2).

    Args:
        spring, tangent: stiffness of the spring and of what sticks (N/m), shape (E, n).
        share: of the time between the arrests that is over, shape (E, n).
    """
    return np.stack([tangent * share - spring * (1.0 - share), -(spring + tangent) * share], axis=2)


@dataclass(frozen=True)
class Chain:
    """Which level follows which.

    Attributes:
        begin, end: coordinate where every event begins and ends, shape (E,).
        group: events of one group hang together, shape (E,).
        unit: usual length of an event, in which lengths are counted.
        share: of the way of an event that is over, shape (E, n).
    """

    begin: Array
    end: Array
    group: Index
    unit: float
    share: Array

    @cached_property
    def nodes(self) -> Index:
        """Levels where every event begins and ends, shape (E, 2)."""
        events = self.end.size
        first = np.append(True, self.group[1:] != self.group[:-1])
        before = np.arange(events) - 1
        before[first] = events + np.arange(first.sum())
        return np.stack([before, np.arange(events)], axis=1)

    @cached_property
    def at(self) -> Array:
        """Coordinates of the nodes, shape (L,)."""
        return self._of_nodes(self.begin, self.end)

    @cached_property
    def of(self) -> Index:
        """Groups of the nodes, shape (L,)."""
        return self._of_nodes(self.group, self.group)

    def _of_nodes(self, begin: Any, end: Any) -> Any:
        out = np.empty(int(self.nodes.max()) + 1, end.dtype)
        out[self.nodes[:, 0]] = begin
        out[self.nodes[:, 1]] = end
        return out

    @cached_property
    def order(self) -> Index:
        """Nodes along the chain, group by group, shape (L,)."""
        return np.lexsort((self.at, self.of))

    @cached_property
    def gaps(self) -> Array:
        """From the node before, in units, in order; infinite at the first of a group, shape (L,)."""
        at, of = self.at[self.order], self.of[self.order]
        apart = np.maximum(np.diff(at, prepend=at[:1]) / self.unit, CLOSEST)
        return np.where(np.append(True, of[1:] != of[:-1]), np.inf, apart)

    @cached_property
    def before(self) -> Index:
        """The node that comes before along the chain, -1 for none, shape (L,)."""
        out = np.full(self.at.size, -1)
        out[self.order] = np.where(np.isinf(self.gaps), -1, np.append(-1, self.order[:-1]))
        return out

    @cached_property
    def longest(self) -> float:
        """Of a group, in units."""
        return float(max(np.ptp(self.at[self.of == g]) for g in np.unique(self.of))) / self.unit

    def loads(self, strength: Array) -> Array:
        """What the levels at the two ends of an event do, given what its strength does: (E, n) to (E, n, 2)."""
        return np.asarray(strength[..., None] * np.stack([1.0 - self.share, self.share], axis=2))

    def bridge(self) -> Array:
        """Covariance between its nodes of a Brownian level that gains a variance of 1 over a unit, shape (E, n, n)."""
        least = np.minimum(self.share[:, :, None], self.share[:, None, :])
        far = np.abs(self.end - self.begin)[:, None, None] / self.unit
        return np.asarray(far * (least - self.share[:, :, None] * self.share[:, None, :]))

    def to_nodes(self, values: Array) -> Array:
        """Sums of what belongs to the two ends of events, shape (E, 2) to (L,)."""
        return np.asarray(np.bincount(self.nodes.ravel(), values.ravel(), self.at.size), float)


class Levels:
    """The covariance C of levels.

    Args:
        chain: which follows which.
        size: standard deviation (share of the strength).
        length: in the chain's units.
    """

    def __init__(self, chain: Chain, size: float, length: float) -> None:
        self.chain, self.size, self.length, order = chain, size, length, chain.order
        far = chain.gaps / length
        self._kept, self._new = np.exp(-far), -(size**2) * np.expm1(-2.0 * far)  # along the chain
        self._longer = self._kept * np.where(np.isinf(far), 0.0, far)  # derivatives in the length's logarithm
        self._less = -2.0 * size**2 * self._kept * self._longer
        self.kept, self.new, self.longer, self.less = (np.empty_like(far) for _ in range(4))
        for out, values in zip(
            (self.kept, self.new, self.longer, self.less), (self._kept, self._new, self._longer, self._less),
            strict=True,
        ):  # fmt: skip
            out[order] = values

    def times(self, values: Array) -> Array:
        """C times values, shape (L,)."""
        return self._back(self._forth(self._new * self._turned(values[self.chain.order])))

    def slope_times(self, values: Array) -> Array:
        """Derivative of C in the logarithm of the length, times values, shape (L,)."""
        turned = self._turned(values[self.chain.order])
        whole = self._forth(self._new * turned)
        later = np.append((self._longer * turned)[1:], 0.0)
        earlier = self._longer * np.append(0.0, whole[:-1])
        return self._back(self._forth(earlier + self._less * turned + self._new * self._turned(later)))

    def of_events(self) -> Array:
        """C of the two levels of every event, shape (E, 2, 2)."""
        begin, end = self.chain.at[self.chain.nodes].T
        beside = np.exp(-np.abs(end - begin) / self.chain.unit / self.length)
        one = np.ones_like(beside)
        return self.size**2 * np.stack([np.stack([one, beside], axis=1), np.stack([beside, one], axis=1)], axis=1)

    def _forth(self, values: Array) -> Array:
        return np.asarray(solve_banded((1, 0), np.stack([np.ones_like(values), -np.append(self._kept[1:], 0)]), values))

    def _turned(self, values: Array) -> Array:
        upper = -np.append(0.0, self._kept[1:])
        return np.asarray(solve_banded((0, 1), np.stack([upper, np.ones_like(values)]), values))

    def _back(self, values: Array) -> Array:
        out = np.empty_like(values)
        out[self.chain.order] = values
        return out


class Links:
    """The nodes of all events, and their places in a banded matrix.

    Args:
        first: whether an event is the first of its run, where the walk begins at zero, shape (E,).
        chain: of the levels, None where there are none.
    """

    def __init__(self, first: NDArray[np.bool_], chain: Chain | None) -> None:
        events = np.arange(first.size)
        nodes = np.stack([np.where(first, -1, events - 1), events], axis=1)
        self.size, self.at = first.size, events
        self.levels = self.before = np.zeros(0, int)
        if chain is not None:
            self.levels = first.size + np.arange(chain.at.size)
            self.before = np.where(chain.before < 0, -1, chain.before + first.size)
            nodes = np.concatenate([nodes, chain.nodes + first.size], axis=1)
            self.size += self.levels.size
        self.nodes = nodes  # of every event: the walk before and after, the levels before and after, -1 for none
        if chain is not None:
            i, j = self._pairs()
            graph = coo_array((np.ones(i.size), (i, j)), shape=(self.size, self.size)).tocsr()
            self.at = np.empty(self.size, int)
            self.at[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(self.size)
        i, j = self._pairs()
        self.width = int(np.abs(self.at[i] - self.at[j]).max())

    def _pairs(self) -> tuple[Index, Index]:
        k = self.nodes.shape[1]
        i = np.concatenate([np.repeat(self.nodes, k, axis=1).ravel(), self.before, self.levels])
        j = np.concatenate([np.tile(self.nodes, k).ravel(), self.levels, self.before])
        there = (i >= 0) & (j >= 0)
        return i[there], j[there]

    def add(self, band: Array, i: Index, j: Index, values: Array) -> None:
        """Values to the lower half of a banded matrix, shape (width + 1, nodes)."""
        i, j, values = np.broadcast_arrays(i, j, values)
        row, column = self.at[i], self.at[j]
        use = (i >= 0) & (j >= 0) & (row >= column)
        np.add.at(band, ((row - column)[use], column[use]), values[use])

    def of(self, band: Array, i: Index, j: Index) -> Array:
        """Entries of a symmetric banded matrix, zero where there is no node."""
        there = (i >= 0) & (j >= 0)
        row, column = self.at[np.where(there, i, 0)], self.at[np.where(there, j, 0)]
        return np.where(there, band[np.abs(row - column), np.minimum(row, column)], 0.0)


class Linked:
    """The nodes under a likelihood in which events are independent otherwise.

    Args:
        white: what they do to residuals, whitened, shape (E, n, 2), or (E, n, 4) with levels.
        spread: standard deviation of the sensor's walk over each event (m), shape (E,).
        links: the nodes.
        levels: their covariance.
    """

    def __init__(self, white: Array, spread: Array, links: Links, levels: Levels | None = None) -> None:
        self.white, self.spread, self.links, self.levels = white, spread, links, levels
        own = np.swapaxes(white, 1, 2) @ white
        steps = np.array([[1.0, -1.0], [-1.0, 1.0]])
        own[:, :LEVEL, :LEVEL] += steps / spread[:, None, None] ** 2
        band = np.zeros((links.width + 1, links.size))
        if levels is not None:
            level, before = links.levels, links.before
            links.add(band, level, level, 1.0 / levels.new)
            links.add(band, before, before, levels.kept**2 / levels.new)
            links.add(band, before, level, -levels.kept / levels.new)
            links.add(band, level, before, -levels.kept / levels.new)
        links.add(band, links.nodes[:, :, None], links.nodes[:, None, :], own)
        self.root = cholesky_banded(band, lower=True)

    def found(self, white: Array) -> Array:
        """Most likely nodes of each event for whitened residuals (E, n, m), shape (E, 2 or 4, m)."""
        return self._of(self._found(white), self.links.nodes)

    def _found(self, white: Array) -> Array:
        along, links = np.swapaxes(self.white, 1, 2) @ white, self.links
        right = np.zeros((links.size, white.shape[2]))
        there = links.nodes >= 0
        np.add.at(right, links.at[links.nodes[there]], along[there])
        return np.asarray(cho_solve_banded((self.root, True), right)[links.at])

    def _of(self, nodes: Array, which: Index) -> Array:
        return np.where((which >= 0)[..., None], nodes[which], 0.0)

    def apart(self, white: Array) -> Array:
        """Whitened residuals less what the nodes take of them, and the nodes' steps in rows after them.

        Shape (E, n + 1, m), with levels (E, n + 3, m): the step to the level at the end of an event, and, at the
        first of a group, the level where it begins.
        """
        nodes = self._found(white)
        stands = self._of(nodes, self.links.nodes)
        rows = [white - self.white @ stands, ((stands[:, 0] - stands[:, 1]) / self.spread[:, None])[:, None]]
        if self.levels is not None:
            steps = self._steps(nodes) / np.sqrt(self.levels.new)[:, None]
            rows.append(self._by_event(steps))
        return np.concatenate(rows, axis=1)

    def _steps(self, nodes: Array) -> Array:
        """Of the levels (L, m), from what is left of the one before."""
        assert self.levels is not None
        return nodes[self.links.levels] - self.levels.kept[:, None] * self._of(nodes, self.links.before)

    def _by_event(self, values: Array) -> Array:
        """What belongs to the levels (L, m): to those where events end, and where the first ones begin."""
        events = self.links.nodes.shape[0]
        out = np.zeros((events, 2, values.shape[1]))
        out[:, 0] = values[:events]
        out[self.links.nodes[:, LEVEL] >= 2 * events, 1] = values[events:]
        return out

    @property
    def logs(self) -> Array:
        """What each event adds to the logarithm of the determinant of the covariance, shape (E,)."""
        roots, events = np.log(self.root[0])[self.links.at][:, None], self.spread.size
        out = roots[:events, 0] + np.log(self.spread)
        if self.levels is not None:
            out += self._by_event(roots[events:] + 0.5 * np.log(self.levels.new)[:, None]).sum(axis=(1, 2))
        return 2.0 * out

    @cached_property
    def _inverse(self) -> Array:
        """The inverse of the nodes' matrix within its band (Takahashi, Fagan & Chin 1973)."""
        root, width, size = self.root, self.links.width, self.links.size
        out, near = np.zeros_like(root), np.zeros((width, width))  # near: of the nodes that follow
        for j in range(size - 1, -1, -1):
            below = root[1:, j] / root[0, j]
            beside = -near @ below
            own = root[0, j] ** -2.0 - below @ beside
            out[0, j], out[1:, j] = own, beside
            near[1:, 1:] = near[:-1, :-1].copy()
            near[0, 0], near[0, 1:], near[1:, 0] = own, beside[:-1], beside[:-1]
        return out

    def covariance(self) -> Array:
        """Of the nodes of each event, given the residuals, shape (E, 2, 2) or (E, 4, 4)."""
        return self.links.of(self._inverse, self.links.nodes[:, :, None], self.links.nodes[:, None, :])

    def slopes(self, white: Array) -> Array:
        """Of the cost in the logarithms of the walk's size and of size and length of the levels, shape (1,) or (3,).

        Args:
            white: whitened residuals, shape (E, n).
        """
        nodes, steps = self._found(white[..., None]), np.array([1.0, -1.0])
        off = self._of(nodes, self.links.nodes)[:, :LEVEL, 0] @ steps
        walk = (steps @ self.covariance()[:, :LEVEL, :LEVEL] @ steps + off**2) / self.spread**2
        out = [2.0 * (1.0 - walk).sum()]
        if self.levels is not None:
            levels, before, level = self.levels, self.links.before, self.links.levels
            last, step = self._of(nodes, before)[:, 0], self._steps(nodes)[:, 0]
            own, both, prior = (
                self.links.of(self._inverse, i, j) for i, j in ((level, level), (level, before), (before, before))
            )
            squares = step**2 + own - 2.0 * levels.kept * both + levels.kept**2 * prior
            shared = step * last + both - levels.kept * prior
            left = 1.0 - squares / levels.new
            out.append(2.0 * left.sum())
            out.append(((left * levels.less - 2.0 * levels.longer * shared) / levels.new).sum())
        return np.array(out)


def grown(spread: Array, first: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Variance of the walk's nodes before and after each event, nothing else known (m^2), shape (E,) each."""
    steps = np.cumsum(spread**2)
    begun = np.where(first, steps - spread**2, 0.0)
    after = steps - np.maximum.accumulate(begun)
    return after - spread**2, after
