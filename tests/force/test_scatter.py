"""Covariances are covariances, and the sizes of what is random are found again in what was drawn from them."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.knots import PHASES
from stickslip.inference.force.scatter import (
    EVENTS as EVENTS_OWN,
)
from stickslip.inference.force.scatter import (
    NAMES,
    Blocks,
    Known,
    Scatter,
    Whitening,
    _misfit,
    _slopes,
    covariance,
    estimate,
    misfit,
)

STRENGTH = 0.25  # N
EVENTS, POINTS = 60, 48
TRUE = {
    "strength": 3e-3, "stretch": 0.03, "shape": 0.03, "offset": 3e-9, "creep": 4e-3, "nucleation": 3e-3, "slip": 2e-3,
    "ring-down": 1e-3, "position": 2e-9, "walk": 2e-9, "white": 1.0,
}  # fmt: skip


def events(short: bool = False) -> Known:
    """Cycles alike: stick, nucleation, slip, ring-down; ``short`` leaves places empty."""
    rng = np.random.default_rng(1)
    phase = np.repeat(np.arange(4), POINTS // 4)
    tangent = np.interp(np.arange(POINTS), [0, 24, 36, 47], [1e6, 1e5, 0.0, 8e5])
    shape = (EVENTS, POINTS)
    place = np.sort(rng.uniform(-10.0, 10.0, shape), axis=1)
    elapsed = np.sort(rng.uniform(0.0, 2.0, shape), axis=1)
    stretch = -STRENGTH * rng.uniform(0.0, 0.4, shape)
    other = STRENGTH * rng.uniform(-0.2, 0.2, shape)
    local = np.stack([np.full(shape, 0.9 * STRENGTH), stretch, other, -np.tile(tangent, (EVENTS, 1))], axis=2)
    there = np.ones(shape, bool)
    if short:
        there[::2, -7:] = False
        local[~there] = 0.0
    near = np.exp(-np.abs(np.subtract.outer(np.arange(POINTS), np.arange(POINTS))) / 0.5)
    noise = (1e-4 * STRENGTH) ** 2 * near * there[:, :, None] * there[:, None, :]
    return Known(
        noise, np.zeros(shape), local, np.tile(phase, (EVENTS, 1)), np.tile(tangent, (EVENTS, 1)), place,
        elapsed, there, STRENGTH,
    )  # fmt: skip


def true() -> np.ndarray:
    return np.log([TRUE[name] for name in NAMES])


@pytest.mark.parametrize("short", [False, True])
@pytest.mark.parametrize("sizes", ["wide", "true"])
def test_the_covariance_is_one(short, sizes):
    known = events(short)
    s = Scatter.wide().sizes if sizes == "wide" else true()
    plain, whole = (np.asarray(a) for a in covariance(s, known))
    for matrix in (plain, whole):
        np.testing.assert_allclose(matrix, np.swapaxes(matrix, 1, 2), rtol=0.0, atol=1e-18)
        assert np.linalg.eigvalsh(matrix).min() > 0.5 * (1e-4 * STRENGTH) ** 2
    added = whole - plain  # the random effects: four at most
    assert np.linalg.eigvalsh(added)[:, :-4].max() < 1e-10 * np.linalg.eigvalsh(added).max()
    empty = ~known.there
    for e in np.flatnonzero(empty.any(axis=1)):
        np.testing.assert_array_equal(whole[e][empty[e]], np.eye(POINTS)[empty[e]])


@pytest.mark.parametrize("short", [False, True])
def test_whitened_residuals_are_those_of_the_covariance(short):
    """Against its solution by a dense factorisation, with derivatives in the events' own other than those it knew."""
    known, rng = events(short), np.random.default_rng(5)
    other = known.local * rng.uniform(0.5, 2.0, known.local.shape)
    residual = 1e-3 * rng.standard_normal(known.there.shape) * known.there
    white = Whitening(true(), known).with_events(other)
    _, whole = covariance(true(), known.with_local(other))
    weighted = np.linalg.solve(whole, residual[..., None])[..., 0]
    np.testing.assert_allclose(white.weighted(residual), weighted, rtol=0.0, atol=1e-9 * np.abs(weighted).max())
    squares = (white(residual[..., None])[..., 0] ** 2).sum(axis=1)
    np.testing.assert_allclose(squares, (residual * weighted).sum(axis=1), rtol=1e-9)
    np.testing.assert_allclose(white.logs, np.linalg.slogdet(whole)[1], rtol=1e-10)


def test_every_size_has_its_own_part():
    known = events()
    plain, whole = (np.asarray(a) for a in covariance(true(), known))
    for i, name in enumerate(NAMES):
        sizes = true()
        sizes[i] += np.log(2.0)
        more, all_of_it = (np.asarray(a) for a in covariance(sizes, known))
        assert np.all(np.diagonal(all_of_it, axis1=1, axis2=2) >= np.diagonal(whole, axis1=1, axis2=2) * (1 - 1e-12))
        assert not np.array_equal(all_of_it, whole), name
        assert np.array_equal(more, plain) == (name in EVENTS_OWN), name
        if name in PHASES:  # a phase's own misfit leaves the other phases alone
            grown = np.diagonal(more - plain, axis1=1, axis2=2) > 0.0
            assert np.array_equal(grown, known.phase == PHASES.index(name))


def test_sizes_are_found_in_what_was_drawn_from_them():
    known = events(short=True)
    _, whole = (np.asarray(a) for a in covariance(true(), known))
    draws = np.random.default_rng(7).standard_normal((EVENTS, POINTS))
    residual = np.einsum("eij,ej->ei", np.linalg.cholesky(whole), draws)
    residual[~known.there] = 0.0
    found = estimate(Scatter.wide(), residual, known, steps=200)
    off = dict(zip(NAMES, found.sizes - true(), strict=True))
    for name in NAMES:
        assert abs(off[name]) < (0.5 if name in ("walk", "position", "offset") else 0.3), (name, off)


def test_slopes_are_those_of_the_cost():
    known = events(short=True)
    residual = np.random.default_rng(3).standard_normal((EVENTS, POINTS)) * 1e-3 * STRENGTH * known.there
    at = true() + 0.3
    gradient, information = _slopes(at, residual, known, _misfit(at, residual, known)[1])
    for step in (1e-3, 1e-4, 1e-5):
        seen = [
            (misfit(at + d, residual, known) - misfit(at - d, residual, known)) / (2 * step)
            for d in step * np.eye(len(NAMES))
        ]
        np.testing.assert_allclose(gradient, seen, rtol=2e-4, atol=1e-4 * np.abs(gradient).max())
    assert np.linalg.eigvalsh(information).min() > 0.0


def test_blocks_go_side_by_side_and_back():
    event = np.array([2, 0, 0, 2, 3, 2, 0])
    blocks = Blocks.of(event, 4)
    values = np.arange(1.0, 8.0)
    side = blocks(values)
    assert side.shape == (4, 3)
    np.testing.assert_array_equal(side[0], [2.0, 3.0, 7.0])
    np.testing.assert_array_equal(side[1], 0.0)
    back = np.zeros(7)
    back[blocks.index[blocks.there]] = side[blocks.there]
    np.testing.assert_array_equal(back, values)
    wide = blocks(np.stack([values, -values], axis=1), fill=9.0)
    assert wide.shape == (4, 3, 2)
    assert np.all(wide[1] == 9.0)
    assert blocks.there.sum() == 7
