"""Rate-and-state friction against an independent integration (scipy) and the known critical stiffness."""

import numpy as np
import pytest

from tests.effects.rate_and_state_errors import (
    LAWS,
    STABILITIES,
    growth_beside_the_critical_stiffness,
    slide_hold_slide,
    steady_sliding,
    stick_slip,
    velocity_steps,
)

ONE_QUICK = ["ageing", pytest.param("slip", marks=pytest.mark.slow)]


@pytest.mark.parametrize("law", LAWS)
def test_velocity_steps(law):
    error, change = velocity_steps(law)
    assert change > 0.03
    assert error < 1e-8


@pytest.mark.parametrize("law", LAWS)
def test_steady_sliding_weakens_by_b_minus_a(law):
    assert steady_sliding(law) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_slide_hold_slide(law):
    force, peak, change, healing = slide_hold_slide(law)
    assert change > 0.15 and healing > 0.04
    assert force < 1e-4
    assert peak < 1e-5


@pytest.mark.parametrize("law", ONE_QUICK)
def test_stick_slip(law):
    times, displacement, force, bursts, slip, quiet = stick_slip(law)
    assert bursts >= 3 and slip > 2e-4 and quiet > 0.5
    assert times < 1e-5
    assert displacement < 1e-5
    assert force < 1e-4


@pytest.mark.parametrize("law", ONE_QUICK)
def test_critical_stiffness(law):
    for stability, (found, expected) in zip(STABILITIES, growth_beside_the_critical_stiffness(law), strict=True):
        assert np.sign(np.round(expected.real, 6)) == np.sign(1.0 - stability)
        assert abs(found.real - expected.real) < 1e-4
        assert found.imag == pytest.approx(expected.imag, rel=1e-4)
