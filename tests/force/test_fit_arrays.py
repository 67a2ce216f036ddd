"""A fit that was kept is the same to the last digit: what goes on from it goes on as if nothing had been kept."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from stickslip.inference.diagnose.checkpoints import kept, load_candidate, save_candidate
from stickslip.inference.force.candidates import try_effect
from stickslip.inference.force.fit import fit, fit_base
from stickslip.inference.force.fit_arrays import fit_arrays, fit_of
from stickslip.inference.force.profile_deviations import LEVEL, widened
from stickslip.inference.force.scatter import EVENTS
from stickslip.inference.force.signatures import Explained


@pytest.mark.slow
def test_a_kept_fit_is_the_same(begun):
    found = widened(fit_base(begun.problem, begun.point), [LEVEL], 3.0)
    assert found.valleys
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **fit_arrays(found))
    file.seek(0)
    again = fit_of(begun.problem, dict(np.load(file, allow_pickle=False)))
    assert again.cost == found.cost and again.evaluations == found.evaluations
    np.testing.assert_array_equal(again.residual, found.residual)
    np.testing.assert_array_equal(again.covariance, found.covariance)


def test_an_interruption_changes_nothing(begun):
    """Forces found on the way differ in the last digit from those found at the end: what goes on is the latter."""
    found = fit(begun.problem, begun.point)
    rounded = replace(found.forces, residual=found.forces.residual * (1.0 + 1e-15))
    pieces: dict[str, dict[str, np.ndarray]] = {}

    class Kept:
        load, save = pieces.get, pieces.__setitem__

    first, again = (kept(Kept, "base", begun.problem, lambda: replace(found, forces=rounded)) for _ in range(2))
    assert list(pieces) == ["base"] and again.cost == first.cost
    np.testing.assert_array_equal(again.residual, first.residual)


@pytest.mark.slow
def test_what_events_may_not_differ_by_is_kept(begun):
    """A law that is added may not let events differ more than its base does, also after an interruption."""
    base = fit(begun.problem, begun.point)
    bound = replace(base, scatter=base.scatter.within(base.scatter))
    again = fit_of(begun.problem, fit_arrays(bound))
    own = len(EVENTS)
    np.testing.assert_array_equal(again.scatter.most[:own], base.scatter.sizes[:own])
    pieces: dict[str, dict[str, np.ndarray]] = {}

    class Kept:
        load, save = pieces.get, pieces.__setitem__

    (candidate,) = try_effect(base, Explained(base), "viscous-drag", [{}])
    assert candidate.fit is not None and np.isfinite(candidate.fit.scatter.most[:own]).all()
    save_candidate(Kept, "one", candidate)
    loaded = load_candidate(Kept, "one", base)
    np.testing.assert_array_equal(loaded.fit.scatter.most, candidate.fit.scatter.most)
