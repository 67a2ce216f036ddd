"""The covariance of all residuals together, from its definition: what the code does event by event is checked by it."""

from __future__ import annotations

import numpy as np

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
        chain = known.chain
        at = np.stack([chain.begin, chain.end], axis=1).ravel()
        apart = np.abs(np.subtract.outer(at, at)) / chain.unit / length
        group = np.repeat(chain.group, 2)
        together = level**2 * np.exp(-apart) * np.equal.outer(group, group)
        shares = np.stack([1.0 - chain.share, chain.share], axis=2)
        out += np.einsum(
            "ei,eia,eafb,fjb,fj->eifj", known.local[..., 0], shares, together.reshape(events, 2, events, 2), shares,
            known.local[..., 0], optimize=True,
        )  # fmt: skip
    return out.reshape(events * points, events * points)
