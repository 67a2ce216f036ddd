"""Gauss-Newton with exact derivatives; random effects and misfit within events in the likelihood."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...errors import FitError
from ...system.progress import breathe, portion
from ..fit.parameters import Free
from .bank import placed
from .descent import DAMPING, descend
from .jumps import jumping
from .level_within_events import with_level
from .linearised import FARTHEST, Array, Linearised, moved
from .linked_events import WALK, grown
from .noise import FAR, bands, beyond, by_reading, carrier, known_of, left_out, reading_errors
from .point import Forces, Point, Slopes
from .problem import Problem
from .scatter import (
    PARTS,
    WANDER,
    Blocks,
    Follows,
    Known,
    Scatter,
    covariance,
    estimate,
    misfit,
)
from .whitening import Whitening, WithEvents

PLACED = 2  # rounds after which the bank's elements are put where the strength is
ROUNDS = 10  # times that the scatter is estimated anew
LAST = 30  # evaluations with the covariance as it was found
STEPS = 4  # evaluations between
NEWTON = 4  # steps of the sizes between
FIRST = 0.6  # share of the rounds of a fit that begins in what it takes, at most
MOST_JUMPS = 4  # of the reading in a campaign: they are rare
ADJUSTED = 0.8  # share of a base fit before the motion is adjusted
FEWEST = 12  # events from which on it is asked whether their strengths follow each other
DISTINCT = 6.0  # of the cost, by which distinguishable coordinates differ at least: a likelihood ratio of twenty
LARGER = 1.0  # e-folds by which sizes are assumed larger where a search may have ended in a local minimum


@dataclass(frozen=True)
class Fit:
    """An optimum.

    Attributes:
        problem, point: what was fitted, and where.
        forces: residuals there.
        scatter: sizes of what is random.
        dropped: points left out, for they lie beyond what else is random (a jump of the sensor), shape (p,).
        known: what the covariance is made of.
        around: where the noise of the readings was carried to a force.
        strength: force of the contact at full strength (N).
        evaluations: of the model.
        valleys: changes of all that is shared, one standard deviation each, that the derivatives do not show (see
            :mod:`.profile_deviations`).
    """

    problem: Problem
    point: Point
    forces: Forces
    scatter: Scatter
    dropped: NDArray[np.bool_]
    known: Known
    around: Point
    strength: float
    evaluations: int
    valleys: tuple[Array, ...] = ()

    @property
    def blocks(self) -> Blocks:
        """Points by event."""
        return self.problem.blocks

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in vars(self).items() if name != "_system"}  # large, and soon found again

    @cached_property
    def slopes(self) -> Slopes:
        """Forces with all their derivatives: found when asked for where a hand moved the model."""
        return self.forces if isinstance(self.forces, Slopes) else self.problem.evaluate(self.point)

    @cached_property
    def _system(self) -> Linearised:
        """Found when asked for: a model that a hand moves is drawn, and judged when it stands still."""
        white = Whitening(self.scatter.sizes, self.known)
        return Linearised(self.problem, self.point, self.slopes, self.scatter, white)

    @property
    def white(self) -> WithEvents:
        """Whitens residuals of its events, what is their own marginalised."""
        return self._system.white

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
            parameter or the strength further than a step of a fit goes.
        """
        change, events, _ = self._system.alone(forces).step(DAMPING, np.inf)
        far = float(np.abs(change[: self.point.z.size]).max(initial=0.0))
        first, whole = self.point.z.size + self.point.phases.size, self.point.weights.sum()
        lost = -float(change[first : first + self.point.weights.size].sum()) / whole
        far = max(far, FARTHEST * lost / -np.expm1(-FARTHEST))  # of the strength no more than a step may take
        share = min(1.0, FARTHEST / far) if far > 0.0 else 1.0
        return moved(self.point, share * change, self.point.events + share * events), share

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
    def chi_square(self) -> float:
        """Sum of the squared residuals, whitened by the covariance of noise, misfit and events."""
        return float((self._system.rest**2).sum())

    @property
    def effective_parameters(self) -> float:
        """Parameters that the data determine, priors and bounds taken off: the trace of the smoother matrix."""
        return self._system.effective_parameters(self._judged[2])

    @property
    def cost(self) -> float:
        """Twice the negative logarithm of likelihood and priors, those of the sizes of what is random included."""
        return float(self.likelihood.sum()) + self.prior + self.known.prior(self.scatter.sizes)

    @property
    def residual(self) -> Array:
        """Residual force with every event at its own best strength, stretch and offset (N), shape (p,)."""
        return self.forces.residual

    @property
    def marginal(self) -> Array:
        """Residual force with all events equal (N), shape (p,)."""
        return self.forces.residual - (self.forces.local * self.point.events[self.problem.of]).sum(axis=1)

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
    blocks = problem.blocks
    sizes = Scatter.wide() if scatter is None else scatter
    out = np.zeros(problem.of.size, bool) if dropped is None else dropped
    slopes = problem.evaluate(point)
    evaluations, damping = 1, DAMPING
    if not slopes.finite:
        raise FitError("the model gives no finite force along the motion")
    for turn in range(rounds):
        breathe(FIRST * turn / rounds)
        if scatter is None and turn == PLACED:
            problem, point = placed(problem, point)
            slopes = problem.evaluate(point)
        rows = by_reading(problem, point, slopes)
        problem = problem.carried_by(carrier(problem, slopes, rows))
        slopes = problem.recarried(slopes, point)
        made = known_of(problem, slopes, rows, out, sizes.follows)
        if turn or first:
            marginal = blocks(slopes.residual) - np.einsum("eia,ea->ei", made.local, point.events)
            sizes = estimate(sizes, marginal, made, NEWTON)
            more = beyond(problem, made, sizes, marginal) & ~out
            if dropped is None and more.any():
                out = out | more
                made = made.without(blocks(left_out(problem, out)))
                sizes = estimate(sizes, marginal, made, NEWTON)
        problem, slopes = with_level(problem, point, slopes, sizes, made)
        point, slopes, total, count, damping = descend(problem, point, slopes, sizes, made, steps, damping)
        evaluations += count
        if turn > PLACED + 2 and total < 1.0:
            break
    made = known_of(problem, slopes, by_reading(problem, point, slopes), out, sizes.follows)
    around, carried = point, slopes
    point, slopes, _, count, _ = descend(problem, point, slopes, sizes, made, LAST)
    if slopes is carried:  # which is rounded otherwise than what is evaluated where a stored fit is read
        slopes = problem.evaluate(point)
    with portion(FIRST, 1.0):
        return _arrived(adapted(_found(problem, point, slopes, sizes, out, made, around, evaluations + count)))


def _arrived(found: Fit) -> Fit:
    """The better of a fit and of one that goes on from it with all that is random assumed larger than it is.

    Where an element begins to slide the force has a kink, and the floor of the valley is rough: in one of its dents the
    search may stand still before it has arrived, and then every law that is added gains by leaving it.
    """
    with suppress(FitError):
        other = adapted(refit(found.problem, found.point, replace(found, scatter=found.scatter.larger(LARGER))))
        return replace(min(found, other, key=lambda f: f.cost), evaluations=found.evaluations + other.evaluations)
    return found


def fit_base(problem: Problem, point: Point) -> Fit:
    """The optimum of a base model along the motion that it makes most likely; arguments and errors as of :func:`fit`.

    What the noise of the readings did to the forces tells most of that noise. Without it in the motion derivatives are
    those of the adjusted observations, as a model with errors in its variables needs them (Pope 1972; Lenzmann &
    Lenzmann 2004): damping and healing, and laws of the velocity, are biased otherwise.
    """
    with portion(0.0, ADJUSTED):
        found = fit(problem, point)
    rows = by_reading(found.problem, found.around, found.slopes)
    weighted = np.zeros(found.problem.at.size)
    there = found.blocks.there
    weighted[found.blocks.index[there]] = found.white.weighted(found.blocks(found.marginal))[there]
    errors = reading_errors(found.problem, rows, weighted, found.scatter.named()["white"])
    problem = found.problem.adjusted(errors, found.point)
    found = again(problem, found.point, found.scatter, found.dropped, found.around, found.evaluations)
    with portion(ADJUSTED, 0.9):
        other = adapted(refit(problem, found.point, found))
    for tried in range(MOST_JUMPS):
        if (event := jumping(other._system)) is None:
            break
        with portion(*(0.9 + 0.08 * np.array([tried, tried + 1]) / MOST_JUMPS)):
            after = _jumped(other, event)
        if other.cost - after.cost < FAR**2:
            break
        other = after
    with portion(0.98, 1.0):
        other = wandering(other)
    if not any(run.prescribed for run in problem.runs):
        rows = by_reading(other.problem, other.around, other.problem.evaluate(other.around))
        frequencies = bands(other.problem, rows, other.scatter, other.known)
        other = replace(other, problem=other.problem.in_bands(frequencies))
    return replace(other, evaluations=found.evaluations + other.evaluations)


def _jumped(found: Fit, event: int) -> Fit:
    """The fit with a reading that jumps before an event."""
    problem = found.problem.with_jumps((*found.problem.jumps, event))
    point, around = (replace(p, common=np.append(p.common, 0.0)) for p in (found.point, found.around))
    same = again(problem, point, found.scatter, found.dropped, around, found.evaluations)
    return adapted(refit(problem, point, same))


def refit(problem: Problem, point: Point, base: Fit, last: int = LAST) -> Fit:
    """Another model of the same data from a point, in at most ``last`` evaluations.

    With the covariance of ``base`` as it is: else the costs of the two could not be compared.

    Raises:
        FitError: the model gives no finite force at the start.
    """
    slopes = problem.evaluate(point)
    if not slopes.finite or not point.weights.sum() > 0.0:
        raise FitError("the model gives no finite force along the motion")
    point, slopes, _, count, _ = descend(problem, point, slopes, base.scatter, base.known, last)
    return _like(base, problem, point, slopes, base.scatter, count + 1)


def adapted(found: Fit, rounds: int = ROUNDS, steps: int = STEPS) -> Fit:
    """A refit with sizes of its own of what is random; what carries the noise to a force stays that of its base.

    Under the sizes of a model that lacks an effect, events look as scattered as the effect makes them, and laws that
    describe it well or badly look equally good.

    Args:
        found: where to go on from.
        rounds: of the search, before each of which the sizes are estimated anew; with none they are estimated only.
        steps: evaluations in a round.
    """
    problem, blocks = found.problem, found.blocks
    point, slopes, sizes, evaluations = found.point, found.slopes, found.scatter, found.evaluations
    damping = DAMPING
    for turn in range(rounds + 1):
        breathe(turn / (rounds + 1))
        known = found.known.with_local(blocks(slopes.local))
        marginal = blocks(slopes.residual) - np.einsum("eia,ea->ei", known.local, point.events)
        before = misfit(sizes.sizes, marginal, known)
        sizes = estimate(sizes, marginal, known, NEWTON)
        fallen = before - misfit(sizes.sizes, marginal, known)
        if turn == rounds:
            break
        problem, slopes = with_level(problem, point, slopes, sizes, known)
        point, slopes, total, count, damping = descend(problem, point, slopes, sizes, known, steps, damping)
        evaluations += count
        if fallen + total < 1.0:
            break
    return _like(found, problem, point, slopes, sizes, evaluations)


def wandering(found: Fit) -> Fit:
    """The fit with strengths of events that follow each other, if that pays; else the same.

    Of the coordinates along which a level may wander the one under which the events, with the parameters as they are,
    are most likely. Where a level pays that may be that of static or of sliding friction alone, of which both are
    asked along every coordinate; it is that of both where neither is clearly likelier.
    """
    problem, tried = found.problem, {}
    along = problem.along if problem.events >= FEWEST else ()
    forces = problem.evaluate(found.around) if along else found.forces  # as of a fit that is read back
    for of in PARTS:
        for coordinate in along:
            follows = Follows(coordinate, problem.distance(coordinate), of=of)
            chain = problem.chain(follows, forces)
            assert chain is not None
            start = replace(found, scatter=found.scatter.following(follows), known=found.known.following(chain))
            tried[coordinate, of] = adapted(start, rounds=0)
        # the first is that of both: Schwarz's criterion
        least = min((f.cost for f in tried.values()), default=np.inf)
        if found.cost - least < len(WANDER) * np.log(problem.events):
            return found
    coordinate, of = min(tried, key=lambda key: tried[key].cost - DISTINCT * (key[1] == "both"))
    best = tried[coordinate, of]
    assert best.scatter.follows is not None
    others = tuple(name for name in along if name != coordinate and tried[name, of].cost - best.cost < DISTINCT)
    own = replace(best.scatter, follows=replace(best.scatter.follows, equally_likely=others))
    best = replace(best, scatter=own)
    best = _arrived(adapted(refit(problem, best.point, best)))
    return replace(best, evaluations=found.evaluations + best.evaluations)


def independent(found: Fit) -> Fit:
    """The fit with strengths of events that do not follow each other."""
    own = replace(found, scatter=found.scatter.independent(), known=found.known.following(None))
    return adapted(refit(found.problem.with_beyond(np.zeros_like(found.problem.beyond)), found.point, own))


def at(problem: Problem, point: Point, scatter: Scatter, base: Fit) -> Fit:
    """A model at a point, with what is known of the noise as in another fit of the same data."""
    return _like(base, problem, point, problem.forces(point), scatter, 1)


def again(
    problem: Problem, point: Point, scatter: Scatter, dropped: NDArray[np.bool_], around: Point, evaluations: int
) -> Fit:
    """A fit that was made before, from where it ended; arguments as the attributes of :class:`Fit`."""
    slopes = problem.evaluate(around)
    known = known_of(problem, slopes, by_reading(problem, around, slopes), dropped, scatter.follows)
    return _found(problem, point, problem.evaluate(point), scatter, dropped, known, around, evaluations)


def _like(base: Fit, problem: Problem, point: Point, forces: Forces, scatter: Scatter, evaluations: int) -> Fit:
    return _found(problem, point, forces, scatter, base.dropped, base.known, base.around, evaluations)


def _found(
    problem: Problem, point: Point, forces: Forces, scatter: Scatter, dropped: NDArray[np.bool_], known: Known,
    around: Point, evaluations: int,
) -> Fit:  # fmt: skip
    return Fit(
        problem, point, forces, scatter, dropped, known.with_local(problem.blocks(forces.local)), around,
        float(point.weights.sum()), evaluations,
    )  # fmt: skip


def deviations(found: Fit) -> Array:
    """Standard deviation of the residual at every point: noise and scatter (N), shape (p,)."""
    sizes, known = found.scatter.sizes, found.known
    before, after = (v[:, None] for v in grown(known.spread(sizes), known.first))
    (first, second), (_, whole) = np.moveaxis(known.nodes, 2, 0), covariance(sizes, known)
    walked = first * (first + 2.0 * second) * before + second**2 * after  # the later node goes on from the earlier
    level = 0.0
    if (levels := known.levels(sizes)) is not None:
        loads = known.loads[..., WALK:]
        level = np.einsum("eik,ekl,eil->ei", loads, levels.of_events(), loads)
    sd = np.sqrt(np.diagonal(whole, axis1=1, axis2=2) + walked + level)
    out = np.zeros(found.problem.of.size)
    out[found.blocks.index[found.blocks.there]] = sd[found.blocks.there]
    return out
