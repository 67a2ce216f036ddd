"""What the covariance of the residual force is made of: noise of the readings carried to a force, and outliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, dia_array, diags_array

from .knots import PHASES
from .point import Point, Slopes
from .problem import Problem
from .scatter import Follows, Known, Scatter, covariance, weigh

Array = NDArray[np.float64]
FORGOTTEN = 4.0  # e-folds after which the weakening remembers nothing of the path
FAR = 5.0  # standard deviations from what the rest of an event lets expect, from which a point is left out


def beyond(problem: Problem, known: Known, scatter: Scatter, marginal: Array) -> NDArray[np.bool_]:
    """Points that what else is known of their event would not let expect, shape (p,)."""
    found = weigh(scatter.sizes, marginal, known)
    z = found.weighted / np.sqrt(np.diagonal(found.inverted, axis1=1, axis2=2))
    out, blocks = np.zeros(problem.of.size, bool), problem.blocks
    out[blocks.index[blocks.there]] = np.abs(z[blocks.there]) > FAR
    return out


def known_of(
    problem: Problem, slopes: Slopes, rows: Sequence[csr_array], dropped: NDArray[np.bool_],
    follows: Follows | None = None,
) -> Known:  # fmt: skip
    """What the covariance is made of, at a point; ``rows`` of :func:`by_reading`."""
    blocks = problem.blocks
    strength = problem.composition.nominal[0]  # not the model's: a weaker contact would have a smaller misfit allowed
    return Known(
        noise(problem, rows), periodic(problem, rows),
        blocks(left_out(problem, dropped)), blocks(slopes.local), blocks(problem.phase),
        blocks(slopes.spring), blocks(slopes.tangent), blocks(problem.place), blocks(problem.elapsed),
        problem.lasting, problem.begins, blocks.there, strength, problem.walk, problem.chain(follows, slopes),
    )  # fmt: skip


def left_out(problem: Problem, dropped: NDArray[np.bool_]) -> Array:
    """Variance (N^2) that takes the weight of points that are left out, shape (p,)."""
    return np.where(dropped, problem.composition.nominal[0] ** 2, 0.0)


def by_reading(problem: Problem, point: Point, slopes: Slopes) -> list[csr_array]:
    """Of every run, what an error of one sample of each group does to the force (N/m), shape (p, g).

    A sample that is off by e changes the force of springs and contact by k e, that of inertia by m e'': together, so
    that near the resonance of the contact, where the one nearly undoes the other, little noise is left. An element that
    sticks counts from where it last slid (or the record began), and holds that reading's error.
    """
    values = problem.values(point)
    elements = point.weights / problem.composition.reach
    out = []
    weakening = 1.0 - values["weakening.drop"], values["weakening.slip_distance"], values["weakening.healing_time"]
    for r, (run, stiffness) in enumerate(zip(problem.runs, slopes.sticking, strict=True)):
        spring = values.get("rig.spring_stiffness", 0.0) if run.stiffness is None else run.stiffness
        stiff = dia_array((stiffness + spring, 0), shape=(stiffness.size, stiffness.size))
        since = remembered(elements, stiffness, slopes.slides[r])
        slid = weakened(run.t, run.x, slopes.sliding[r], slopes.psi[r], *weakening)
        out.append(
            (run.mean @ (stiff - since + slid)) @ run.reading.displacement
            + values["rig.damping"] * run.reading.rate
            + values["rig.mass"] * run.reading.acceleration
        )
    return out


def carrier(problem: Problem, slopes: Slopes, rows: Sequence[csr_array]) -> Array:
    """What carries what is found with the model besides its parameters (see :meth:`.problem.Problem.carried_by`)."""
    hum = np.concatenate([row @ run.hum for run, row in zip(problem.runs, rows, strict=True)])
    return np.column_stack([slopes.tangent, hum, slopes.local[:, 0]])


def noise(problem: Problem, carried: Sequence[csr_array]) -> Array:
    """Covariance of the residual force (N^2) by the noise of single samples, event by event, shape (E, n, n)."""
    event, place = np.zeros(problem.of.size, int), np.zeros(problem.of.size, int)
    blocks = problem.blocks
    e, i = np.nonzero(blocks.there)
    event[blocks.index[e, i]], place[blocks.index[e, i]] = e, i
    out = np.zeros((*blocks.there.shape, blocks.there.shape[1]))
    first = 0
    for run, rows in zip(problem.runs, carried, strict=True):
        own = slice(first, first + run.at.size)
        scaled = rows @ dia_array((np.sqrt(run.reading.variance), 0), shape=(rows.shape[1],) * 2)
        pairs = (scaled @ scaled.T).tocoo()
        i, j = pairs.coords
        together = event[own][i] == event[own][j]
        i, j = i[together], j[together]
        out[event[own][i], place[own][i], place[own][j]] = run.noise**2 * pairs.data[together]
        out[event[own], place[own], place[own]] += run.force_noise
        first += run.at.size
    return out


def reading_errors(problem: Problem, rows: Sequence[csr_array], weighted: Array, white: float) -> list[Array]:
    """Most likely error of the displacement at the knots of every run by the noise of its samples (m), shape (n,).

    Args:
        rows: of :func:`by_reading`.
        weighted: inverse covariance times the residuals (1/N), shape (p,).
        white: noise of the samples over what is stated of it.
    """
    out, first = [], 0
    for run, row in zip(problem.runs, rows, strict=True):
        own = slice(first, first + run.at.size)
        samples = -((white * run.noise) ** 2) * run.reading.variance * (row.T @ weighted[own])
        out.append(run.reading.displacement @ samples)
        first += run.at.size
    return out


def periodic(problem: Problem, carried: Sequence[csr_array]) -> Array:
    """Covariance (N^2) by errors of the reading of 1 m that are periodic within a fringe, shape (E, n, n).

    Their phase is an event's own: a slow walk of the reading turns it.
    """
    columns = [rows @ run.reading.fringe for run, rows in zip(problem.runs, carried, strict=True)]
    side = problem.blocks(np.concatenate(columns))
    return np.asarray(side @ np.swapaxes(side, 1, 2))


def remembered(elements: Array, stiffness: Array, slides: NDArray[np.bool_]) -> csr_array:
    """By how much the force at a knot falls for an error of the reading at an earlier one (N/m), shape (n, n).

    Args:
        elements: stiffness of every element (N/m), shape (k,).
        stiffness: of all that stick at the knots, events by themselves (N/m), shape (n,).
        slides: whether an element slides at a knot, shape (n, k).
    """
    n = len(slides)
    last = np.maximum.accumulate(np.where(slides, np.arange(n)[:, None], 0), axis=0)
    at, element = np.nonzero(~slides)
    plain = ~slides @ elements
    own = np.divide(stiffness, plain, out=np.ones(n), where=plain > 0.0)
    return coo_array((elements[element] * own[at], (at, last[at, element])), shape=(n, n)).tocsr()


def weakened(t: Array, x: Array, sliding: Array, psi: Array, ratio: float, reach: float, time: float) -> csr_array:
    """What an error of the reading at a knot does, by the path, to the force of what slides (N/m), shape (n, n).

    The path takes strength away, and healing forgets it: ``psi' = (1 - psi)/time - |x'| psi/reach``.

    Args:
        t, x: of the knots (s, m), shape (n,).
        sliding: force of the elements that slide (N), shape (n,).
        psi: state of the weakening, shape (n,).
        ratio, reach, time: kinetic over static friction, slip distance (m) and healing time (s).
    """
    dt, dx = np.diff(t), np.diff(x)
    lost = dt / time + np.abs(dx) / reach
    kept = np.exp(-lost)
    healed = dt / time * (1.0 - (1.0 + lost) * kept) / np.maximum(lost, 1e-9) ** 2
    by_step = np.append(0.0, -np.sign(dx) / reach * (psi[:-1] * kept + healed))
    ends = np.append(0.0, np.cumsum(lost))
    weight = (1.0 - ratio) * sliding / (ratio + (1.0 - ratio) * psi)
    slide = np.flatnonzero(weight)
    first = np.searchsorted(ends, ends[slide] - FORGOTTEN)
    counts = slide - first + 1
    at = np.repeat(slide, counts)
    place = np.arange(at.size) - np.repeat(np.cumsum(counts) - counts, counts)
    j = np.repeat(first, counts) + place
    value = (weight[at] * np.exp(ends[j] - ends[at])) * by_step[j]
    # an error at a knot lengthens the step that ends there, and shortens the next one
    value -= np.where(j < at, np.append(value[1:], 0.0), 0.0)
    stored = np.zeros(t.size + 1, int)
    stored[slide + 1] = counts
    return csr_array((value, j, np.cumsum(stored)), shape=(t.size,) * 2)


def bands(problem: Problem, carried: Sequence[csr_array], scatter: Scatter, known: Known) -> Array:
    """Angular frequency of the noise by phase (rad/s), shape (4,).

    Where a model takes a reading ahead by a time tau, its noise e becomes e + tau e', and the covariance S of the
    residuals S + tau^2 N with the covariance N by the noise of the rates. The likelihood is that of the readings, so
    that residuals are told by their size before: in the phase each is divided by (1 + (omega tau)^2)^0.5, where omega^2
    is the mean of diag(S^-1 N), by which the logarithm of the determinant grows as it should.
    """
    rates = []
    for run, row in zip(problem.runs, carried, strict=True):
        single = run.reading.count == 1  # beside each other in time
        both = (single[1:] & single[:-1]).astype(float)
        ends = diags_array([np.append(-both, 0.0), both], offsets=[0, 1], shape=(single.size, single.size))
        rates.append(csr_array(row @ ends.T) / run.step)
    grown = scatter.named()["white"] ** 2 * noise(problem, rates)
    _, whole = covariance(scatter.sizes, known)
    share = np.einsum("eij,eji->ei", np.linalg.inv(whole), grown)
    phases = [share[problem.blocks.there & (known.phase == i)] for i in range(len(PHASES))]
    return np.sqrt(np.maximum([own.mean() if own.size else 0.0 for own in phases], 0.0))
