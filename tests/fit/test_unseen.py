"""Cycles that no fit may see are not integrated while it searches, and change nothing of what it finds."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.fit.inertial import fit
from stickslip.fit.problem import Problem
from stickslip.floors import floors

from . import synthetic


@pytest.fixture(scope="module")
def campaign():
    return synthetic.measured(synthetic.traces())


@pytest.fixture(scope="module")
def seen(campaign):
    """All but one run, and in another all but the last two cycles."""
    mask = np.asarray(campaign.cycles.used).copy()
    mask[1] = False
    mask[0, np.flatnonzero(mask[0])[-2:]] = False
    return mask


@pytest.fixture(scope="module")
def problem(campaign):
    return Problem(synthetic.composition(), campaign, threads=1)


def test_what_is_seen_is_the_same_to_the_last_bit_and_the_rest_is_not_integrated(campaign, problem, seen):
    z, events = synthetic.truth(), np.zeros((*seen.shape, 2))
    whole, part = problem.features(z, events), problem.seeing(seen)
    before = part.runs_done
    found = part.features(z, events)
    assert part.runs_done - before == campaign.runs - 1
    assert np.array_equal(found[seen], whole[seen], equal_nan=True)
    assert np.array_equal(found[~seen], campaign.values[~seen], equal_nan=True)
    tracks = [int(np.asarray(p.track(z, events, 0).steps)[-1]) for p in (problem, part)]
    assert tracks[0] > 100
    assert tracks[1] < 5


def test_what_is_not_seen_has_no_slope_for_it(problem, seen):
    z, events = synthetic.truth(), np.zeros((*seen.shape, 2))
    part, which = problem.seeing(seen), [0, 2]
    slopes = part.columns(z, events, which, part.features(z, events))
    assert not slopes[~seen].any()
    whole = problem.columns(z, events, which, problem.features(z, events))
    assert np.array_equal(slopes[seen], whole[seen], equal_nan=True)


def test_a_fit_ends_with_the_features_of_all_cycles_and_the_slopes_that_judge_it(campaign, problem, seen):
    k = len(problem.composition.free)
    stale = np.ones((*campaign.values.shape, k))
    start, stages = synthetic.truth() + 0.02, ((1.0, 3),)
    found = fit(problem, floors(campaign), z=start, stages=stages, use=seen, columns=stale, anew=False)
    whole = problem.features(found.z, found.events)
    assert found.features - found.offsets == pytest.approx(whole, rel=0, abs=1e-13, nan_ok=True)
    names = [free.name for free in problem.composition.free]
    which = [names.index("contact.u_max"), names.index("contact.p")]
    unseen = np.asarray(campaign.cycles.used) & ~seen
    slopes = problem.columns(found.z, found.events, which, whole)[unseen]
    assert np.nanmax(np.abs(slopes)) > 0
    assert np.array_equal(found.columns[unseen][..., which], slopes, equal_nan=True)
    others = [i for i in range(k) if i not in which]
    assert not found.columns[unseen][..., others].any()
