"""Runs may differ in strength by a ten-thousandth whatever the law: events of one run are no independent witnesses."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.fit import fit
from stickslip.inference.force.problem import LEVEL

pytestmark = pytest.mark.slow

SHIFT = 2.0 * LEVEL


@pytest.fixture(scope="module")
def fits(small):
    """As it is, and with the strength of the second run a little higher."""
    base = fit(small.problem, small.point)
    offset = SHIFT * base.forces.local[:, 0] * (base.problem.run == 1)
    shifted = small.problem.moved(small.problem.errors, -offset)
    return base, fit(shifted, small.point)


def test_a_run_that_is_stronger_has_a_level_of_its_own(fits):
    before, after = (f.point.common[f.problem.systematics :][:2] for f in fits)
    assert np.diff(after - before)[0] == pytest.approx(SHIFT, rel=0.1)


def test_events_scatter_no_more_than_before(fits):
    """Without levels the scatter of the strength is what the runs differ by, and each event pays for it."""
    before, after = (f.scatter.named()["strength"] for f in fits)
    assert after < 2.0 * before < SHIFT
    assert fits[1].cost - fits[0].cost < 8.0


def test_levels_are_what_they_say(small):
    """The columns of their derivatives are those of the residuals."""
    problem, point = small.problem, small.point
    slopes = problem.evaluate(point)
    for r in range(len(problem.runs)):
        column = problem.systematics + r
        common = point.common.copy()
        common[column] = 1e-6
        moved = problem.forces(type(point)(point.z, point.phases, point.weights, point.events, common))
        change = (moved.residual - slopes.residual) / 1e-6
        np.testing.assert_allclose(change, slopes.shared[:, column - common.size], rtol=1e-5, atol=1e-8)
        events = point.events.copy()
        events[problem.event_run == r, 0] = 1e-6
        own = problem.forces(type(point)(point.z, point.phases, point.weights, events, point.common))
        np.testing.assert_allclose(own.residual - moved.residual, 0.0, atol=1e-10)
