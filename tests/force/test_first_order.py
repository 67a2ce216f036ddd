"""What an effect promises on unseen runs at first sight."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.first_order import promise
from stickslip.inference.force.fit import fit
from stickslip.inference.force.heldout import folds
from stickslip.inference.force.signatures import Explained


@pytest.fixture(scope="module")
def base(small):
    return fit(small.problem, small.point)


def test_the_gain_of_a_force_in_unseen_runs_is_predicted(base):
    """Residuals that are nothing but the column: runs say the same of its size, and all of the cost falls."""
    explained = Explained(base)
    column = base.slopes.tangent[:, None] * np.sin(np.arange(base.problem.at.size) / 50.0)[:, None]
    explained.rest = explained.orthogonal(column)[:, 0]
    by_event = (explained.events(explained.rest) ** 2).sum(axis=1)
    assert explained.unseen(column, folds(base)) == pytest.approx(by_event, rel=1e-6)
    assert by_event.sum() == pytest.approx(explained.gain(column)[0], rel=0.02)  # the rest lies along the priors


def test_a_column_without_a_force_loses_what_its_guess_costs(base):
    """White residuals: a fold of norm n^2 loses n^2 over the norm of the others, in the mean."""
    rng = np.random.default_rng(5)
    explained, left_out = Explained(base), folds(base)
    rows = explained.rest.size
    lost, wanted = [], []
    for _ in range(300):
        noise = rng.standard_normal(rows)
        explained.rest = noise - explained.basis @ (explained.basis.T @ noise)
        column = rng.standard_normal((base.problem.at.size, 1)) * base.slopes.tangent[:, None]
        orthogonal = explained.events(explained.orthogonal(column)[:, 0])
        norms = np.array([(orthogonal[part] ** 2).sum() for part in left_out])
        lost.append(-explained.unseen(column, left_out).sum())
        wanted.append((norms / (norms.sum() - norms)).sum())
    error = np.std(np.array(lost) - np.array(wanted)) / np.sqrt(len(lost))
    assert np.mean(lost) == pytest.approx(np.mean(wanted), abs=4.0 * error)
    assert np.mean(wanted) > 4.0 * error


def test_an_effect_that_is_not_there_promises_nothing_on_unseen_runs(base):
    found = promise(base, Explained(base), "wear", {})
    assert found.unseen < 10.0 and found.unseen_std > 0.0
    assert found.unseen < found.fall + 1e-9
