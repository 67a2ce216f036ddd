"""Derivatives by differences: what two parameters do together is seen, though each alone does a hundred times more."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.fit import inertial
from stickslip.fit.inertial import fit
from stickslip.fit.problem import Problem
from stickslip.floors import floors

from . import synthetic

NOISE = 0.3  # floors, of every feature, new wherever the model is asked
STRONG, WEAK = 3000.0, 10.0  # floors for a unit of each of two parameters, and of what they do together
FIRST, SECOND = 0, 1


class Straight(Problem):
    """Features that are linear in the parameters, with a solver's noise; the first two parameters nearly cancel."""

    def __init__(self, measurement, floor, jump=None):
        super().__init__(synthetic.composition(), measurement, threads=1)
        self.floor, self.jump = floor, jump
        rng = np.random.default_rng(5)
        self.slope = 30.0 * rng.standard_normal((*measurement.values.shape, len(self.composition.free)))
        common = rng.standard_normal(measurement.values.shape)
        self.slope[..., FIRST] = STRONG * common
        self.slope[..., SECOND] = -STRONG * common + WEAK * rng.standard_normal(common.shape)
        self.slope *= floor[..., None]
        self.noise = np.random.default_rng(6)

    def coarser(self):
        return self

    def _call(self, lanes, only=(), base=None):
        out = []
        for z, _ in lanes:
            step = z - synthetic.truth()
            found = self.measurement.values + self.slope @ step
            found = found + NOISE * self.floor * self.noise.standard_normal(found.shape)
            if self.jump is not None and abs(step[FIRST]) > 1e-4:
                found[self.jump][2:] += 1e4 * self.floor[self.jump][2:]  # but not the slip's size
            out.append(found)
        return out


@pytest.fixture(scope="module")
def campaign():
    return synthetic.measured(synthetic.traces())


@pytest.fixture(scope="module")
def floor(campaign):
    return floors(campaign)


def residuals(problem):
    res = inertial._Residuals(problem, problem.floor, 1.0, None)
    x = np.concatenate([synthetic.truth(), np.zeros(res.widths.size)])
    return res, x


def error(problem, columns, direction):
    """How wrong the slope along a direction is, as a share of it."""
    valid = problem.measurement.valid
    off = ((columns - problem.slope) @ direction / problem.floor)[valid]
    return np.linalg.norm(off) / np.linalg.norm((problem.slope @ direction / problem.floor)[valid])


def test_what_parameters_do_together_is_measured_in_a_step_of_its_own(campaign, floor):
    problem = Straight(campaign, floor)
    res, x = residuals(problem)
    apart = res._apart(x, res.evaluate(x))
    along = apart
    for _ in range(3):  # every time it is better known which way is the weak one
        along = res._along(x, res.evaluate(x), along)
    alone, together = np.eye(x.size)[FIRST][: res.k], np.zeros(res.k)
    together[[FIRST, SECOND]] = 1.0
    assert error(problem, apart, alone) < 0.15
    assert error(problem, along, alone) < 0.15
    assert error(problem, apart, together) > 20.0
    assert error(problem, along, together) < 0.5


def test_a_fit_finds_its_way_along_what_is_hardly_seen(campaign, floor, monkeypatch):
    def left(problem):
        z = synthetic.truth()
        z[[FIRST, SECOND]] += 0.4
        found = fit(problem, floor, z=z, stages=((1.0, 40),))
        return float(np.abs(found.z - synthetic.truth())[[FIRST, SECOND]].max()), found.data_cost

    best, cost = left(Straight(campaign, floor))
    assert best < 0.05
    assert cost < 0.3 * float(np.count_nonzero(campaign.valid))
    monkeypatch.setattr(inertial._Residuals, "_along", lambda self, x, f, known: self._apart(x, f))
    worse, _ = left(Straight(campaign, floor))
    assert worse > 2.0 * best


def test_an_event_that_becomes_another_one_keeps_its_slope(campaign, floor):
    r, n = np.argwhere(campaign.valid.any(axis=-1))[3]
    cell = (int(r), int(n))
    problem = Straight(campaign, floor, jump=cell)
    res, x = residuals(problem)
    known = problem.slope * 1.01
    columns = res._along(x, res.evaluate(x), known)
    own = campaign.valid[cell]
    assert (
        np.abs(columns[cell] / floor[cell][:, None])[own].max()
        < 2.0 * np.abs(problem.slope[cell] / floor[cell][:, None])[own].max()
    )


def test_a_direction_with_no_room_is_taken_as_far_as_there_is(campaign, floor):
    problem = Straight(campaign, floor)
    low, high = np.array([f.bounds for f in problem.composition.free]).T
    z = synthetic.truth()
    z[2], z[3] = high[2] - 0.03, low[3] + 0.02
    direction = np.zeros((z.size, 1))
    direction[2], direction[3] = 1.0, 1.0
    asked = []
    call = problem._call
    problem._call = lambda lanes, only=(), base=None: asked.extend(lanes) or call(lanes, only, base)
    base = call([(z, None)])[0]
    slopes = problem.slopes(z, None, direction, base, np.array([0.2]))
    moved = asked[0][0] - z
    assert moved[2] == pytest.approx(moved[3])  # the direction, not a bent one
    assert np.all(asked[0][0] <= high + 1e-12)
    assert np.all(asked[0][0] >= low - 1e-12)
    want = (problem.slope @ direction)[campaign.valid] / floor[campaign.valid][:, None]
    got = slopes[campaign.valid] / floor[campaign.valid][:, None]
    assert np.linalg.norm(got - want) < 0.6 * np.linalg.norm(want)
