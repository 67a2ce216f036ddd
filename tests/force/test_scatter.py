"""Covariances are covariances, and the sizes of what is random are found again in what was drawn from them."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.knots import PHASES
from stickslip.inference.force.linked_events import grown
from stickslip.inference.force.scatter import (
    EVENTS as EVENTS_OWN,
)
from stickslip.inference.force.scatter import (
    NAMES,
    Blocks,
    Known,
    Scatter,
    _misfit,
    _slopes,
    covariance,
    estimate,
    misfit,
    weigh,
)
from stickslip.inference.force.whitening import Whitening

from .dense_covariance import dense

STRENGTH = 0.25  # N
EVENTS, POINTS = 60, 48
RUN = 20  # events
SPRING = 2e5  # N/m
TRUE = {
    "strength": 3e-3, "stretch": 0.03, "shape": 0.03, "offset": 3e-9, "creep": 4e-3, "nucleation": 3e-3, "slip": 2e-3,
    "ring-down": 1e-3, "position": 2e-9, "walk": 2e-9,
    "fringe": 1e-9, "white": 1.0,
}  # fmt: skip


def events(short: bool = False) -> Known:
    """Equal cycles: stick, nucleation, slip, ring-down; ``short`` leaves places empty."""
    rng = np.random.default_rng(1)
    phase = np.repeat(np.arange(4), POINTS // 4)
    tangent = np.interp(np.arange(POINTS), [0, 24, 36, 47], [1e6, 1e5, 0.0, 8e5])
    shape = (EVENTS, POINTS)
    place = np.sort(rng.uniform(-10.0, 10.0, shape), axis=1)
    lasting = rng.uniform(1.0, 3.0, EVENTS)
    elapsed = np.sort(rng.uniform(0.0, 1.0, shape), axis=1) * lasting[:, None]
    stretch = -STRENGTH * rng.uniform(0.0, 0.4, shape)
    other = STRENGTH * rng.uniform(-0.2, 0.2, shape)
    local = np.stack([np.full(shape, 0.9 * STRENGTH), stretch, other, -np.tile(tangent, (EVENTS, 1))], axis=2)
    there = np.ones(shape, bool)
    if short:
        there[::2, -7:] = False
        local[~there] = 0.0
    near = np.exp(-np.abs(np.subtract.outer(np.arange(POINTS), np.arange(POINTS))) / 0.5)
    noise = (1e-4 * STRENGTH) ** 2 * near * there[:, :, None] * there[:, None, :]
    waves = 1e6 * rng.standard_normal((EVENTS, POINTS, 2)) * there[..., None]
    return Known(
        noise, waves @ np.swapaxes(waves, 1, 2), np.zeros(shape), local, np.tile(phase, (EVENTS, 1)),
        np.full(shape, SPRING), np.tile(tangent, (EVENTS, 1)), place, elapsed,
        lasting, np.arange(EVENTS) % RUN == 0, there, STRENGTH,
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


def drawn(sizes: np.ndarray, known: Known, seed: int) -> np.ndarray:
    draws = np.random.default_rng(seed).standard_normal(EVENTS * POINTS)
    residual = (np.linalg.cholesky(dense(sizes, known)) @ draws).reshape(EVENTS, POINTS)
    return np.where(known.there, residual, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("short", [False, True])
def test_whitened_residuals_are_those_of_the_covariance(short):
    """Against its solution by a dense factorisation, with derivatives in the events' own other than those it knew."""
    known, rng = events(short), np.random.default_rng(5)
    other = known.local * rng.uniform(0.5, 2.0, known.local.shape)
    residual = 1e-3 * rng.standard_normal(known.there.shape) * known.there
    white = Whitening(true(), known).with_events(other)
    whole = dense(true(), known.with_local(other))
    weighted = np.linalg.solve(whole, residual.ravel()).reshape(residual.shape)
    np.testing.assert_allclose(white.weighted(residual), weighted, rtol=0.0, atol=1e-9 * np.abs(weighted).max())
    squares = (white(residual[..., None])[..., 0] ** 2).sum(axis=1)
    for run in range(EVENTS // RUN):  # of a run they add up to those of all its residuals together
        own = slice(run * RUN, (run + 1) * RUN)
        assert squares[own].sum() == pytest.approx((residual * weighted)[own].sum(), rel=1e-9)
    assert white.logs.sum() == pytest.approx(np.linalg.slogdet(whole)[1], rel=1e-10)
    found = weigh(true(), residual, known.with_local(other))
    np.testing.assert_allclose(found.weighted, weighted, rtol=0.0, atol=1e-9 * np.abs(weighted).max())
    inverted = np.linalg.inv(whole).reshape(EVENTS, POINTS, EVENTS, POINTS)
    for e in range(EVENTS):
        np.testing.assert_allclose(found.inverted[e], inverted[e, :, e], rtol=0.0, atol=1e-9 * inverted[e, :, e].max())


def test_the_walk_is_found_where_it_went():
    known, sizes = events(), true()
    sizes[NAMES.index("walk")] = np.log(2e-8)
    residual = drawn(sizes, known, 11)
    walk = weigh(sizes, residual, known).linked
    before, after = grown(known.spread(sizes), known.first)
    begun = known.first
    assert np.abs(before[begun]).max() < 1e-12 * after.max()
    assert before[~begun] == pytest.approx(after[:-1][~begun[1:]], rel=1e-12)
    assert after[RUN - 1] == pytest.approx(4e-16 * known.lasting[:RUN].sum(), rel=1e-12)
    left = walk.covariance()[:, 1, 1]
    assert np.all(left < after) and left[RUN - 1] < 0.1 * after[RUN - 1]  # known better than without the residuals


def test_residuals_without_a_walk_leave_none():
    """Where the spring alone is off by a level of every event, drawn anew each time, it is no walk."""
    known, sizes = events(), true()
    sizes[NAMES.index("walk")] = np.log(1e-12)
    found = estimate(Scatter(true()), drawn(sizes, known, 13), known, steps=200)
    assert found.sizes[NAMES.index("walk")] < np.log(3e-10)
    assert found.sizes[0] == pytest.approx(sizes[0], abs=0.3)


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


@pytest.mark.slow
def test_sizes_are_found_in_what_was_drawn_from_them():
    """As far off as their information says, to neither side: standard deviations of one, none above 0.4 e-folds."""
    known, found, stated = events(short=True), [], []
    for seed in range(20, 32):
        residual = drawn(true(), known, seed)
        sizes = estimate(Scatter.wide(), residual, known, steps=200).sizes
        _, information, _ = _slopes(sizes, residual, known, _misfit(sizes, residual, known)[1])
        sd = np.sqrt(np.diag(2.0 * np.linalg.inv(information)))
        found.append((sizes - true()) / sd)
        stated.append(sd)
    assert np.median(stated, axis=0).max() < 0.4
    mean, spread = np.mean(found, axis=0), np.std(found, axis=0)
    assert np.abs(mean).max() < 3.5 / np.sqrt(len(found)), dict(zip(NAMES, mean, strict=True))
    free = np.array([name != "white" for name in NAMES])  # which is known beforehand
    assert spread[free].min() > 0.5 and spread.max() < 1.7, dict(zip(NAMES, spread, strict=True))


def test_events_differ_no_more_than_they_may():
    known = events(short=True)
    residual, own = drawn(true(), known, 21), len(EVENTS_OWN)
    least = Scatter(true() - 0.5)
    free = estimate(Scatter(true()), residual, known, steps=200)
    bound = estimate(Scatter(true()).within(least), residual, known, steps=200)
    assert (free.sizes[:own] > least.sizes[:own]).all()
    np.testing.assert_allclose(bound.sizes[:own], least.sizes[:own], rtol=1e-9)
    assert _misfit(bound.sizes, residual, known)[0] > _misfit(free.sizes, residual, known)[0]
    again = estimate(bound, residual, known, steps=200)  # the bound goes on with the sizes
    assert (again.sizes[:own] <= least.sizes[:own] + 1e-9).all()


@pytest.mark.parametrize("small", [(), ("stretch", "shape", "position"), ("walk", "fringe", "creep")])
def test_searches_for_sizes_from_anywhere_end_at_one_minimum(small):
    """Also for sizes that the residuals put at zero, where only what is expected of them holds them up."""
    known, sizes = events(short=True), true()
    for name in small:
        sizes[NAMES.index(name)] -= np.log(1e3)
    residual = drawn(sizes, known, 22)
    starts = (Scatter.wide(), *(Scatter(at) for at in (sizes, true(), true() + 1.0, true() - 1.0)))
    costs = [misfit(estimate(start, residual, known).sizes, residual, known) for start in starts]
    assert np.ptp(costs) < 0.1


def test_slopes_are_those_of_the_cost():
    known = events(short=True)
    residual = np.random.default_rng(3).standard_normal((EVENTS, POINTS)) * 1e-3 * STRENGTH * known.there
    at = true() + 0.3
    gradient, information, _ = _slopes(at, residual, known, _misfit(at, residual, known)[1])
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
