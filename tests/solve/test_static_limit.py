"""The slow drive gives the static curve, at the rates that the equations predict."""

from __future__ import annotations

import numpy as np
import pytest

from .rig import order
from .static_limit import base_law, base_law_prediction, breakaway_lag, constant_friction


def test_constant_friction_approaches_the_static_curve_with_the_square_of_the_velocity():
    velocities = np.array([8e-4, 1.6e-3, 3.2e-3])
    errors = np.array([constant_friction(v).error.max() for v in velocities])
    assert 1.9 < order(velocities, errors) < 2.1


def test_base_law_approaches_it_linearly_with_the_predicted_coefficient():
    velocities = np.array([2.5e-5, 5e-5, 1e-4, 2e-4])
    seen = [base_law(v) for v in velocities]
    assert order(velocities, np.array([d.error.max() for d in seen])) == pytest.approx(1.0, abs=0.06)
    for v, d in zip(velocities, seen, strict=True):
        for w in (0.2, 0.3, 0.4, 0.49):
            assert np.interp(w, d.w, d.error) == pytest.approx(base_law_prediction(v, w), rel=0.1)


@pytest.mark.parametrize("velocity", [1e-4, 4e-4, 1.6e-3])
def test_the_last_element_slides_late_by_the_width_of_the_boundary_layer(velocity):
    lag, scale = breakaway_lag(velocity)
    assert 0.8 < lag / scale < 1.0
