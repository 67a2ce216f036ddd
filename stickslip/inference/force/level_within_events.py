"""What a level of the caps that wanders does within an event beyond what the likelihood has of it.

The likelihood is linear in the level, and what sticks has the level of its arrest (:mod:`.linked_events`). Where
friction wanders by a per cent this is off by a few ten-thousandths of the strength, as much as all else that is random,
and a wave of the place would take it up. So the model is driven once with the most likely course of the level, and what
its forces differ by from the linear ones is added to the residuals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .linearised import Array
from .linked_events import WALK
from .point import Forces, Point, Slopes
from .problem import Problem, coordinate, part_of
from .scatter import Follows, Known, Scatter
from .whitening import Whitening


def with_level(
    problem: Problem, point: Point, slopes: Slopes, scatter: Scatter, known: Known
) -> tuple[Problem, Slopes]:
    """The problem with the most likely course of the level at a point, and what :meth:`Problem.evaluate` says there.

    Args:
        problem, point, slopes: where.
        scatter, known: sizes of what is random, and what the covariance is made of.
    """
    if scatter.follows is None or known.chain is None:
        return problem, slopes
    own = known.with_local(problem.blocks(slopes.local))
    states = _states(problem, point, slopes, scatter, own)
    with np.errstate(over="ignore", invalid="ignore"):
        beyond = _beyond(problem, point, slopes, scatter.follows, own, states)
    if not np.isfinite(beyond).all():  # of a model so far off that its level would be none
        return problem, slopes
    return problem.with_beyond(beyond), replace(slopes, residual=slopes.residual - problem.beyond + beyond)


def _states(problem: Problem, point: Point, forces: Forces, scatter: Scatter, known: Known) -> Array:
    """Values and slopes of the level (e-folds) at both ends of every event, shape (E, 4)."""
    white = Whitening(scatter.sizes, known).with_events(known.local)
    marginal = problem.blocks(forces.residual) - np.einsum("eia,ea->ei", known.local, point.events)
    return np.asarray(-white.stands(marginal)[:, WALK:])


def _beyond(
    problem: Problem, point: Point, slopes: Slopes, follows: Follows, known: Known, states: Array
) -> Array:  # fmt: skip
    """Residual along the course of the level less that of first order (N), shape (p,)."""
    chain, blocks = known.chain, problem.blocks
    assert chain is not None
    mean = (chain.mean * states).sum(axis=1)
    courses = []
    for first, run, error, rested in zip(problem.first, problem.runs, problem.errors, slopes.rested, strict=True):
        there = (run.event >= 0) & (run.event < run.events)
        e = first + np.where(there, run.event, 0)
        whole = chain.end[e] - chain.begin[e]
        way = coordinate(replace(run, x=run.x + error), follows.coordinate)  # the chain is of the motion as it was read
        share = (way - chain.begin[e]) / np.where(whole == 0.0, 1.0, whole)
        course = chain.course(np.clip(share, 0.0, 1.0), e, states)
        part = part_of(follows.of, rested)
        with np.errstate(divide="ignore"):  # the logarithm of 1 - part + part exp(course)
            caps = np.logaddexp(np.log1p(-part), np.log(part) + course)
        courses.append(np.where(there, caps - mean[e], 0.0))
    first_order = np.einsum("eik,ek->ei", chain.loads(known.caps), states) - known.caps * mean[:, None]
    along = problem.with_courses(courses).evaluate(point).residual
    out = along - (slopes.residual - problem.beyond)
    out[blocks.index[blocks.there]] -= first_order[blocks.there]
    return out
