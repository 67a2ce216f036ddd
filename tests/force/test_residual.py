"""Structure of the residual force: what is not there is not seen, what is there is."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.diagnose.decide import DISPERSION
from stickslip.inference.diagnose.stepwise_selection import STRUCTURED
from stickslip.inference.force.fit import fit, fit_base
from stickslip.inference.force.residual import PULLED, coordinates, smooth_force, structures
from stickslip.inference.force.signatures import Explained

from .conftest import Case, made, seen

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def free(begun: Case):
    """Nothing hidden, the spring unknown: its stiffness is free."""
    return fit_base(begun.problem, begun.point)


def test_a_force_in_proportion_to_that_of_the_spring_is_another_spring(free):
    """Stiffness and reading: the columns together are the derivative in the logarithm of the stiffness."""
    values = coordinates(free)[PULLED]
    at, columns = smooth_force(free, PULLED, values)
    names = [f.name for f in free.free]
    stiffness = free.slopes.shared[:, names.index("rig.spring_stiffness")]
    np.testing.assert_allclose(-columns @ at / free.strength, stiffness, atol=1e-4 * np.abs(stiffness).max())


def test_nothing_is_seen_where_nothing_is_hidden(free, small):
    for found in (free, fit_base(small.problem, small.point)):
        assert min(s.chance for s in structures(found, Explained(found), DISPERSION)) > 1e-2


def test_a_spring_that_stiffens_is_seen_as_a_function_of_its_force(tmp_path):
    case = made(tmp_path / "case", 12, [seen("nonlinear-spring", "quadratic", 12.0)], spring_known=True)
    found = fit(case.problem, case.point)
    best, *_ = structures(found, Explained(found), DISPERSION)
    assert best.chance < STRUCTURED and best.variable == PULLED
