"""The covariance of all residuals together, from its definition: what the code does event by event is checked by it."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from stickslip.inference.force.scatter import NAMES, Known, covariance


def dense(sizes: np.ndarray, known: Known) -> np.ndarray:
    """Shape (E n, E n); the walk of each run from its value at every point, as it is defined."""
    events, points = known.there.shape
    out = np.zeros((events, points, events, points))
    _, whole = covariance(sizes, known)
    walk = np.exp(sizes[NAMES.index("walk")])
    for e in range(events):
        out[e, :, e] = whole[e] - walk**2 * known.shifts[1][e]
    for own in np.split(np.arange(events), np.flatnonzero(known.first)[1:]):
        begun = np.concatenate([[0.0], np.cumsum(known.lasting[own])])[:-1]
        # -c w(t) - k (w(t) - w(t0)) over the walk at the points and at the arrests before them
        now, before = (begun[:, None] + known.elapsed[own]).ravel(), np.repeat(begun, points)
        there = known.there[own].ravel()
        k = np.where(there, known.tangent[own].ravel(), 0.0)
        c = np.where(there, known.spring[own].ravel(), 0.0) + k
        both = np.minimum.outer
        together = (
            np.outer(c, c) * both(now, now)
            - np.outer(c, k) * both(now, before)
            - np.outer(k, c) * both(before, now)
            + np.outer(k, k) * both(before, before)
        )
        shape = (own.size, points, own.size, points)
        out[np.ix_(own, range(points), own, range(points))] += walk**2 * together.reshape(shape)
    if known.chain is not None:
        level, length = np.exp(sizes[len(NAMES) :][:2])
        chain, (begin, end) = known.chain, (known.chain.begin, known.chain.end)
        ends, group = np.stack([begin, end], axis=1).ravel(), np.repeat(chain.group, 2)
        of_states = states(ends, group, level, length * chain.unit)
        of_states[1::2] *= chain.unit  # slopes are over the usual way of an event
        of_states[:, 1::2] *= chain.unit
        cubic = CubicHermiteSpline([0.0, 1.0], np.eye(4).reshape(2, 2, 4)[:, 0], np.eye(4).reshape(2, 2, 4)[:, 1])
        load = chain.slides[..., None] * cubic(chain.share) + chain.rests[..., None] * cubic(chain.held)[:, None]
        load *= np.stack([np.ones(events), chain.way, np.ones(events), chain.way], axis=1)[:, None]
        load *= known.local[..., :2].sum(axis=2, keepdims=True)  # the caps alone: yield displacements go with them
        whole = of_states.reshape(events, 4, events, 4)
        out += np.einsum("eia,eafb,fjb->eifj", load, whole, load, optimize=True)
    return out.reshape(events * points, events * points)


def states(at: np.ndarray, group: np.ndarray, size: float, length: float) -> np.ndarray:
    """Covariance of values and slopes of a Matern process of order 3/2, one after the other, shape (2 n, 2 n)."""
    far, rate = np.subtract.outer(at, at), np.sqrt(3.0) / length
    q = rate * np.abs(far)
    both = np.stack([[1.0 + q, rate**2 * far], [-(rate**2) * far, rate**2 * (1.0 - q)]])
    both = size**2 * np.exp(-q) * both * np.equal.outer(group, group)
    return np.transpose(both, (2, 0, 3, 1)).reshape(2 * at.size, 2 * at.size)
