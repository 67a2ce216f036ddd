"""What the covariance of the residual force is made of: noise of the readings carried to a force, and outliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, dia_array

from ...physics.sensor.chain import FRINGE
from .problem import Point, Problem, Slopes
from .scatter import Blocks, Known, Scatter, weigh

Array = NDArray[np.float64]
FAR = 5.0  # standard deviations from what the rest of an event lets expect, from which a point is left out


def beyond(known: Known, scatter: Scatter, marginal: Array, blocks: Blocks, size: int) -> NDArray[np.bool_]:
    """Points that what else is known of their event would not let expect, shape (p,)."""
    found = weigh(scatter.sizes, marginal, known)
    z = found.weighted / np.sqrt(np.diagonal(found.inverted, axis1=1, axis2=2))
    out = np.zeros(size, bool)
    out[blocks.index[blocks.there]] = np.abs(z[blocks.there]) > FAR
    return out


def known_of(problem: Problem, point: Point, slopes: Slopes, blocks: Blocks, dropped: NDArray[np.bool_]) -> Known:
    """What the covariance is made of, at a point."""
    strength = float(point.weights.sum())
    carried = by_reading(problem, point, slopes)
    return Known(
        noise(problem, carried, blocks), periodic(problem, carried, blocks),
        blocks(np.where(dropped, strength**2, 0.0)), blocks(slopes.local), blocks(problem.phase),
        blocks(slopes.spring), blocks(slopes.tangent), blocks(problem.place), blocks(problem.elapsed),
        problem.lasting, problem.begins, blocks.there, strength,
    )  # fmt: skip


def by_reading(problem: Problem, point: Point, slopes: Slopes) -> list[csr_array]:
    """Of every run, what an error of the samples does to the force (N/m), shape (p, N).

    A sample that is off by e changes the force of springs and contact by k e, that of inertia by m e'': together, so
    that near the resonance of the contact, where the one nearly undoes the other, little noise is left. An element that
    sticks counts from where it last slid, and holds the error of that reading until it slides again.
    """
    values = problem.values(point)
    elements = point.weights / problem.composition.reach
    out = []
    for run, stiffness, slides in zip(problem.runs, slopes.sticking, slopes.slides, strict=True):
        rate, acceleration = run.moving
        spring = values.get("rig.spring_stiffness", 0.0) if run.stiffness is None else run.stiffness
        stiff = dia_array((stiffness + spring, 0), shape=(stiffness.size, stiffness.size))
        since = remembered(elements, stiffness, slides)
        out.append(
            run.mean @ ((stiff - since) @ run.reading)
            + values["rig.damping"] * rate
            + values["rig.mass"] * acceleration
        )
    return out


def noise(problem: Problem, carried: Sequence[csr_array], blocks: Blocks) -> Array:
    """Covariance of the residual force (N^2) by the noise of single samples, event by event, shape (E, n, n)."""
    event, place = np.zeros(problem.of.size, int), np.zeros(problem.of.size, int)
    e, i = np.nonzero(blocks.there)
    event[blocks.index[e, i]], place[blocks.index[e, i]] = e, i
    out = np.zeros((*blocks.there.shape, blocks.there.shape[1]))
    first = 0
    for run, rows in zip(problem.runs, carried, strict=True):
        own = slice(first, first + run.at.size)
        pairs = (rows @ rows.T).tocoo()
        i, j = pairs.coords
        together = event[own][i] == event[own][j]
        i, j = i[together], j[together]
        out[event[own][i], place[own][i], place[own][j]] = run.noise**2 * pairs.data[together]
        first += run.at.size
    return out


def periodic(problem: Problem, carried: Sequence[csr_array], blocks: Blocks) -> Array:
    """Covariance (N^2) by errors of the reading of 1 m that are periodic within a fringe, shape (E, n, n).

    A fringe counter interpolates between fringes with an error periodic in half a wavelength, and about half as large
    in a quarter of it. Its phase is an event's own: a slow walk of the reading turns it.
    """
    columns = []
    for run, rows in zip(problem.runs, carried, strict=True):
        phase = 2.0 * np.pi * run.samples / FRINGE
        waves = [np.sin(phase), np.cos(phase), 0.5 * np.sin(2.0 * phase), 0.5 * np.cos(2.0 * phase)]
        columns.append(rows @ np.stack(waves, axis=1))
    side = blocks(np.concatenate(columns))
    return np.asarray(side @ np.swapaxes(side, 1, 2))


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
