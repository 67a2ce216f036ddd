"""What is random: noise of the sensor, events that differ, and misfit that is correlated from point to point.

But for a walk of the sensor and a level of the strength that wanders, which go on from event to event
(:mod:`.linked_events`), residuals of one event belong together and those of two events do not. The covariance of an
event's residuals is

    S = N + diag(numeric) + Z D Z' + L K L',    K_ij = exp(-|s_i - s_j|)

with the noise N of the sensor's samples carried to a force by stiffness and inertia together, random effects D
(strength, yield displacements, shape of the backbone, position at the arrest), and misfit whose size L depends on the
phase of the cycle and, for errors of the position, on the stiffness, the bridge of the sensor's walk, and errors that
are periodic within a fringe.
All sizes are estimated from the campaign itself by maximum likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtrtri, dtrtrs

from ...errors import FitError
from .knots import PHASES
from .linked_events import WALK, Chain, Levels, Linked, Links, nodes

Array = NDArray[np.float64]
EVENTS = ("strength", "stretch", "shape", "offset")  # what differs from event to event
NAMES = (*EVENTS, *PHASES, "position", "walk", "fringe", "white")
# where the strength wanders: share of it, usual ways of an event, share of the process's own bend between nodes
WANDER = ("level", "length", "bend")
OWN, _PHASE = len(EVENTS), slice(len(EVENTS), len(EVENTS) + len(PHASES))
_LENGTHS = EVENTS.index("offset")  # that many are logarithms
_POSITION, _WALK, _FRINGE, _WHITE, _LEVEL, _LENGTH, _BEND = range(len(NAMES) - 4, len(NAMES) + len(WANDER))
# centre of what is expected of each size, and how many e-folds around it: shares, and metres
CENTRES = np.log(np.array([1e-3, 2e-2, 1e-2, 2e-9, 1e-3, 1e-3, 1e-3, 1e-3, 1e-9, 1e-9, 1e-9, 1.0, 1e-3, 4.0, 0.3]))
WIDTHS = np.array([2.0, 2.0, 2.0, 1.0, 2.0, 2.0, 2.0, 2.0, 1.0, 1.5, 1.0, 0.1, 2.0, 1.5, 1.0])
STATED = 0.25  # e-folds around a walk of the sensor that is stated: a record at rest tells it to one digit
NUMERIC = 1e-4  # share of the strength below which nothing is claimed
REACH = 1.0  # correlation length along the place
FARTHEST = 1.5  # step of a size, in e-folds
DAMPINGS = 6  # of a step that does not lower the cost
LEAST = 1e-2  # damping of a step, over the second derivative
SETTLED = 0.05  # fall of the cost, expected or found, at which the search ends
EXACT = 0.02  # of a level, to which any process describes it
PARTS = ("both", "static", "sliding")  # of friction, that wander
SHORTEST = 2.0  # length of a wander, in usual distances of events: it goes on from one to the next


@dataclass(frozen=True)
class Follows:
    """What the level of the strength follows.

    Attributes:
        coordinate: one of :data:`.problem.ALONG`.
        unit: usual distance of events along it (s or m).
        equally_likely: coordinates that these data cannot distinguish from it.
        of: which friction wanders, one of :data:`PARTS`.
    """

    coordinate: str
    unit: float
    equally_likely: tuple[str, ...] = ()
    of: str = "both"


@dataclass(frozen=True)
class Scatter:
    """Logarithms of the sizes, in the order of NAMES.

    Attributes:
        sizes: of what is random, shape (12,), with a level that wanders (15,).
        most: of what differs from event to event, which is not estimated larger, shape (5,), the last one of the level.
        follows: what the level follows; None where strengths of events are independent.
    """

    sizes: Array
    most: Array = field(default_factory=lambda: np.full(OWN + 1, np.inf))
    follows: Follows | None = None

    @classmethod
    def wide(cls) -> Scatter:
        """What a fit begins with, so that no single kink of the model holds it."""
        return cls(np.log(np.array([1e-2, 0.1, 0.05, 5e-9, 0.02, 0.02, 0.02, 0.02, 2e-9, 1e-9, 1e-9, 1.0])))

    def larger(self, folds: float) -> Scatter:
        """The same, all but the noise of samples, larger by ``folds`` e-folds."""
        return replace(self, sizes=self.sizes + folds * ~np.isin(np.arange(self.sizes.size), (_WHITE, _LENGTH)))

    def within(self, other: Scatter) -> Scatter:
        """The same where events may not differ more than in another, and their level follows what it does there.

        A law that is added to a model explains a part of how events differ under it, or nothing of that. Where a model
        describes the forces within events badly, a wrong law may describe them better and leave events more scatter.
        """
        own = np.append(self.sizes[: len(NAMES)], other.sizes[len(NAMES) :])
        level = other.sizes[_LEVEL:_LENGTH] if other.follows else [np.inf]
        return replace(self, sizes=own, most=np.append(other.sizes[:OWN], level), follows=other.follows)

    def unbound(self) -> Scatter:
        """The same where events may differ as they do."""
        return replace(self, most=np.full_like(self.most, np.inf))

    def following(self, follows: Follows) -> Scatter:
        """The same with a level that wanders, which takes most of what the strength of events differs."""
        level = [self.sizes[0] + np.log(0.8), *CENTRES[_LENGTH:]]
        sizes = np.concatenate([self.sizes[: len(NAMES)], level])
        sizes[0] += np.log(0.6)
        return replace(self, sizes=sizes, follows=follows)

    def independent(self) -> Scatter:
        """The same with strengths of events that do not follow each other, and differ as much."""
        if self.follows is None:
            return self
        sizes = self.sizes[: len(NAMES)].copy()
        sizes[0] = np.logaddexp(2.0 * sizes[0], 2.0 * self.sizes[_LEVEL]) / 2.0
        return Scatter(sizes)

    def unexpected(self) -> dict[str, float]:
        """Phase -> misfit (share of the strength) that lies beyond two standard deviations of what is expected."""
        beyond = self.sizes[_PHASE] > CENTRES[_PHASE] + 2.0 * WIDTHS[_PHASE]
        return {name: float(np.exp(s)) for name, s, far in zip(PHASES, self.sizes[_PHASE], beyond, strict=True) if far}

    def named(self) -> dict[str, float]:
        """Name -> size: shares of strength and of yield displacement, metres of position; the length in m or s."""
        sizes = np.exp(self.sizes)
        if self.follows is not None:
            sizes[_LENGTH] *= self.follows.unit
        return dict(zip((*NAMES, *WANDER)[: sizes.size], sizes.tolist(), strict=True))


@dataclass(frozen=True)
class Blocks:
    """Residuals side by side by event, shape (E, n), with padding.

    Attributes:
        index: point of each place, shape (E, n).
        there: false for padding.
    """

    index: NDArray[np.intp]
    there: NDArray[np.bool_]

    @classmethod
    def of(cls, event: NDArray[np.intp], events: int) -> Blocks:
        count = np.bincount(event, minlength=events)
        index = np.zeros((events, max(int(count.max(initial=0)), 1)), np.intp)
        there = np.zeros(index.shape, bool)
        order = np.argsort(event, kind="stable")
        row = event[order]
        column = np.arange(order.size) - (np.cumsum(count) - count)[row]
        index[row, column], there[row, column] = order, True
        return cls(index, there)

    def __call__(self, values: Array, fill: float = 0.0) -> Array:
        """Side by side, shape (E, n, ...)."""
        out = values[self.index]
        out[~self.there] = fill
        return out


@dataclass(frozen=True)
class Known:
    """What the covariance is made of, at the points of every event, shape (E, n).

    ``noise`` and ``periodic`` are covariances (N^2) by the noise of samples and by errors of 1 m that are periodic
    within a fringe, shape (E, n, n); ``dropped`` a variance (N^2) that takes
    a point's weight; ``spring`` and ``tangent`` are stiffnesses of the spring and of what sticks (N/m); ``elapsed`` is
    the time since the arrest before, of ``lasting``, shape (E,), to the one after (s); ``first`` tells the first events
    of the runs, shape (E,); ``strength`` is what is known of the contact's beforehand (N); ``stated`` is a walk of the
    sensor that is stated (m/s^0.5), zero where none is; ``chain`` tells how the level of the strength goes on from
    event to event, where it does.
    """

    noise: Array
    periodic: Array
    dropped: Array
    local: Array
    phase: Array
    spring: Array
    tangent: Array
    place: Array
    elapsed: Array
    lasting: Array
    first: NDArray[np.bool_]
    there: NDArray[np.bool_]
    strength: float
    stated: float = 0.0
    chain: Chain | None = None

    @cached_property
    def expected(self) -> tuple[Array, Array]:
        """Logarithms of sizes as they are expected, and how many e-folds around it, shape (12,) or (15,) each."""
        size = len(NAMES) if self.chain is None else len(CENTRES)
        centres, widths = CENTRES[:size].copy(), WIDTHS[:size].copy()
        if self.stated > 0.0:
            centres[_WALK], widths[_WALK] = np.log(self.stated), STATED
        return centres, widths

    def prior(self, sizes: Array) -> float:
        """How far sizes are from what is expected of them (chi-square)."""
        centres, widths = self.expected
        return float((((sizes - centres) / widths) ** 2).sum())

    def with_local(self, local: Array) -> Known:
        """The same with other derivatives in the events' own."""
        return self._with(replace(self, local=local))

    def without(self, dropped: Array) -> Known:
        """The same with other points left out: a variance (N^2) that takes their weight, shape (E, n)."""
        return self._with(replace(self, dropped=dropped))

    def following(self, chain: Chain | None) -> Known:
        """The same with levels that go on along a chain, or with none."""
        return self._with(replace(self, chain=chain))

    def _with(self, other: Known) -> Known:
        other.__dict__.update(near=self.near, shifts=self.shifts, nodes=self.nodes)  # which depend on none of them
        return other

    @cached_property
    def near(self) -> Array:
        """Correlation of misfit at two points, shape (E, n, n)."""
        return np.exp(-np.abs(self.place[:, :, None] - self.place[:, None, :]) / REACH)

    @cached_property
    def _over(self) -> Array:
        """Share of the time between the arrests that is over, shape (E, n)."""
        return np.asarray(np.clip(self.elapsed / self.lasting[:, None], 0.0, 1.0))

    @cached_property
    def shifts(self) -> tuple[Array, Array]:
        """Covariance (N^2) by errors of the position of 1 m, correlated where near, and by a bridge of 1 m/s^0.5."""
        moved, over = np.where(self.there, self.spring + self.tangent, 0.0), self._over
        pairs = moved[:, :, None] * moved[:, None, :]
        least = np.minimum(over[:, :, None], over[:, None, :])
        bridge = self.lasting[:, None, None] * (least - over[:, :, None] * over[:, None, :])
        return pairs * self.near, pairs * bridge

    @cached_property
    def nodes(self) -> Array:
        """What the nodes of the sensor's walk do to the residual force (N/m), shape (E, n, 2)."""
        return nodes(self.spring, self.tangent, self._over) * self.there[..., None]

    @property
    def loads(self) -> Array:
        """What all nodes that go on from event to event do to the residual force, shape (E, n, 2 or 6)."""
        if self.chain is None:
            return self.nodes
        return np.concatenate([self.nodes, self.chain.loads(self.caps)], axis=2)

    @cached_property
    def bridge(self) -> Array:
        """Covariance (N^2) by a level between its nodes, whose slope gains a variance of 1 over a usual event."""
        assert self.chain is not None
        return np.asarray(self.strengths * self.chain.bridge())

    @property
    def caps(self) -> Array:
        """What an e-fold of the caps, stiffnesses as they are, does to the residual force (N), shape (E, n)."""
        return caps(self.local)

    @cached_property
    def strengths(self) -> Array:
        """Covariance (N^2) by levels of events that differ by an e-fold, shape (E, n, n)."""
        return np.asarray(self.caps[:, :, None] * self.caps[:, None, :])

    @cached_property
    def links(self) -> Links:
        """The nodes that go on from event to event."""
        return Links(self.first, self.chain)

    def linked(self, sizes: Array, white: Array) -> Linked:
        """The same, given what they do, whitened by what events have of their own."""
        return Linked(white, self.spread(sizes), self.links, self.levels(sizes))

    def levels(self, sizes: Array) -> Levels | None:
        """Covariance of the levels of the strength."""
        if self.chain is None:
            return None
        return Levels(self.chain, float(np.exp(sizes[_LEVEL])), float(np.exp(sizes[_LENGTH])))

    def spread(self, sizes: Array) -> Array:
        """Standard deviation of the sensor's walk over each event (m), shape (E,)."""
        return np.asarray(np.exp(sizes[_WALK]) * np.sqrt(self.lasting))


def caps(local: Array) -> Array:
    """Derivative in the caps, stiffnesses as they are: strength and yield displacement together, (..., 4) to (...)."""
    return np.asarray(local[..., 0] + local[..., 1])


def covariance(sizes: Array, k: Known) -> tuple[Array, Array]:
    """The covariance of events without and with the random effects (N^2), shape (E, n, n), the walk's nodes known."""
    plain, scaled = covariance_alone(sizes, k), k.local * np.exp(sizes[:OWN])
    return plain, plain + scaled @ np.swapaxes(scaled, 1, 2)


def covariance_alone(sizes: Array, k: Known) -> Array:
    s = np.exp(sizes)
    placed, walked = k.shifts
    out = _by_phase(s, k)
    for size, part in ((s[_POSITION], placed), (s[_WALK], walked), (s[_FRINGE], k.periodic), (s[_WHITE], k.noise)):
        out += size**2 * part
    if (levels := k.levels(sizes)) is not None:
        out += (s[_BEND] * levels.bend) ** 2 * k.bridge + (EXACT * levels.size) ** 2 * k.strengths
    at = np.arange(out.shape[1])
    out[:, at, at] += np.where(k.there, k.dropped + (NUMERIC * k.strength) ** 2, 1.0)
    return out


def _by_phase(s: Array, k: Known) -> Array:
    """Misfit (N^2), shape (E, n, n)."""
    own = np.where(k.there, s[_PHASE][k.phase] * k.strength, 0.0)
    out = own[:, :, None] * k.near
    out *= own[:, None, :]
    return out


def inverse(root: Array) -> Array:
    """Inverses of lower triangles, shape (E, n, n)."""
    return np.stack([dtrtri(one, lower=1)[0] for one in root])


def misfit(sizes: Array, residual: Array, k: Known) -> float:
    """Twice the negative logarithm of the likelihood of residuals (E, n), and of what is expected of the sizes."""
    return _misfit(sizes, residual, k)[0]


def _misfit(sizes: Array, residual: Array, k: Known) -> tuple[float, Array]:
    """The same, and the root of the covariance."""
    try:
        root = np.asarray(np.linalg.cholesky(covariance(sizes, k)[1]), float)
    except np.linalg.LinAlgError:
        return np.inf, np.zeros(0)
    side = np.concatenate([residual[..., None], k.loads], axis=2)
    white = np.stack([dtrtrs(one, r, lower=1)[0] for one, r in zip(root, side, strict=True)])
    try:
        linked = k.linked(sizes, white[..., 1:])
    except np.linalg.LinAlgError:
        return np.inf, np.zeros(0)
    logs = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum() + linked.logs.sum()
    squares = float((linked.apart(white[..., :1]) ** 2).sum())
    return squares + float(logs) + k.prior(sizes), root


@dataclass(frozen=True)
class Weighed:
    """Residuals under a covariance.

    Attributes:
        inverted: blocks of the events in the inverse of the covariance (N^-2), shape (E, n, n).
        weighted: the inverse covariance times the residuals (1/N), shape (E, n).
        linked: what goes on from event to event.
        stands: its most likely nodes (m, and shares of the strength), shape (E, 2 or 6).
        back: inverse root of the covariance with the nodes known (1/N), shape (E, n, n).
        white: residuals whitened by it, shape (E, n).
    """

    inverted: Array
    weighted: Array
    linked: Linked
    stands: Array
    back: Array
    white: Array


def weigh(sizes: Array, residual: Array, k: Known, root: Array | None = None) -> Weighed:
    """Residuals (E, n) under the whole covariance, of which the root with the nodes known may be given."""
    back = inverse(np.asarray(np.linalg.cholesky(covariance(sizes, k)[1]) if root is None else root, float))
    turned = np.swapaxes(back, 1, 2)
    white = back @ k.loads
    linked = k.linked(sizes, white)
    residual = back @ residual[..., None]
    stands = linked.found(residual)
    upon = turned @ white
    inverted = turned @ back
    inverted -= upon @ linked.covariance() @ np.swapaxes(upon, 1, 2)
    weighted = turned @ (residual - white @ stands)
    return Weighed(inverted, weighted[..., 0], linked, stands[..., 0], back, residual[..., 0])


def _slopes(sizes: Array, residual: Array, k: Known, root: Array) -> tuple[Array, Array, Array]:
    """Gradient of the cost, its average information, and what the squares of the sizes add to it, one for each size.

    The covariance goes with the square of a size, so that twice the gradient belongs to the second derivative, but for
    the share that the size has of the covariance where it acts: of all of it the information holds that already.
    """
    s = np.exp(sizes)
    found = weigh(sizes, residual, k, root)
    a, inverted = found.weighted, found.inverted
    inverted *= k.there[:, :, None]
    gradient, moved = np.zeros(sizes.size), np.zeros((*residual.shape, sizes.size))
    for r in range(OWN):
        z = s[r] * k.local[..., r]
        along = np.einsum("ei,ei->e", z, a)
        gradient[r] = 2.0 * (np.einsum("ei,ei->", z, (inverted @ z[..., None])[..., 0]) - (along**2).sum())
        moved[..., r] = 2.0 * z * along[:, None]
    misfit = _by_phase(s, k)
    traces = np.einsum("eij,eij->ei", inverted, misfit)
    own = (k.phase[..., None] == np.arange(len(PHASES))) & k.there[..., None]
    pulled = misfit @ np.concatenate([a[..., None], own * a[..., None]], axis=2)
    for p in range(len(PHASES)):
        gradient[OWN + p] = 2.0 * (traces - a * pulled[..., 0])[own[..., p]].sum()
        moved[..., OWN + p] = own[..., p] * pulled[..., 0] + pulled[..., 1 + p]
    for i, part in zip((_POSITION, _WALK, _FRINGE, _WHITE), (*k.shifts, k.periodic, k.noise), strict=True):
        pulled = (part @ a[..., None])[..., 0]
        gradient[i] = 2.0 * s[i] ** 2 * (np.einsum("eij,eij->", inverted, part) - (a * pulled).sum())
        moved[..., i] = 2.0 * s[i] ** 2 * pulled
    between = [_WALK, _LEVEL, _LENGTH][: 1 if k.chain is None else 3]
    gradient[between] += found.linked.slopes(found.white)
    moved[..., _WALK] += 2.0 * (k.nodes @ found.stands[:, :WALK, None])[..., 0]
    if k.chain is not None and (levels := k.levels(sizes)) is not None:
        loads = k.loads[..., WALK:]
        pulled = k.chain.to_states(np.einsum("eik,ei->ek", loads, a))
        bridge = (s[_BEND] * levels.bend) ** 2 * k.bridge
        part = (bridge @ a[..., None])[..., 0]
        left = np.einsum("eij,eij->", inverted, bridge) - (a * part).sum()
        inexact = (EXACT * levels.size) ** 2 * k.strengths
        own = (inexact @ a[..., None])[..., 0]
        gradient[_LEVEL] += 2.0 * (np.einsum("eij,eij->", inverted, inexact) - (a * own).sum())
        moved[..., _LEVEL] = 2.0 * own
        changes = (_LEVEL, 2.0, 2.0 * levels.times(pulled)), (_LENGTH, -3.0, levels.slope_times(pulled))
        gradient[_BEND], moved[..., _BEND] = 2.0 * left, 2.0 * part
        for size, power, of_states in changes:
            gradient[size] += power * left
            moved[..., size] += power * part + np.einsum("eik,ek->ei", loads, of_states[k.chain.states])
    white = found.linked.apart(found.back @ moved).reshape(-1, sizes.size)
    information = white.T @ white
    acts = 2.0 * np.einsum("ei,eis->s", a, moved)
    share = np.divide(np.diag(information), acts, out=np.ones(sizes.size), where=acts > 0.0)
    squares = 2.0 * gradient * np.clip(1.0 - share, 0.0, 1.0)
    if k.chain is not None:
        squares[_LENGTH] = 0.0
    centres, widths = k.expected
    gradient += 2.0 * (sizes - centres) / widths**2
    return gradient, information + np.diag(2.0 / widths**2), squares


def estimate(start: Scatter, residual: Array, known: Known, steps: int = 30) -> Scatter:
    """The sizes under which residuals (E, n), random effects at zero, are most likely.

    Newton's method, damped, within bounds around what is expected. In place of the second derivative it has the average
    information (Gilmour, Thompson & Cullis 1995) and what squares add to it where that is positive: sizes that only
    what is expected of them holds up would be overshot otherwise.

    Raises:
        FitError: the covariance is not positive definite in double precision.
    """
    centres, widths = known.expected
    low, high = centres - 5.0 * widths, centres + 4.0 * widths
    low[_WHITE], high[_WHITE] = -0.05, 1.0
    high[:_LENGTHS] = np.minimum(high[:_LENGTHS], 0.0)  # further apart than an e-fold are no two events of one contact
    own = [*range(OWN), _LEVEL] if known.chain is not None else [*range(OWN)]
    high[own] = np.maximum(np.minimum(high[own], start.most[: len(own)]), low[own])
    if known.chain is not None:  # shorter ones are no wander, and longer ones would be a level of every run
        low[_LENGTH], high[_LENGTH] = np.log(SHORTEST), np.log(max(known.chain.longest, 2.0 * SHORTEST))
        high[_BEND] = 0.0
    sizes, damping = np.clip(start.sizes, low, high), LEAST
    cost, root = _misfit(sizes, residual, known)
    if not np.isfinite(cost):
        raise FitError("the model's forces differ so much from event to event that no likelihood can be given")
    for _ in range(steps):
        gradient, information, squares = _slopes(sizes, residual, known, root)
        information += np.diag(np.maximum(squares, 0.0))
        free = ~(((sizes <= low) & (gradient > 0.0)) | ((sizes >= high) & (gradient < 0.0)))
        fallen = 0.0
        for _ in range(DAMPINGS):
            matrix = (information + damping * np.diag(np.diag(information)))[np.ix_(free, free)]
            step = np.zeros(sizes.size)
            step[free] = -np.linalg.solve(matrix, gradient[free])
            trial = np.clip(sizes + np.clip(step, -FARTHEST, FARTHEST), low, high)
            change = trial - sizes
            if -(gradient + 0.5 * information @ change) @ change < SETTLED:
                break
            there, other = _misfit(trial, residual, known)
            if there < cost:
                fallen, cost, sizes, root, damping = cost - there, there, trial, other, max(0.1 * damping, LEAST)
                break
            damping *= 10.0
        if fallen < SETTLED:
            break
    return replace(start, sizes=sizes)
