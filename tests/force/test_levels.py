"""Strengths of events that follow each other: against the dense covariance, and found again where they were drawn."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from stickslip.inference.force.linked_events import Chain, Levels
from stickslip.inference.force.scatter import (
    EXACT,
    NAMES,
    WANDER,
    Follows,
    Known,
    Scatter,
    _misfit,
    _slopes,
    estimate,
    misfit,
    weigh,
)
from stickslip.inference.force.whitening import Whitening

from .dense_covariance import dense, states
from .test_scatter import EVENTS, POINTS, RUN, events, true

LEVEL, LENGTH, BEND = 8e-3, 4.0, 0.5  # share of the strength, usual ways of an event, share of the process's own
FOLLOWS = Follows("time", 1.0)
BOTH = ["onward", "there and back"]


def levelled(way: str, short: bool = True, groups: int = EVENTS // RUN, every: bool = False) -> Known:
    """Cycles with levels along a coordinate that goes onward, or back over its own way in the later half of a run."""
    known, rng = events(short), np.random.default_rng(2)
    group = np.arange(EVENTS) * groups // EVENTS
    steps = rng.uniform(0.3, 1.7, EVENTS)
    if way == "there and back":
        steps *= np.where(np.arange(EVENTS) % RUN < RUN // 2, 1.0, -1.0)
    end = np.cumsum(steps)
    share = np.sort(rng.uniform(0.0, 1.0, known.there.shape), axis=1)
    slides = np.ones_like(share) if every else np.sort(rng.uniform(0.0, 1.0, share.shape), axis=1)
    held = rng.uniform(0.0, 0.5, EVENTS)
    rests = (1.0 - slides) * rng.uniform(0.0, 1.0, share.shape)  # of one friction alone it is less than the rest
    return known.following(Chain(end - steps, end, group, 1.0, share, slides, held, rests))


def sizes(level: float = LEVEL, length: float = LENGTH, bend: float = BEND) -> np.ndarray:
    return np.append(true(), np.log([level, length, bend]))


@pytest.mark.slow
@pytest.mark.parametrize("way", BOTH)
def test_the_likelihood_is_that_of_the_dense_covariance(way):
    known, rng = levelled(way), np.random.default_rng(5)
    residual = 1e-3 * rng.standard_normal(known.there.shape) * known.there
    white = Whitening(sizes(), known).with_events(known.local)
    whole = dense(sizes(), known)
    weighted = np.linalg.solve(whole, residual.ravel()).reshape(residual.shape)
    logs = np.linalg.slogdet(whole)[1]
    np.testing.assert_allclose(white.weighted(residual), weighted, rtol=0.0, atol=1e-9 * np.abs(weighted).max())
    assert white.logs.sum() == pytest.approx(logs, rel=1e-10)
    squares = (white(residual[..., None])[..., 0] ** 2).sum(axis=1)
    for run in range(EVENTS // RUN):
        own = slice(run * RUN, (run + 1) * RUN)
        assert squares[own].sum() == pytest.approx((residual * weighted)[own].sum(), rel=1e-9)
    prior = known.prior(sizes())
    expected = float((residual * weighted).sum()) + logs + prior
    assert misfit(sizes(), residual, known) == pytest.approx(expected, rel=1e-9)
    found = weigh(sizes(), residual, known)
    np.testing.assert_allclose(found.weighted, weighted, rtol=0.0, atol=1e-9 * np.abs(weighted).max())
    inverted = np.linalg.inv(whole).reshape(EVENTS, POINTS, EVENTS, POINTS)
    for e in range(EVENTS):
        np.testing.assert_allclose(found.inverted[e], inverted[e, :, e], rtol=0.0, atol=1e-9 * inverted[e, :, e].max())


@pytest.mark.parametrize("way", BOTH)
def test_the_covariance_of_levels_is_what_it_is_said_to_be(way):
    chain = levelled(way).chain
    rng = np.random.default_rng(3)

    def whole(length: float) -> np.ndarray:
        return states(chain.at, chain.of, LEVEL, length)

    levels, values = Levels(chain, LEVEL, LENGTH), rng.standard_normal(2 * chain.at.size)
    close = {"rtol": 0.0, "atol": 1e-5 * LEVEL**2 * np.abs(values).sum()}
    np.testing.assert_allclose(levels.times(values), whole(LENGTH) @ values, **close)
    slope = (whole(LENGTH * np.exp(1e-5)) - whole(LENGTH * np.exp(-1e-5))) / 2e-5
    np.testing.assert_allclose(levels.slope_times(values), slope @ values, **close)
    here = chain.states
    of_events = np.stack([whole(LENGTH)[np.ix_(own, own)] for own in here])
    np.testing.assert_allclose(levels.of_events(), of_events, rtol=0.0, atol=1e-12 * LEVEL**2)


def test_between_its_nodes_a_level_is_the_process_too():
    """Nodes and bridge together are the covariance of the process at all points, for events shorter than the length."""
    known, length = levelled("onward", short=False, every=True), 300.0
    plain = replace(known, chain=None)
    rate = np.sqrt(3.0) / length
    at = sizes(LEVEL, length, 1.0)
    inexact = np.einsum("eij,ef->eifj", (EXACT * LEVEL) ** 2 * known.strengths, np.eye(EVENTS))
    found = dense(at, known) - dense(at[: len(NAMES)], plain) - inexact.reshape(2 * [EVENTS * POINTS])
    chain = known.chain
    s = chain.begin[:, None] + chain.share * (chain.end - chain.begin)[:, None]
    q = rate * np.abs(np.subtract.outer(s.ravel(), s.ravel()))
    group = np.repeat(chain.group, POINTS)
    strength = known.local[..., :2].sum(axis=2).ravel()  # the caps alone: yield displacements go with them
    whole = LEVEL**2 * (1.0 + q) * np.exp(-q) * np.equal.outer(group, group) * np.multiply.outer(strength, strength)
    off, bridged = np.abs(found - whole).max(), Levels(chain, LEVEL, length).bend ** 2 * np.abs(known.bridge).max()
    assert off < 0.05 * bridged, (off, bridged)


@pytest.mark.parametrize("way", BOTH)
def test_given_strengths_and_marginalised_ones_have_the_same_least_cost(way):
    """With the strengths at their best the cost of residuals and strengths together is that of the marginal ones."""
    known, rng = levelled(way), np.random.default_rng(6)
    marginal = 1e-3 * rng.standard_normal(known.there.shape) * known.there
    plain = Whitening(sizes(), known)
    white, random = plain.with_events(known.local), np.exp(2.0 * true()[:4])
    events = -random * np.einsum("eia,ei->ea", known.local, white.weighted(marginal))
    events[:, :2] -= white.level(marginal)[:, None]

    def cost(own):
        return plain.squares(marginal + np.einsum("eia,ea->ei", known.local, own), own)

    least = float((white(marginal[..., None]) ** 2).sum())
    assert cost(events) == pytest.approx(least, rel=1e-9)
    for way_off in rng.standard_normal((5, *events.shape)):
        assert cost(events + 1e-6 * way_off * np.abs(events)) >= least * (1.0 - 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("way", BOTH)
def test_slopes_are_those_of_the_cost(way):
    known = levelled(way)
    residual = np.random.default_rng(3).standard_normal((EVENTS, POINTS)) * 2.5e-4 * known.there
    at = sizes() + 0.3
    gradient, information, _ = _slopes(at, residual, known, _misfit(at, residual, known)[1])
    seen = [(misfit(at + d, residual, known) - misfit(at - d, residual, known)) / 2e-4 for d in 1e-4 * np.eye(at.size)]
    np.testing.assert_allclose(gradient, seen, rtol=2e-4, atol=1e-5 * np.abs(gradient).max())
    # average information: the residuals' quadratic form in the derivatives of the dense covariance
    weighted = np.linalg.solve(dense(at, known), residual.ravel())
    for i in range(at.size):
        step = 1e-4 * np.eye(at.size)[i]
        moved = (dense(at + step, known) - dense(at - step, known)) @ weighted / 2e-4
        expected = moved @ np.linalg.solve(dense(at, known), moved) + 2.0 * (information[i, i] > 0) * 0.0
        width = information[i, i] - expected
        assert 0.0 < width < 250.0 + 1e-3 * expected


def drawn(at: np.ndarray, known: Known, seed: int) -> np.ndarray:
    draws = np.random.default_rng(seed).standard_normal(EVENTS * POINTS)
    return np.where(known.there, (np.linalg.cholesky(dense(at, known)) @ draws).reshape(EVENTS, POINTS), 0.0)


@pytest.mark.slow
def test_size_and_length_are_found_in_what_was_drawn_from_them():
    """As far off as their information says: standard deviations of one."""
    known, found = levelled("onward"), []
    start = Scatter.wide().following(FOLLOWS)
    for seed in range(40, 64):
        residual = drawn(sizes(), known, seed)
        at = estimate(start, residual, known, steps=200).sizes
        _, information, _ = _slopes(at, residual, known, _misfit(at, residual, known)[1])
        found.append(((at - sizes()) / np.sqrt(np.diag(2.0 * np.linalg.inv(information))))[-3:-1])
    mean, spread = np.mean(found, axis=0), np.std(found, axis=0)
    assert np.abs(mean).max() < 3.5 / np.sqrt(len(found)), (mean, spread)
    assert spread.min() > 0.5 and spread.max() < 1.7, (mean, spread)
    inside = (np.abs(found) < 2.0).mean(axis=0)
    assert inside.min() > 0.8, inside


@pytest.mark.slow
def test_no_wander_is_none():
    """Independent strengths: a level gains no more than its two parameters cost."""
    known, gains = levelled("onward"), []
    for seed in range(70, 82):
        residual = drawn(sizes(1e-9), known, seed)
        alone = replace(known, chain=None)
        least = estimate(Scatter(true()), residual, alone, steps=200)
        more = estimate(least.following(FOLLOWS), residual, known, steps=200)
        gains.append(misfit(least.sizes, residual, alone) - misfit(more.sizes, residual, known))
    assert max(gains) < len(WANDER) * np.log(EVENTS), gains


def test_the_cost_is_linear_in_the_events():
    seconds = {}
    for n in (2000, 8000):
        rng = np.random.default_rng(4)
        local, share = rng.standard_normal((n, 6, 4)), np.tile(np.linspace(0.1, 0.9, 6), (n, 1))
        known = Known(
            np.tile(1e-8 * np.eye(6), (n, 1, 1)), np.zeros((n, 6, 6)), np.zeros((n, 6)), local,
            np.tile(np.arange(6) % 4, (n, 1)), np.ones((n, 6)), np.ones((n, 6)), np.tile(np.arange(6.0), (n, 1)),
            share, np.ones(n), np.arange(n) == 0, np.ones((n, 6), bool), 1.0,
            chain=Chain(
                np.arange(n) * 1.0, np.arange(n) + 1.0, np.zeros(n, int), 1.0, share, np.ones_like(share), np.zeros(n),
                np.zeros_like(share),
            ),
        )  # fmt: skip
        residual = 1e-2 * rng.standard_normal((n, 6))
        begun = time.process_time()
        cost, root = _misfit(sizes(), residual, known)
        _slopes(sizes(), residual, known, root)
        assert np.isfinite(cost)
        seconds[n] = time.process_time() - begun
    assert seconds[8000] < 8.0 * seconds[2000]
    assert seconds[8000] < 10.0


def test_names_say_the_length_in_units():
    named = replace(Scatter(sizes()), follows=Follows("slip path", 2e-5)).named()
    assert tuple(named) == (*NAMES, *WANDER)
    assert named["length"] == pytest.approx(LENGTH * 2e-5)
