"""Gauss-Newton with exact derivatives; random effects and misfit within events in the likelihood."""

from __future__ import annotations

from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.sparse import coo_array, csr_array, dia_array

from ...errors import FitError
from ...system.progress import breathe
from ..fit.parameters import Free
from .bank import placed, spacing
from .problem import PULL, Point, Problem, Slopes
from .scatter import EVENTS, Blocks, Known, Scatter, Whitening, covariance, estimate, misfit

Array = NDArray[np.float64]
BEND = 1.0  # standard deviation of the second difference of neighbouring weights, over their mean
FARTHEST = 1.5  # step of a parameter on the search scale
PLACED = 2  # rounds after which the bank's elements are put where the strength is
ROUNDS = 10  # times that the scatter is estimated anew
FAR = 5.0  # standard deviations from what the rest of an event lets expect, from which a point is left out
FAILED = 4  # steps in turn that do not lower the cost, after which the search ends
DAMPING, LEAST = 1e-6, 1e-9  # of the first step, and of any: over the curvature of the cost in each parameter
GOOD, POOR = 0.7, 0.25  # shares of the expected fall of the cost, above and below which the damping changes
EASED, STIFFENED, RAISED = 0.1, 3.0, 30.0  # change of the damping after a good, a poor and a failed step
LAST = 30  # evaluations with the covariance as it was found
STEPS = 4  # evaluations between
NEWTON = 4  # steps of the sizes between
BESIDE, SEED = 2, 1  # fits begun anew about the end of one, and where
SETTLED = 0.3  # fall of the cost (in units of chi-square) at which a round ends
NONE = 1e-12  # share of the strength that the rounding of a step leaves in an element at its bound


@dataclass(frozen=True)
class Fit:
    """An optimum.

    Attributes:
        problem, point: what was fitted, and where.
        slopes: residuals and derivatives there.
        scatter: sizes of what is random.
        dropped: points left out, for they lie beyond what else is random (a jump of the sensor), shape (p,).
        known: what the covariance is made of.
        around: where the noise of the readings was carried to a force.
        blocks: points by event.
        strength: force of the contact at full strength (N).
        evaluations: of the model.
        valleys: changes of all that is shared, one standard deviation each, that the derivatives do not show (see
            :mod:`.valleys`).
    """

    problem: Problem
    point: Point
    slopes: Slopes
    scatter: Scatter
    dropped: NDArray[np.bool_]
    known: Known
    around: Point
    blocks: Blocks
    strength: float
    evaluations: int
    valleys: tuple[Array, ...] = ()

    @cached_property
    def _system(self) -> _System:
        """Found when asked for: a model that a hand moves is drawn, and judged when it stands still."""
        white = Whitening(self.scatter.sizes, self.known)
        return _System(self.problem, self.point, self.slopes, self.scatter, self.blocks, white)

    @cached_property
    def _judged(self) -> tuple[Array, float, Array]:
        system = self._system
        return system.likelihood(), float((system.target**2).sum()), system.covariance()

    def yielding(self, forces: Array) -> tuple[Point, float]:
        """Where the model's own parameters go to make room for forces, to first order.

        Args:
            forces: that come to the residual (N), shape (p,).

        Returns:
            The point, and the share of the forces for which it is: less than 1 where all of them would take a
            parameter further than a step of a fit goes.
        """
        change, events, _ = self._system.alone(forces).step(DAMPING, np.inf)
        far = float(np.abs(change[: self.point.z.size]).max(initial=0.0))
        share = min(1.0, FARTHEST / far) if far > 0.0 else 1.0
        return moved(self.point, share * change, self.point.events + share * events), share

    def drawn(self, rng: np.random.Generator) -> Point:
        """A point of the posterior as the derivatives have it, events at their best there."""
        values, turn = np.linalg.eigh(self.covariance)
        change = turn @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(values.size))
        change = np.clip(change, *reach(self.problem, self.point))
        return moved(self.point, change, self._system.events_after(change))

    @property
    def likelihood(self) -> Array:
        """Twice the negative logarithm of the marginal likelihood of each event, shape (E,)."""
        return self._judged[0]

    @property
    def prior(self) -> float:
        """Of the shared parameters (chi-square)."""
        return self._judged[1]

    @property
    def covariance(self) -> Array:
        """Of shared parameters, phases, weights and what cycles share, events marginalised."""
        return self._judged[2] + sum(np.outer(v, v) for v in self.valleys)

    @property
    def cost(self) -> float:
        """Twice the negative logarithm of likelihood and priors."""
        return float(self.likelihood.sum()) + self.prior

    @property
    def residual(self) -> Array:
        """Residual force with every event at its own best strength, stretch and offset (N), shape (p,)."""
        return self.slopes.residual

    @property
    def marginal(self) -> Array:
        """Residual force with all events alike (N), shape (p,)."""
        return self.slopes.residual - (self.slopes.local * self.point.events[self.problem.of]).sum(axis=1)

    @property
    def values(self) -> dict[str, float]:
        """Name -> SI value of what is shared."""
        return self.problem.values(self.point)

    @property
    def free(self) -> tuple[Free, ...]:
        """What is shared."""
        return self.problem.composition.shared

    def std(self) -> dict[str, float]:
        """Name -> standard deviation (SI)."""
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return {f.name: float(s * f.slope(float(z))) for f, s, z in zip(self.free, sd, self.point.z, strict=False)}


class _System:
    """The linear system of one step."""

    def __init__(
        self, problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, blocks: Blocks, white: Whitening
    ):
        self.problem, self.point, self.slopes, self.blocks = problem, point, slopes, blocks
        self.random = np.exp(2.0 * scatter.sizes[: len(EVENTS)])
        self.prior, self.target = prior_rows(problem, point)
        self.local = local = blocks(slopes.local)
        self.plain, self.white = white.back, white.with_events(local)
        self.shared = blocks(slopes.shared)
        self.marginal = blocks(slopes.residual) - np.einsum("eia,ea->ei", local, point.events)
        whitened = self.white(np.concatenate([self.shared, self.marginal[..., None]], axis=2))
        self.rows, self.rest = whitened[..., :-1], whitened[..., -1]

    def alone(self, forces: Array) -> _System:
        """The same with forces (N), shape (p,), in place of the residual, and priors that are met."""
        other = copy(self)
        other.marginal = self.blocks(forces)
        other.rest = self.white(other.marginal[..., None])[..., 0]
        other.target = np.zeros_like(self.target)
        return other

    def objective(self, point: Point, slopes: Slopes) -> float:
        """Of residual, random effects and priors, with this covariance."""
        white = self.plain @ self.blocks(slopes.residual)[..., None]
        _, target = prior_rows(self.problem, point)
        return float((white**2).sum() + (point.events**2 / self.random).sum() + (target**2).sum())

    def step(self, damping: float = 0.0, farthest: float = FARTHEST) -> tuple[Array, Array, float]:
        """Changes of what is shared, the events' own values after them, and the cost expected.

        Args:
            damping: over the curvature of the cost in each parameter (Marquardt 1963).
            farthest: change of a parameter on the search scale.
        """
        rows = self.rows.reshape(-1, self.rows.shape[-1])
        normal = rows.T @ rows + self.prior.T @ self.prior
        right = rows.T @ self.rest.ravel() + self.prior.T @ self.target
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
        root = np.linalg.cholesky(normal * scale[:, None] * scale + (damping + 1e-11) * np.eye(len(normal)))
        low, high = reach(self.problem, self.point, farthest)
        high = np.where(high - low > 1e-12, high, low + 1e-12)
        found = lsq_linear(root.T, -np.linalg.solve(root, right * scale), (low / scale, high / scale), method="bvls")
        change = found.x * scale
        events = self.events_after(change)
        rest, prior = self.rest.ravel() + rows @ change, self.target + self.prior @ change
        return change, events, float(rest @ rest + prior @ prior)

    def events_after(self, change: Array) -> Array:
        """The events' own values where what is shared is changed, shape (E, 4)."""
        weighted = self.white.weighted(self.marginal + self.shared @ change)
        return np.asarray(-self.random * np.einsum("eia,ei->ea", self.local, weighted))

    def covariance(self) -> Array:
        """Of the shared parameters; what stands at a bound does not move."""
        rows = self.rows.reshape(-1, self.rows.shape[-1])
        normal = rows.T @ rows + self.prior.T @ self.prior
        low, high = reach(self.problem, self.point)
        free = np.flatnonzero((low < 0.0) & (high > 0.0))
        out = np.zeros_like(normal)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal)[free], 1e-300))
        part = normal[np.ix_(free, free)] * scale[:, None] * scale
        out[np.ix_(free, free)] = np.linalg.pinv(part, hermitian=True) * scale[:, None] * scale
        return out

    def likelihood(self) -> Array:
        return np.asarray((self.rest**2).sum(axis=1) + self.white.logs)


def prior_rows(problem: Problem, point: Point) -> tuple[Array, Array]:
    """Rows of the priors over their standard deviations, and where the parameters stand in them."""
    shared = problem.composition.shared
    a, k = len(shared), point.weights.size
    b, c = point.phases.size, point.common.size
    size = a + b + k + c
    rows, target = [], []
    for i, f in enumerate(shared):
        if np.isfinite(f.width):
            row = np.zeros(size)
            row[i] = 1.0 / f.width
            rows.append(row)
            target.append((point.z[i] - f.inward(f.prior)) / f.width)
    for j, f in enumerate(problem.composition.phases):
        if f.name == PULL:
            for r, run in enumerate(problem.runs):
                row = np.zeros(size)
                row[a + j * len(problem.runs) + r] = 1e6 if run.virgin else 0.1
                rows.append(row)
                target.append(row.max() * point.phases[j, r] if run.virgin else 0.0)
    level, deviation = problem.composition.nominal
    if np.isfinite(deviation):
        row = np.zeros(size)
        row[a + b : a + b + k] = 1.0 / point.weights.sum() / deviation
        rows.append(row)
        target.append((np.log(point.weights.sum()) - np.log(level)) / deviation)
    # in shares of the mean weight as it is: else a contact as a whole weaker would look smoother
    whole, second = point.weights.sum(), np.diff(np.eye(k), 2, axis=0) / spacing(problem.composition.reach)
    bent = k / (BEND * whole) * (second @ point.weights)
    bend = np.zeros((k - 2, size))
    bend[:, a + b : a + b + k] = k / (BEND * whole) * second - bent[:, None] / whole
    alike = np.zeros((c, size))
    alike[:, a + b + k :] = np.eye(c) / problem.systematic
    return (
        np.vstack([*rows, bend, alike]),
        np.concatenate([target, bent, point.common / problem.systematic]),
    )


def moved(point: Point, change: Array, events: Array) -> Point:
    """The point after a step, within the bounds."""
    a, b = point.z.size, point.phases.size
    phases = point.phases + change[a : a + b].reshape(point.phases.shape)
    k = point.weights.size
    weights = point.weights + change[a + b : a + b + k]
    weights = np.where(weights > NONE * point.weights.sum(), weights, 0.0)
    return Point(point.z + change[:a], phases, weights, events, point.common + change[a + b + k :])


def reach(problem: Problem, point: Point, farthest: float = FARTHEST) -> tuple[Array, Array]:
    """The least and the largest change of everything shared; ``farthest`` on the search scale.

    The force is linear in the weights, which need no such bound.
    """
    shared = problem.composition.shared
    b = np.full(point.phases.size, np.inf)
    bounds = np.array([f.bounds for f in shared]).reshape(-1, 2).T
    low, high = np.maximum(bounds[0] - point.z, -farthest), np.minimum(bounds[1] - point.z, farthest)
    more, c = np.full(point.weights.size, np.inf), np.full(point.common.size, np.inf)
    return np.concatenate([low, -b, -point.weights, -c]), np.concatenate([high, b, more, c])


def beyond(known: Known, scatter: Scatter, marginal: Array, blocks: Blocks, size: int) -> NDArray[np.bool_]:
    """Points that what else is known of their event would not let expect, shape (p,)."""
    _, whole = covariance(scatter.sizes, known)
    inverse = np.linalg.inv(np.asarray(whole))
    z = np.einsum("eij,ej->ei", inverse, marginal) / np.sqrt(np.diagonal(inverse, axis1=1, axis2=2))
    out = np.zeros(size, bool)
    out[blocks.index[blocks.there]] = np.abs(z[blocks.there]) > FAR
    return out


def known_of(problem: Problem, point: Point, slopes: Slopes, blocks: Blocks, dropped: NDArray[np.bool_]) -> Known:
    """What the covariance is made of, at a point."""
    strength = float(point.weights.sum())
    return Known(
        noise(problem, point, slopes, blocks), blocks(np.where(dropped, strength**2, 0.0)), blocks(slopes.local),
        blocks(problem.phase), blocks(slopes.tangent), blocks(problem.place), blocks(problem.elapsed), blocks.there,
        strength,
    )  # fmt: skip


def noise(problem: Problem, point: Point, slopes: Slopes, blocks: Blocks) -> Array:
    """Covariance of the residual force (N^2) by the noise of single samples, event by event, shape (E, n, n).

    A sample that is off by e changes the force of springs and contact by k e, that of inertia by m e'': together, so
    that near the resonance of the contact, where the one nearly undoes the other, little noise is left. An element that
    sticks counts from where it last slid, and holds the error of that reading until it slides again.
    """
    values = problem.values(point)
    event, place = np.zeros(problem.of.size, int), np.zeros(problem.of.size, int)
    e, i = np.nonzero(blocks.there)
    event[blocks.index[e, i]], place[blocks.index[e, i]] = e, i
    out = np.zeros((*blocks.there.shape, blocks.there.shape[1]))
    first = 0
    elements = point.weights / problem.composition.reach
    for run, stiffness, slides in zip(problem.runs, slopes.sticking, slopes.slides, strict=True):
        own = slice(first, first + run.at.size)
        rate, acceleration = run.moving
        spring = values.get("rig.spring_stiffness", 0.0) if run.stiffness is None else run.stiffness
        stiff = dia_array((stiffness + spring, 0), shape=(stiffness.size, stiffness.size))
        since = remembered(elements, stiffness, slides)
        carried = (
            run.mean @ ((stiff - since) @ run.reading)
            + values["rig.damping"] * rate
            + values["rig.mass"] * acceleration
        )
        pairs = (carried @ carried.T).tocoo()
        i, j = pairs.coords
        together = event[own][i] == event[own][j]
        i, j = i[together], j[together]
        out[event[own][i], place[own][i], place[own][j]] = run.noise**2 * pairs.data[together]
        first += run.at.size
    return out


def remembered(elements: Array, stiffness: Array, slides: NDArray[np.bool_]) -> csr_array:
    """By how much the force at a knot falls for an error of the reading at an earlier one (N/m), shape (n, n).

    Args:
        elements: stiffness of every element (N/m), shape (k,).
        stiffness: of all that stick at the knots, events by themselves (N/m), shape (n,).
        slides: whether an element slides at a knot, shape (n, k).
    """
    n = len(slides)
    last = np.maximum.accumulate(np.where(slides, np.arange(n)[:, None], -1), axis=0)
    at, element = np.nonzero(~slides & (last >= 0))
    plain = ~slides @ elements
    own = np.divide(stiffness, plain, out=np.ones(n), where=plain > 0.0)
    return coo_array((elements[element] * own[at], (at, last[at, element])), shape=(n, n)).tocsr()


def fit(
    problem: Problem, point: Point, scatter: Scatter | None = None, *, rounds: int = ROUNDS, steps: int = STEPS,
    dropped: NDArray[np.bool_] | None = None, first: bool = False,
) -> Fit:  # fmt: skip
    """Find the optimum.

    Args:
        problem: data and composition.
        point: where to begin.
        scatter: sizes of what is random; default what is usually expected, estimated after the first round. Without
            them nothing is known of the contact either, and the bank's elements are put where its strength is.
        rounds: of the search, after each of which the scatter is estimated anew.
        steps: evaluations in a round.
        first: whether the sizes are estimated before the first step too (else after the first round).
        dropped: points left out; default those that are found to lie far off.

    Raises:
        FitError: the model gives no finite force at the start, or none at all.
    """
    if not point.weights.sum() > 0.0:
        raise FitError(
            "along this motion the contact would hold no force: check mass and spring, and the signs and units of "
            "drive and displacement"
        )
    blocks = Blocks.of(problem.of, problem.events)
    sizes = Scatter.wide() if scatter is None else scatter
    out = np.zeros(problem.of.size, bool) if dropped is None else dropped
    slopes = problem.evaluate(point)
    evaluations, damping = 1, DAMPING
    if not (np.isfinite(slopes.residual).all() and np.isfinite(slopes.shared).all()):
        raise FitError("the model gives no finite force along the motion")
    for turn in range(rounds):
        if scatter is None and turn == PLACED:
            problem, point = placed(problem, point)
            slopes = problem.evaluate(point)
        problem = problem.carried_by(slopes.tangent)
        slopes = problem.recarried(slopes, point)
        made = known_of(problem, point, slopes, blocks, out)
        if turn or first:
            marginal = blocks(slopes.residual) - np.einsum("eia,ea->ei", made.local, point.events)
            sizes = estimate(sizes, marginal, made, NEWTON)
            more = beyond(made, sizes, marginal, blocks, out.size) & ~out
            if dropped is None and more.any():
                out = out | more
                made = known_of(problem, point, slopes, blocks, out)
                sizes = estimate(sizes, marginal, made, NEWTON)
        point, slopes, total, count, damping = descend(problem, point, slopes, sizes, made, blocks, steps, damping)
        evaluations += count
        if turn > PLACED + 2 and total < 1.0:
            break
    made, around = known_of(problem, point, slopes, blocks, out), point
    point, slopes, _, count, _ = descend(problem, point, slopes, sizes, made, blocks, LAST)
    return _best(adapted(_found(problem, point, slopes, sizes, out, made, around, evaluations + count)))


def _best(found: Fit) -> Fit:
    """The best of a fit and of those begun about its end, as far off as the data allow.

    Where an element begins to slide the force has a kink, and the floor of the valley is rough: in one of its dents the
    search may stand still before it has arrived, and then every law that is added gains by leaving it.
    """
    rng = np.random.default_rng(SEED)
    best, evaluations = found, found.evaluations
    for _ in range(BESIDE):
        with suppress(FitError):
            other = adapted(refit(found.problem, best.drawn(rng), found))
            evaluations += other.evaluations
            best = min(best, other, key=lambda f: f.cost)
    return replace(best, evaluations=evaluations)


def refit(problem: Problem, point: Point, base: Fit, last: int = LAST) -> Fit:
    """Another model of the same data from a point, in at most ``last`` evaluations.

    With the covariance of ``base`` as it is: else the costs of the two could not be compared.

    Raises:
        FitError: the model gives no finite force at the start.
    """
    blocks, slopes = base.blocks, problem.evaluate(point)
    if not (np.isfinite(slopes.residual).all() and np.isfinite(slopes.shared).all()):
        raise FitError("the model gives no finite force along the motion")
    point, slopes, _, count, _ = descend(problem, point, slopes, base.scatter, base.known, blocks, last)
    return _like(base, problem, point, slopes, base.scatter, count + 1)


def adapted(found: Fit, rounds: int = ROUNDS, steps: int = STEPS) -> Fit:
    """A refit with sizes of its own of what is random; what carries the noise to a force stays that of its base.

    Under the sizes of a model that lacks an effect, events look as scattered as the effect makes them, and laws that
    describe it more or less well look alike.

    Args:
        found: where to go on from.
        rounds: of the search, before each of which the sizes are estimated anew; with none they are estimated only.
        steps: evaluations in a round.
    """
    problem, blocks = found.problem, found.blocks
    point, slopes, sizes, evaluations = found.point, found.slopes, found.scatter, found.evaluations
    damping = DAMPING
    for turn in range(rounds + 1):
        known = found.known.with_local(blocks(slopes.local))
        marginal = blocks(slopes.residual) - np.einsum("eia,ea->ei", known.local, point.events)
        before = misfit(sizes.sizes, marginal, known)
        sizes = estimate(sizes, marginal, known, NEWTON)
        fallen = before - misfit(sizes.sizes, marginal, known)
        if turn == rounds:
            break
        point, slopes, total, count, damping = descend(problem, point, slopes, sizes, known, blocks, steps, damping)
        evaluations += count
        if fallen + total < 1.0:
            break
    return _like(found, problem, point, slopes, sizes, evaluations)


def descend(
    problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, known: Known, blocks: Blocks, most: int,
    damping: float = DAMPING,
) -> tuple[Point, Slopes, float, int, float]:  # fmt: skip
    """Damped Gauss-Newton steps, with the covariance as it is, until the cost falls no more (Levenberg 1944).

    The valley of the cost is long and bent. Damping over the curvature in each parameter (Marquardt 1963) holds back
    what leads along it and lets a step go straight down its sides. A step along it may lead up its side and the next
    one down to its bottom again: one step after which the cost is higher is gone on from (the watchdog of Chamberlain,
    Powell, Lemarechal & Pedersen 1982) before the damping is raised.

    Returns:
        The point and the slopes there, by how much the cost fell, how often the model was evaluated, and the damping.
    """
    here, count, failed, poor, above = (point, slopes), 0, 0, 0, False
    first = cost = np.nan
    # what the noise is carried by stays as it is, or costs would jump; derivatives in the events are those here
    white = Whitening(scatter.sizes, known)
    while count < most:
        breathe()
        system = _System(problem, *here, scatter, blocks, white)
        now = system.objective(*here)
        if count == 0:
            first = cost = now
        change, events, expected = system.step(damping)
        if not above and now - expected < SETTLED:
            break
        trial = moved(here[0], change, events)
        there = problem.evaluate(trial)
        count += 1
        held = np.isfinite(there.residual).all() and trial.weights.sum() > 0.0
        then = system.objective(trial, there) if held else np.inf
        if then < cost:
            poor = poor + 1 if cost - then < SETTLED else 0
            if not above:
                share = (now - then) / (now - expected)
                damping = max(damping * (EASED if share > GOOD else STIFFENED if share < POOR else 1.0), LEAST)
            here, point, slopes, cost, above, failed = (trial, there), trial, there, then, False, 0
        elif np.isfinite(then) and not above:
            here, above = (trial, there), True
        else:
            here, above, failed, damping = (point, slopes), False, failed + 1, RAISED * damping
        if failed == FAILED or poor == 2:
            break
    return point, slopes, first - cost, count, damping


def at(problem: Problem, point: Point, scatter: Scatter, base: Fit) -> Fit:
    """A model at a point, with what is known of the noise as in another fit of the same data."""
    return _like(base, problem, point, problem.evaluate(point), scatter, 1)


def again(
    problem: Problem, point: Point, scatter: Scatter, dropped: NDArray[np.bool_], around: Point, evaluations: int
) -> Fit:
    """A fit that was made before, from where it ended; arguments as the attributes of :class:`Fit`."""
    blocks = Blocks.of(problem.of, problem.events)
    known = known_of(problem, around, problem.evaluate(around), blocks, dropped)
    return _found(problem, point, problem.evaluate(point), scatter, dropped, known, around, evaluations)


def _like(base: Fit, problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, evaluations: int) -> Fit:
    return _found(problem, point, slopes, scatter, base.dropped, base.known, base.around, evaluations)


def _found(
    problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, dropped: NDArray[np.bool_], known: Known,
    around: Point, evaluations: int,
) -> Fit:  # fmt: skip
    blocks = Blocks.of(problem.of, problem.events)
    return Fit(
        problem, point, slopes, scatter, dropped, known.with_local(blocks(slopes.local)), around, blocks,
        float(point.weights.sum()), evaluations,
    )  # fmt: skip


def deviations(found: Fit) -> Array:
    """Standard deviation of the residual at every point: noise and scatter (N), shape (p,)."""
    _, whole = covariance(found.scatter.sizes, found.known)
    sd = np.sqrt(np.diagonal(np.asarray(whole), axis1=1, axis2=2))
    out = np.zeros(found.problem.of.size)
    out[found.blocks.index[found.blocks.there]] = sd[found.blocks.there]
    return out
