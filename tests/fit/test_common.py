"""Errors that events have in common, against the covariance they stand for."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import stickslip.fit.common as module
from stickslip.features.layout import Layout
from stickslip.fit.common import Common

RUNS, CYCLES = 3, 5


@pytest.fixture
def world(monkeypatch):
    """A measurement of shapes alone, with floors and common errors of random size."""
    rng = np.random.default_rng(4)
    layout = Layout(0.06, 0.004)
    shape = (RUNS, CYCLES, layout.size)
    used = np.ones((RUNS, CYCLES), bool)
    used[2, 3:] = False
    valid = rng.random(shape) < 0.8
    m = SimpleNamespace(valid=valid, values=np.zeros(shape), layout=layout, cycles=SimpleNamespace(used=used))
    of_run, of_all = rng.uniform(0.5, 2.0, shape), rng.uniform(0.5, 2.0, shape)
    monkeypatch.setattr(module, "common", lambda measurement: (of_run, of_all))
    return m, rng.uniform(0.5, 2.0, shape), of_run, of_all, used, rng


def covariance(j, mask, floor, of_run, of_all) -> np.ndarray:
    run = np.broadcast_to(np.arange(RUNS)[:, None], mask.shape)[mask]
    s, t, d = of_all[..., j][mask], of_run[..., j][mask], floor[..., j][mask]
    return np.diag(d**2) + np.outer(s, s) + np.outer(t, t) * (run[:, None] == run)


@pytest.mark.parametrize("factor", [1.0, 7.0])
def test_the_sum_of_squares_is_the_chi_square_with_the_offsets_marginalised(world, factor):
    m, floor, of_run, of_all, used, rng = world
    common = Common(m, floor, used, factor)
    residual = rng.standard_normal(m.values.shape)
    exact = 0.0
    for j in range(m.layout.size):
        mask = m.valid[..., j] & used
        r = residual[..., j][mask]
        exact += r @ np.linalg.solve(covariance(j, mask, factor * floor, of_run, of_all), r)
    found = common(residual[common.valid])
    assert found @ found == pytest.approx(exact, rel=1e-10)


def test_offsets_are_the_mean_of_what_is_common_given_the_residuals(world):
    """Of every cell, those that were not used included: the conditional mean of two Gaussian variables."""
    m, floor, of_run, of_all, used, rng = world
    residual = rng.standard_normal(m.values.shape)
    use = used.copy()
    use[1] = False  # a run that no fit has seen
    found = Common(m, floor, use).offsets(residual)
    run = np.broadcast_to(np.arange(RUNS)[:, None], used.shape)
    for j in (0, 7, 20):
        mask = m.valid[..., j] & use
        s, t = of_all[..., j], of_run[..., j]
        between = s[..., None] * s[mask] + t[..., None] * t[mask] * (run[..., None] == run[mask])
        exact = between @ np.linalg.solve(covariance(j, mask, floor, of_run, of_all), residual[..., j][mask])
        np.testing.assert_allclose(found[..., j], exact, rtol=1e-9, atol=1e-12)


def test_what_all_events_share_is_told_from_what_each_has_alone(world):
    m, _, of_run, of_all, used, _ = world
    m = SimpleNamespace(**{**vars(m), "valid": np.ones_like(m.valid)})
    floor = np.full(m.values.shape, 0.1)
    common = Common(m, floor, used)
    quiet = common.alike(np.zeros(int(common.valid.sum())))
    assert all(v == 0.0 for v in quiet.values())
    of_three = common.alike((3.0 * of_all)[common.valid])
    assert all(2.0 < v < 4.0 for v in of_three.values())
    of_one_run = np.zeros(m.values.shape)
    of_one_run[1] = 3.0 * of_run[1]
    assert all(v > 1.0 for v in common.alike(of_one_run[common.valid]).values())
    alternating = floor * np.where(np.arange(CYCLES) % 2, 1.0, -1.0)[:, None]
    assert all(v < 0.2 for v in common.alike(alternating[common.valid]).values())


def test_a_slope_is_carried_as_a_residual_is(world):
    m, floor, _, _, used, rng = world
    common = Common(m, floor, used)
    n = int(common.valid.sum())
    a, b = rng.standard_normal(n), rng.standard_normal((n, 3))
    np.testing.assert_allclose(common(b) @ np.ones(3) + common(a), common(a + b.sum(axis=1)), rtol=1e-9, atol=1e-9)
