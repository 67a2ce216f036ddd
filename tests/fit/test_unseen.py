"""Cycles that no fit may see are not integrated while it searches, and change nothing of what it finds."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.fit.composition import Composition
from stickslip.fit.inertial import certain, fit
from stickslip.fit.parameters import Free
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


def with_start() -> Composition:
    """The model with the time of the second run's first slip free."""
    usual = synthetic.composition()
    return replace(usual, free=(*usual.free, Free("start.1", "m", 1e-6, 0.0, 0.0, 1.0, -1e-5, 1e-5)))


def test_a_fit_ends_with_the_features_of_all_cycles_and_the_slopes_that_judge_it(campaign, seen):
    """Also where it began with known derivatives, from which alone the steps of differences are too short."""
    cycles = campaign.cycles._replace(virgin=jnp.array([True, False]))
    problem, floor = Problem(with_start(), replace(campaign, cycles=cycles), threads=1), floors(campaign)
    start, events = np.append(synthetic.truth() + 0.02, 0.0), np.zeros((*seen.shape, 2))
    k = start.size
    known = problem.columns(start, events, range(k), problem.features(start, events), np.full(k, 0.05))
    known[~seen] = 1.0  # stale
    found = fit(problem, floor, z=start, stages=((1.0, 3),), use=seen, columns=known, anew=False)
    whole = problem.features(found.z, found.events)
    assert found.features - found.offsets == pytest.approx(whole, rel=0, abs=1e-13, nan_ok=True)
    names = [free.name for free in problem.composition.free]
    which = [names.index(name) for name in ("contact.u_max", "contact.p", "start.1")]
    unseen = np.asarray(campaign.cycles.used) & ~seen
    valid = campaign.valid & unseen[..., None]
    slopes = problem.columns(found.z, found.events, which, whole, np.array([0.05, 0.05, 0.01]))
    wanted = (slopes / floor[..., None])[valid]
    off = (found.columns[..., which] / floor[..., None])[valid] - wanted
    assert np.all(np.linalg.norm(wanted, axis=0) > 0)
    assert np.all(np.linalg.norm(off, axis=0) < 0.1 * np.linalg.norm(wanted, axis=0))
    others = [i for i in range(k) if i not in which]
    assert not found.columns[unseen][..., others].any()
    sure = certain(problem, floor, found)
    assert np.array_equal(sure.columns[unseen], found.columns[unseen])
    assert not np.array_equal(sure.columns[seen], found.columns[seen])


def test_a_search_integrates_no_cycle_that_it_may_not_see(campaign, problem, seen, monkeypatch):
    """But once, at its end, to be judged; and one that sees no more than the problem does is judged on that."""
    done = []
    track = Problem._track

    def counted(self, z, events, run):
        done.append((run, int(np.asarray(self._data[run][0].used).sum())))
        return track(self, z, events, run)

    monkeypatch.setattr(Problem, "_track", counted)
    found = fit(problem, floors(campaign), z=synthetic.truth(), stages=((3.0, 3), (1.0, 3)), use=seen)
    ends = 1 + 2  # the features and two slopes
    assert [run for run, _ in done].count(1) == ends
    whole = int(np.asarray(campaign.cycles.used)[0].sum())
    assert [length for run, length in done if run == 0].count(whole) == ends
    assert found.evaluations > ends
    done.clear()
    part = fit(problem.seeing(seen), floors(campaign), z=found.z, stages=((1.0, 2),))
    assert {run for run, _ in done} == {0}
    assert np.array_equal(part.use, seen)
    assert (part.features - part.offsets)[1] == pytest.approx(campaign.values[1], abs=1e-13, nan_ok=True)
