"""Derivatives of every slip's time and size, on steps that move with the slips.

The error of a step depends on where in it the block arrests or begins to slip. A parameter that moves the events
against the steps (by seconds per unit of its logarithm) turns that ripple, however small, into a slope: the exact
derivative of a discrete solution then says nothing about the curve the solution follows. So the steps are tied to the
motion. Each cycle is cut where the spring has reached a fixed share of full strength, late in the stick, and where the
block all but rests; the first steps after a cut have fixed lengths, the last few are stretched by one factor so that
the next cut is met. What the parameters move is then the cuts, by the implicit function theorem, and hardly any step's
error.

What is left is a ripple: where in a step an element begins to slide. It is a function of the place in the step, so the
mean over a few grids, each shifted by the same share of its steps, is all but free of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...errors import SolveError
from ...physics.contact import Bank
from ...physics.model import Model, State
from .integrate import integrate
from .stepper import ContactStepper, Increments, Step
from .tolerance import Tolerance
from .trajectory import Trajectory, hermite

GRIDS = 4  # of shifted steps: more do not lessen the ripple further
STRETCHED = 8  # steps at the end of a piece that give way
NEWTON = 5  # iterations for their length; it is known to a few per cent before the first
LATE = 0.9  # of the stick's quiet part: where it is cut; the ringing is over, the slip has not begun
QUIET = 0.02  # of the drive's speed: what the block creeps with before a slip begins
GIVE = (0.1, 0.015)  # share of a stick's piece and of a slip's piece that is stretched
MET = 1e-6  # how near the cuts are met: share of full strength, or of the drive's speed
REST = 1e-3  # of the drive's speed: what the block has left at the cut of an arrest, so that it has not turned yet
LEAST_DROP = 0.01  # of full strength, by which a slip lowers the spring's force at least
EXACT = 1e-3  # of the tolerance: to this the steps' equations are solved, so that they are smooth functions


class Slips(NamedTuple):
    """Slips that are complete, shape (n,) each; derivatives have a leading axis of parameters.

    Fields:
        onset: the block begins to outrun the load point (s).
        arrest: it no longer does (s).
        slip: displacement between the two (m).
        peak_velocity: largest velocity (m/s).
        position: displacement at onset (m).
    """

    onset: Array
    arrest: Array
    slip: Array
    peak_velocity: Array
    position: Array


class Grid(NamedTuple):
    """Steps tied to the motion; (p,) pieces of up to n steps, sticks and slips in turn; several shifted grids at once
    have a leading axis.

    Fields:
        lengths: fixed steps at the start of each piece (s), shape (p, n).
        number: how many of them count, shape (p,).
        last: length of the stretched steps (s), shape (p,).
        level: share of full strength that the spring reaches at the end of a stick, shape (p,); nan for a slip.
    """

    lengths: Array
    number: Array
    last: Array
    level: Array


def slip_derivatives(
    build: Callable[[Array], Model],
    theta: Any,
    end: float,
    *,
    start: Callable[[Model], State] = Model.rest,
    tolerance: Tolerance | None = None,
    refine: int = 2,
    grids: int = GRIDS,
) -> tuple[Slips, Slips]:
    """Times and sizes of all slips and their derivatives in every parameter, for a drive of one velocity.

    What it costs is mostly compiling, some twenty seconds; the plain run and all derivatives take a few.

    Args:
        build: the model as a differentiable function of the parameters.
        theta: parameters, shape (p,).
        end: of the run (s).
        start: state at time zero, a function of the model.
        tolerance: of the run that the steps are taken from (default: a tenth of the solver's).
        refine: into how many each of them is divided. With both defaults the errors are below one per cent of what
            the largest of the parameters does; either makes them smaller.
        grids: of shifted steps, over which slips and derivatives are averaged.

    Returns:
        Slips, shape (n,), and their derivatives, shape (p, n).

    Raises:
        SolveError: no slip is complete within the run, the block does not come to rest after one, or the steps are too
            coarse to meet where it does.
    """
    tolerance = Tolerance(1e-5, 3e-13, 3e-9) if tolerance is None else tolerance
    theta = jnp.asarray(theta, float)
    model = build(theta)
    trajectory, _ = integrate(model, end, state=start(model), tolerance=tolerance)
    grid = slip_grid(model, trajectory, refine, grids)
    exact = jax.tree.map(lambda a: EXACT * a, tolerance)

    @jax.jit
    def derivatives(direction: Array) -> tuple[Slips, Slips]:
        def slips(theta: Array) -> Slips:
            model = build(theta)
            return mean_slips(model, start(model), grid, exact, refine)

        return jax.jvp(slips, (theta,), (direction,))

    values, columns = jax.vmap(derivatives)(jnp.eye(theta.size))
    if not np.isfinite(values.slip).all():
        raise SolveError("the steps are too coarse to meet an arrest; make the tolerance smaller or refine more")
    return Slips(*(a[0] for a in values)), columns


def slip_grid(model: Model, trajectory: Trajectory, refine: int = 1, grids: int = 1) -> Grid:
    """Steps of a run, cut at the slips; each divided into ``refine``. Arguments and errors as of `slip_derivatives`.

    With a leading axis of ``grids``, in each of which the steps begin at another share of those of the run.
    """
    s = trajectory.steps
    speed = np.gradient(np.asarray(jax.vmap(model.lead)(jnp.asarray(s.t))), s.t)
    strength = float(model.bank.total_strength)
    pull = np.sign(s.spring_force[np.argmax(np.abs(s.spring_force))])
    ahead = np.concatenate([[False], pull * (s.v - speed) > 0.0, [False]])
    edges = np.flatnonzero(ahead[1:] != ahead[:-1]).reshape(-1, 2)
    edges = edges[(edges[:, 0] > 0) & (edges[:, 1] < s.t.size)]
    fall = pull * (s.spring_force[edges[:, 0] - 1] - s.spring_force[edges[:, 1]])
    begin, bounds = float(s.t[0]), []
    for first, after in edges[fall > LEAST_DROP * strength]:
        stop = after + int(np.argmax(pull * s.v[after:] <= 0.0))
        if pull * s.v[stop] > 0.0:
            raise SolveError("the block does not come to rest after its last slip; end the run later, or drive slower")
        rest = float(np.interp(0.0, -pull * s.v[stop - 1 : stop + 1], s.t[stop - 1 : stop + 1]))
        slow = (s.t < s.t[first]) & (s.t > begin) & (pull * s.v < QUIET * pull * speed[first])
        if not slow.any():
            raise SolveError("the block never creeps slowly before a slip; drive slower")
        cut = begin + LATE * (float(s.t[slow][-1]) - begin)
        level = float(np.interp(cut, s.t, s.spring_force)) / strength
        bounds += [(begin, cut, GIVE[0], level), (cut, rest, GIVE[1], np.nan)]
        begin = rest
    if not bounds:
        raise SolveError("no slip is complete within the run; end it later")
    shares = np.arange(grids) / grids
    pieces = [[(*_cut(s.t, *b[:3], refine, share), b[3]) for b in bounds] for share in shares]
    most = max(len(steps) for grid in pieces for steps, _, _ in grid)
    return Grid(
        jnp.asarray([[np.pad(a, (0, most - len(a)), constant_values=1e-6) for a, _, _ in grid] for grid in pieces]),
        jnp.asarray([[len(a) for a, _, _ in grid] for grid in pieces]),
        jnp.asarray([[last for _, last, _ in grid] for grid in pieces]),
        jnp.asarray([[level for _, _, level in grid] for grid in pieces]),
    )


def _cut(t: np.ndarray, begin: float, end: float, give: float, refine: int, share: float) -> tuple[np.ndarray, float]:
    """Fixed steps from ``begin`` on, and the length of those that are stretched to reach ``end``.

    Each node of the divided steps is moved on by ``share`` of the step that follows it.
    """
    last = end - give * (end - begin)
    nodes = np.concatenate([[begin], t[(t > begin) & (t < last)]])
    number = np.arange((nodes.size - 1) * refine + 1)
    nodes = np.interp(number / refine, np.arange(nodes.size), nodes)
    moved = nodes[:-1] + share * np.diff(nodes)
    nodes = nodes if share == 0.0 else np.concatenate([[begin], moved])
    return np.diff(nodes), (end - nodes[-1]) / (STRETCHED * refine)


def mean_slips(model: Model, state: State, grids: Grid, tolerance: Tolerance, refine: int = 1) -> Slips:
    """The mean of :func:`slips_on` over several grids."""
    found = jax.lax.map(lambda grid: slips_on(model, state, grid, tolerance, refine), grids)
    return Slips(*(jnp.mean(a, axis=0) for a in found))


class _Seen(NamedTuple):
    """A state on the way, and what of the piece's slip has been seen."""

    y: State
    acceleration: Array
    t: Array
    onset: Array
    position: Array
    arrest: Array
    end: Array
    peak: Array


def slips_on(model: Model, state: State, grid: Grid, tolerance: Tolerance, refine: int = 1) -> Slips:
    """All slips of a model on the steps of a grid, as a differentiable function of model and state (forward mode)."""
    bank, stepper = model.shaped(), ContactStepper(tolerance)
    acceleration = stepper.func(_TERM, jnp.zeros(()), state, (model, bank)).v
    constant = jax.lax.stop_gradient
    zero = jnp.zeros(())

    def piece(carry: tuple, item: Grid) -> tuple[tuple, Slips]:
        y, acceleration, t = carry
        seen = _Seen(y, acceleration, t, zero, zero, zero, zero, zero)
        seen = jax.lax.fori_loop(0, item.number, lambda i, c: _step(model, bank, stepper, c, item.lengths[i]), seen)

        def landed(model: Model, bank: Bank, seen: _Seen, h: Array) -> tuple[_Seen, Array]:
            seen = jax.lax.fori_loop(0, STRETCHED * refine, lambda i, c: _step(model, bank, stepper, c, h), seen)
            lead = model.lead(seen.t)
            share = model.pull(lead - seen.y.x) / model.bank.total_strength
            speed = (lead - model.lead(seen.t - h)) / h
            return seen, jnp.where(jnp.isnan(item.level), seen.y.v / speed - REST, share - item.level)

        frozen = constant((model, bank, seen))

        def newton(_: int, carry: tuple) -> tuple:
            h = carry[0]
            (_, gap), (change, slope) = jax.jvp(lambda h: landed(*frozen, h), (h,), (jnp.ones(()),))
            return jnp.clip(h - gap / slope, 0.5 * h, 2.0 * h), change, slope

        h, change, slope = newton(0, (item.last,))
        h, change, slope = constant(jax.lax.fori_loop(1, NEWTON, newton, (h, change, slope)))
        end, gap = landed(model, bank, seen, h)
        # the length follows the gap by the implicit function theorem; the gap itself is zero
        more = -(gap - constant(gap)) / slope
        end = jax.tree.map(lambda a, b: a + b * more, end, change)
        missed = jnp.where(abs(gap) < MET, 0.0, jnp.nan)  # a cut that was not met says nothing
        found = Slips(end.onset, end.arrest, end.end - end.position + missed, end.peak, end.position)
        return (end.y, end.acceleration, end.t), found

    _, found = jax.lax.scan(piece, (state, acceleration, zero), grid)
    return Slips(*(a[1::2] for a in found))


def _step(model: Model, bank: Bank, stepper: ContactStepper, seen: _Seen, h: Array) -> _Seen:
    """One step, and the onset, arrest and peak that lie in it (cubic in velocity and displacement)."""
    y0, a0, t = seen.y, seen.acceleration, seen.t
    y1, _, _, solver, _ = stepper.step(_TERM, t, t + h, y0, (model, bank), Step(a0, jnp.zeros((), bool)), False)
    a1 = solver.acceleration
    level = (model.lead(t + h) - model.lead(t)) / h
    sign = jnp.where(level < 0.0, -1.0, 1.0)

    def velocity(s: Array) -> Array:
        bend = h * s * (1.0 - s) * ((1.0 - s) * a0 - s * a1)
        return y0.v + s * s * (3.0 - 2.0 * s) * (y1.v - y0.v) + bend

    before, after = sign * (y0.v - level), sign * (y1.v - level)
    crosses = (before <= 0.0) != (after <= 0.0)
    s = jnp.where(crosses, before / jnp.where(crosses, before - after, 1.0), 0.5)
    for _ in range(4):
        value, slope = jax.jvp(velocity, (s,), (jnp.ones(()),))
        s = jnp.where(crosses, s - (value - level) / jnp.where(crosses, slope, 1.0), 0.5)
    x = y0.x + hermite(s, h, y1.x - y0.x, y0.v, y1.v)
    rises, falls = crosses & (after > 0.0), crosses & (after <= 0.0)
    turns = (sign * a0 > 0.0) & (sign * a1 <= 0.0)
    top = sign * velocity(jnp.where(turns, a0 / jnp.where(turns, a0 - a1, 1.0), 1.0))
    return _Seen(
        y1,
        a1,
        t + h,
        onset=jnp.where(rises, t + s * h, seen.onset),
        position=jnp.where(rises, x, seen.position),
        arrest=jnp.where(falls, t + s * h, seen.arrest),
        end=jnp.where(falls, x, seen.end),
        peak=jnp.maximum(seen.peak, top),
    )


_TERM = Increments()
