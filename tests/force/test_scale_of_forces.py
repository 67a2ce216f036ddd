"""Displacement and drive alone tell no force: with mass, spring, damping and contact all larger nothing changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.inference.force.candidates import Start, _at, with_start
from stickslip.inference.force.fit import fit_base, refit
from stickslip.physics.effects.inertia import AddedMass

pytestmark = pytest.mark.slow

SHARE = 0.2


@pytest.fixture(scope="module")
def base(begun):
    return fit_base(begun.problem, begun.point)


@pytest.fixture(scope="module")
def larger(base):
    """All that is a force of the base is larger by a fifth."""
    problem, free = with_start(base.problem, AddedMass(), {"share": SHARE})
    point = _at(base.problem, free, Start({"share": SHARE}, base.point))
    scaled = {"rig.spring_stiffness", "rig.damping"}
    z = [
        f.inward((1.0 + SHARE) * base.values[f.name]) if f.name in scaled else value
        for f, value in zip(problem.composition.shared, point.z, strict=True)
    ]
    pulls, weights = ((1.0 + SHARE) * a for a in (point.phases, point.weights))
    return problem, replace(point, z=np.array(z), phases=pulls, weights=weights)


def test_the_motion_was_adjusted(base):
    assert np.abs(base.problem.offset).max() > 0.0


def test_residuals_in_units_of_the_reading_are_the_same(base, larger):
    problem, point = larger
    np.testing.assert_allclose(problem.evaluate(point).residual, base.residual, atol=1e-9 * base.strength)


def test_so_added_mass_gains_nothing(base, larger):
    assert refit(*larger, base).cost == pytest.approx(base.cost, abs=2.0)
