"""What goes on from event to event: where the sensor stands, and a level of friction that wanders.

*Sensor.* A reading that is off by w(t) changes the residual force by -c w(t) - k (w(t) - w(t0)): the spring (c) is read
from it, and what sticks (k) remembers where it was at the arrest t0. With w_0 and w_1 at the arrests before and after,
a time T apart, w(t) = (1 - s) w_0 + s w_1 and a Brownian bridge, s = (t - t0) / T. The bridge is an event's own. The
nodes hang together from event to event of a run, w_1 - w_0 ~ N(0, size^2 T), and begin at zero.

*Level.* The caps of an event are partly its own and partly a level, which leaves the stiffnesses as they are. It is
that of friction as a whole, or of static or sliding friction alone, whose share of the caps changes as they heal. It is
a Matern process of order 3/2 along time, slip path or place: cov = size^2 (1 + q) exp(-q) with
q = sqrt(3) |s_i - s_j| / length in a run, nothing between runs. It has a slope, and value and slope together are Markov
(Hartikainen & Sarkka 2010); its nodes are where events end, in the middle of slips. Between two nodes it goes as a
cubic but for the bridge of an integrated Brownian motion, which is an event's own: so does the process where events are
short beside its length, and a smoother one with less of the bridge.

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
from scipy.special import gammainc

Array = NDArray[np.float64]
Index = NDArray[np.intp]
WALK = 2  # columns of the walk, before those of the levels
STATES = 2  # of a level at a node: value, and slope times the usual way of an event
CLOSEST = 1e-3  # of that way: levels at one place are nearly one
FARTHEST = 1e3  # lengths, at which nothing is left of a level
TURN = 1e-5  # e-folds of the length, for derivatives in it


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
        unit: usual way of an event, in which lengths are counted.
        share: of the way of an event that is over, shape (E, n).
        slides: share of the strength that slides, and goes with the level where it is, shape (E, n).
        held: share of the way that was over when the rest came to rest, with the level of then, shape (E,).
        rests: share of the strength that goes with the level of then, shape (E, n).
    """

    begin: Array
    end: Array
    group: Index
    unit: float
    share: Array
    slides: Array
    held: Array
    rests: Array

    @cached_property
    def nodes(self) -> Index:
        """Nodes where every event begins and ends, shape (E, 2)."""
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
        """From the node before along the chain, in units; infinite at the first of a group, shape (L,)."""
        at, of = self.at[self.order], self.of[self.order]
        apart = np.maximum(np.diff(at, prepend=at[:1]) / self.unit, CLOSEST)
        out = np.empty(at.size)
        out[self.order] = np.where(np.append(True, of[1:] != of[:-1]), np.inf, apart)
        return out

    @cached_property
    def before(self) -> Index:
        """The node that comes before along the chain, -1 for none, shape (L,)."""
        out = np.full(self.at.size, -1)
        out[self.order] = np.append(-1, self.order[:-1])
        return np.where(np.isinf(self.gaps), -1, out)

    @property
    def states(self) -> Index:
        """Values and slopes at the two ends of every event, shape (E, 4)."""
        return pairs(self.nodes)

    @cached_property
    def longest(self) -> float:
        """Of a group, in units."""
        return float(max(np.ptp(self.at[self.of == g]) for g in np.unique(self.of))) / self.unit

    @cached_property
    def way(self) -> Array:
        """From begin to end, in units, shape (E,)."""
        return (self.end - self.begin) / self.unit

    @cached_property
    def mean(self) -> Array:
        """The mean over an event, of its four states, shape (E, 4)."""
        half = np.full_like(self.way, 0.5)
        return np.stack([half, self.way / 12.0, half, -self.way / 12.0], axis=1)

    def loads(self, caps: Array) -> Array:
        """What the four states of an event do, given what an e-fold of its caps does: (E, n) to (E, n, 4)."""
        own, held = _cubic(self.share, self.way[:, None]), _cubic(self.held, self.way)[:, None]
        return np.asarray(caps[..., None] * (self.slides[..., None] * own + self.rests[..., None] * held))

    def course(self, share: Array, event: Index, states: Array) -> Array:
        """Level at shares of the ways of events (n,), from the states of all events (E, 4), shape (n,)."""
        return np.asarray((_cubic(share, self.way[event]) * states[event]).sum(axis=1))

    def bridge(self) -> Array:
        """Covariance between its nodes of a level whose slope gains a variance of 1 over a unit, shape (E, n, n).

        That of an integrated Brownian motion with both ends given: the influence function of a clamped beam.
        """
        one, other = self.share[:, :, None], self.share[:, None, :]
        held, slides, rests = self.held[:, None, None], self.slides, self.rests
        both = slides[:, :, None] * slides[:, None, :] * _clamped(one, other)
        both += slides[:, :, None] * rests[:, None, :] * _clamped(one, held)
        both += rests[:, :, None] * slides[:, None, :] * _clamped(held, other)
        both += rests[:, :, None] * rests[:, None, :] * _clamped(held, held)
        return np.asarray(np.abs(self.way[:, None, None]) ** 3 * both)

    def to_states(self, values: Array) -> Array:
        """Sums of what belongs to the states of events, shape (E, 4) to (2 L,)."""
        return np.asarray(np.bincount(self.states.ravel(), values.ravel(), STATES * self.at.size), float)


def _cubic(s: Array, way: Array) -> Array:
    """Weights of values and slopes at both ends of a way, at a share of it, shape (..., 4)."""
    whole = s**2 * (3.0 - 2.0 * s)
    return np.stack([1.0 - whole, way * s * (1.0 - s) ** 2, whole, -way * s**2 * (1.0 - s)], axis=-1)


def _clamped(one: Array, other: Array) -> Array:
    """Influence function of a clamped beam of unit length."""
    s, t = np.minimum(one, other), np.maximum(one, other)
    return np.asarray(s**2 * (1.0 - t) ** 2 * (3.0 * t - s - 2.0 * t * s) / 6.0)


def pairs(of: Index) -> Index:
    """Numbers of both states of nodes, -1 for none: (n, k) to (n, 2 k)."""
    both = np.where(of[..., None] < 0, -1, STATES * of[..., None] + np.arange(STATES))
    return both.reshape(*of.shape[:-1], -1)


class Levels:
    """The covariance C of levels: x = A x_before + N(0, Q) along the chain.

    Args:
        chain: which follows which.
        size: standard deviation (share of the strength).
        length: in the chain's units.

    Attributes:
        kept: A of every node, zero where none comes before, shape (L, 2, 2).
        new: Q of every node, shape (L, 2, 2).
    """

    def __init__(self, chain: Chain, size: float, length: float) -> None:
        self.chain, self.size, self.length = chain, size, length
        self.kept, self.new = self._step(chain.gaps)

    @property
    def bend(self) -> float:
        """Standard deviation of what the slope gains over a unit."""
        return float(2.0 * self.size * (np.sqrt(3.0) / self.length) ** 1.5)

    def _step(self, gaps: Array) -> tuple[Array, Array]:
        rate = np.sqrt(3.0) / self.length
        q = np.minimum(rate * gaps, FARTHEST)
        left, lost = np.exp(-q), gammainc(3.0, 2.0 * q)  # lost: 1 - exp(-2 q) (1 + 2 q + 2 q^2)
        kept = _matrices(left * (1.0 + q), left * q / rate, -left * q * rate, left * (1.0 - q))
        both = 2.0 * rate * (q * left) ** 2
        return kept, self.size**2 * _matrices(lost, both, both, rate**2 * (lost + 4.0 * q * left**2))

    @cached_property
    def _inverse(self) -> Array:
        (a, b), (_, d) = np.moveaxis(self.new, 0, 2)
        return _matrices(d, -b, -b, a) / self._size[:, None, None]

    @cached_property
    def _size(self) -> Array:
        (a, b), (_, d) = np.moveaxis(self.new, 0, 2)
        return np.asarray(a * d - b**2)

    @property
    def logs(self) -> Array:
        """Logarithms of the determinants of Q, shape (L,)."""
        return np.log(self._size)

    @cached_property
    def precision(self) -> Array:
        """What every node adds to the inverse of C, of the states before it and its own, shape (L, 4, 4)."""
        apart = np.concatenate([-self.kept, np.broadcast_to(np.eye(STATES), self.kept.shape)], axis=2)
        return np.asarray(np.swapaxes(apart, 1, 2) @ self._inverse @ apart)

    def whitened(self, states: Array, before: Array) -> Array:
        """Steps of states (L, 2, m) from those before them, of unit variance."""
        root = np.swapaxes(np.linalg.cholesky(self._inverse), 1, 2)
        return np.asarray(root @ (states - self.kept @ before))

    def longer(self) -> tuple[Levels, Levels]:
        """The same a little shorter and longer, for derivatives in the logarithm of the length."""
        less, more = (self.length * np.exp(folds) for folds in (-TURN, TURN))
        return Levels(self.chain, self.size, less), Levels(self.chain, self.size, more)

    def times(self, values: Array) -> Array:
        """C times values, shape (2 L,)."""
        order = self.chain.order
        kept, new = self.kept[order], self.new[order]
        band = np.zeros((2 * STATES, values.size))
        band[0] = 1.0
        for i in range(STATES):
            for j in range(STATES):
                band[STATES + i - j, j:-STATES:STATES] = -kept[1:, i, j]
        upper = np.zeros_like(band)  # the same transposed
        for k in range(2 * STATES):
            upper[-1 - k, k:] = band[k, : values.size - k]
        way = pairs(order[:, None]).ravel()
        turned = solve_banded((0, 2 * STATES - 1), upper, values[way]).reshape(-1, STATES, 1)
        out = np.empty_like(values)
        out[way] = solve_banded((2 * STATES - 1, 0), band, (new @ turned).ravel())
        return out

    def slope_times(self, values: Array) -> Array:
        """Derivative of C in the logarithm of the length, times values, shape (2 L,)."""
        less, more = self.longer()
        return (more.times(values) - less.times(values)) / (2.0 * TURN)

    def of_events(self) -> Array:
        """C of the four states of every event, shape (E, 4, 4)."""
        way = self.chain.way
        rest = self.size**2 * np.diag([1.0, 3.0 / self.length**2])
        kept, _ = self._step(np.abs(way))
        beside = kept @ rest  # of the state that is farther along the coordinate, and the other one
        beside = np.where((way < 0.0)[:, None, None], np.swapaxes(beside, 1, 2), beside)
        own = np.broadcast_to(rest, beside.shape)
        return np.concatenate(
            [np.concatenate([own, np.swapaxes(beside, 1, 2)], axis=2), np.concatenate([beside, own], axis=2)], axis=1
        )


def _matrices(a: Array, b: Array, c: Array, d: Array) -> Array:
    return np.stack([np.stack([a, b], axis=-1), np.stack([c, d], axis=-1)], axis=-2)


class Links:
    """The nodes of all events, and their places in a banded matrix.

    Args:
        first: whether an event is the first of its run, where the walk begins at zero, shape (E,).
        chain: of the levels, None where there are none.

    Attributes:
        nodes: of every event: the walk before and after, the states of the level before and after, -1 for none.
        steps: of every node of the level: the states before it and its own, shape (L, 4).
    """

    def __init__(self, first: NDArray[np.bool_], chain: Chain | None) -> None:
        events = np.arange(first.size)
        self.nodes = np.stack([np.where(first, -1, events - 1), events], axis=1)
        self.size, self.steps = first.size, np.zeros((0, 2 * STATES), int)
        if chain is not None:
            levels = np.arange(chain.at.size)
            steps = pairs(np.stack([chain.before, levels], axis=1))
            self.steps = np.where(steps < 0, -1, steps + first.size)
            self.nodes = np.concatenate([self.nodes, chain.states + first.size], axis=1)
            self.size += STATES * levels.size
        self.at = np.arange(self.size)
        if chain is not None:
            i, j = self._pairs()
            graph = coo_array((np.ones(i.size), (i, j)), shape=(self.size, self.size)).tocsr()
            self.at[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(self.size)
        i, j = self._pairs()
        self.width = int(np.abs(self.at[i] - self.at[j]).max())

    def _pairs(self) -> tuple[Index, Index]:
        parts = [np.broadcast_arrays(m[:, :, None], m[:, None, :]) for m in (self.nodes, self.steps)]
        i, j = (np.concatenate([part[k].ravel() for part in parts]) for k in (0, 1))
        there = (i >= 0) & (j >= 0)
        return i[there], j[there]

    def add(self, band: Array, which: Index, values: Array) -> None:
        """Symmetric matrices (g, k, k) of nodes (g, k) to the lower half of a banded matrix (width + 1, nodes)."""
        i, j = np.broadcast_arrays(which[:, :, None], which[:, None, :])
        row, column = self.at[i], self.at[j]
        use = (i >= 0) & (j >= 0) & (row >= column)
        np.add.at(band, ((row - column)[use], column[use]), values[use])

    def of(self, band: Array, which: Index) -> Array:
        """Parts (g, k, k) of a symmetric banded matrix for nodes (g, k), zero where there is no node."""
        i, j = np.broadcast_arrays(which[:, :, None], which[:, None, :])
        there = (i >= 0) & (j >= 0)
        row, column = self.at[np.where(there, i, 0)], self.at[np.where(there, j, 0)]
        return np.where(there, band[np.abs(row - column), np.minimum(row, column)], 0.0)


class Linked:
    """The nodes under a likelihood in which events are independent otherwise.

    Args:
        white: what they do to residuals, whitened, shape (E, n, 2), or (E, n, 6) with levels.
        spread: standard deviation of the sensor's walk over each event (m), shape (E,).
        links: the nodes.
        levels: their covariance.
    """

    def __init__(self, white: Array, spread: Array, links: Links, levels: Levels | None = None) -> None:
        self.white, self.spread, self.links, self.levels = white, spread, links, levels
        own = np.swapaxes(white, 1, 2) @ white
        steps = np.array([[1.0, -1.0], [-1.0, 1.0]])
        own[:, :WALK, :WALK] += steps / spread[:, None, None] ** 2
        band = np.zeros((links.width + 1, links.size))
        if levels is not None:
            links.add(band, links.steps, levels.precision)
        links.add(band, links.nodes, own)
        self.root = cholesky_banded(band, lower=True)

    def found(self, white: Array) -> Array:
        """Most likely nodes of each event for whitened residuals (E, n, m), shape (E, 2 or 6, m)."""
        return _of(self._found(white), self.links.nodes)

    def _found(self, white: Array) -> Array:
        along, links = np.swapaxes(self.white, 1, 2) @ white, self.links
        right = np.zeros((links.size, white.shape[2]))
        there = links.nodes >= 0
        np.add.at(right, links.at[links.nodes[there]], along[there])
        return np.asarray(cho_solve_banded((self.root, True), right)[links.at])

    def apart(self, white: Array) -> Array:
        """Whitened residuals less what the nodes take of them, and the nodes' steps in rows after them.

        Shape (E, n + 1, m), with levels (E, n + 5, m): the steps of value and slope to the end of an event, and, at the
        first of a group, those where it begins.
        """
        nodes = self._found(white)
        stands = _of(nodes, self.links.nodes)
        rows = [white - self.white @ stands, ((stands[:, 0] - stands[:, 1]) / self.spread[:, None])[:, None]]
        if self.levels is not None:
            states = _of(nodes, self.links.steps)
            steps = self.levels.whitened(states[:, STATES:], states[:, :STATES])
            rows.append(self._by_event(steps).reshape(white.shape[0], 2 * STATES, -1))
        return np.concatenate(rows, axis=1)

    def _by_event(self, values: Array) -> Array:
        """What belongs to nodes of the level, (L, ...), to the events that end or are the first to begin there."""
        events = self.spread.size
        assert self.levels is not None
        begin = self.levels.chain.nodes[:, 0]
        out = np.zeros((events, 2, *values.shape[1:]))
        out[:, 0] = values[:events]
        out[begin >= events, 1] = values[events:]
        return out

    @property
    def logs(self) -> Array:
        """What each event adds to the logarithm of the determinant of the covariance, shape (E,)."""
        roots, events = 2.0 * np.log(self.root[0])[self.links.at], self.spread.size
        out = roots[:events] + 2.0 * np.log(self.spread)
        if self.levels is not None:
            own = roots[events:].reshape(-1, STATES).sum(axis=1) + self.levels.logs
            out = out + self._by_event(own).sum(axis=1)
        return np.asarray(out)

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
            if width:
                near[1:, 1:] = near[:-1, :-1].copy()
                near[0, 0], near[0, 1:], near[1:, 0] = own, beside[:-1], beside[:-1]
        return out

    def covariance(self) -> Array:
        """Of the nodes of each event, given the residuals, shape (E, 2, 2) or (E, 6, 6)."""
        return self.links.of(self._inverse, self.links.nodes)

    def slopes(self, white: Array) -> Array:
        """Of the cost in the logarithms of the walk's size and of size and length of the levels, shape (1,) or (3,).

        Args:
            white: whitened residuals, shape (E, n).
        """
        nodes, steps = self._found(white[..., None]), np.array([1.0, -1.0])
        off = _of(nodes, self.links.nodes)[:, :WALK, 0] @ steps
        walk = (steps @ self.covariance()[:, :WALK, :WALK] @ steps + off**2) / self.spread**2
        out = [2.0 * (1.0 - walk).sum()]
        if self.levels is not None:
            states = _of(nodes, self.links.steps)
            squares = states @ np.swapaxes(states, 1, 2) + self.links.of(self._inverse, self.links.steps)
            out.append(2.0 * (STATES * squares.shape[0] - (self.levels.precision * squares).sum()))
            less, more = self.levels.longer()
            changed = ((more.precision - less.precision) * squares).sum() + (more.logs - less.logs).sum()
            out.append(changed / (2.0 * TURN))
        return np.array(out)


def _of(nodes: Array, which: Index) -> Array:
    """Values of nodes (n, m) in the order that is asked for, (g, k) to (g, k, m); zero where there is none."""
    return np.where((which >= 0)[..., None], nodes[which], 0.0)


def grown(spread: Array, first: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Variance of the walk's nodes before and after each event, nothing else known (m^2), shape (E,) each."""
    steps = np.cumsum(spread**2)
    begun = np.where(first, steps - spread**2, 0.0)
    after = steps - np.maximum.accumulate(begun)
    return after - spread**2, after
