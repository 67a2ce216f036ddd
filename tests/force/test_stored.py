"""A fit that was kept is the same to the last digit: what goes on from it goes on as if nothing had been kept."""

from __future__ import annotations

import io

import numpy as np

from stickslip.inference.force.fit import fit
from stickslip.inference.force.stored import fit_arrays, fit_of
from stickslip.inference.force.valleys import LEVEL, widened


def test_a_kept_fit_is_the_same(begun):
    found = widened(fit(begun.problem, begun.point), [LEVEL], 3.0)
    assert found.valleys
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **fit_arrays(found))
    file.seek(0)
    again = fit_of(begun.problem, dict(np.load(file, allow_pickle=False)))
    assert again.cost == found.cost and again.evaluations == found.evaluations
    np.testing.assert_array_equal(again.residual, found.residual)
    np.testing.assert_array_equal(again.covariance, found.covariance)
