"""Ringing of the block on its contact."""

from __future__ import annotations

import numpy as np
import pytest

from .ringing import frequency, microslip


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [20e-9, 50e-9])
def test_microslip_alone_damps_hyperbolically(amplitude):
    ringing, law = microslip(amplitude)
    assert len(ringing.t) > 50
    assert ringing.amplitude == pytest.approx(law, rel=0.05)
    assert ringing.amplitude[-1] < 0.5 * ringing.amplitude[0]
    # an exponential through the start and the end would be off in between
    middle = len(law) // 2
    exponential = np.sqrt(ringing.amplitude[0] * ringing.amplitude[2 * middle - 1])
    assert abs(exponential / ringing.amplitude[middle] - 1.0) > 0.05


@pytest.mark.parametrize("spring_stiffness", [1000.0, pytest.param(1e5, marks=pytest.mark.slow)])
def test_ring_frequency_is_that_of_the_virgin_contact(spring_stiffness):
    seen, expected = frequency(spring_stiffness=spring_stiffness)
    assert seen == pytest.approx(expected, rel=0.02)
