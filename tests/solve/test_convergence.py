"""The solver converges; what does not converge is the phase of ringing that nothing damps."""

from __future__ import annotations

import numpy as np
import pytest

from .convergence import (
    brute_onsets,
    event_orders,
    onset_scatter,
    oscillator_errors,
    second_event,
    slip_errors,
    slip_to_slip,
)
from .rig import order, tighter


def test_a_damped_oscillator_is_followed_exactly():
    assert np.max(oscillator_errors(np.array([60, 200, 400, 800, 1600]))) < 1e-10


def test_second_order_for_a_damped_oscillator_that_is_not_followed():
    """A law so steep in velocity that the steps are those of TR-BDF2; its force is too small to matter."""
    steps = np.array([200, 400, 800, 1600])
    errors = oscillator_errors(steps, followed=False)
    assert order(1.0 / steps, errors) == pytest.approx(2.0, abs=0.15)
    assert errors[-1] < 1e-3


@pytest.mark.slow
def test_second_order_within_a_slip():
    steps = np.array([125, 250, 500, 1000])
    errors = slip_errors(steps)
    assert order(1.0 / steps, errors) == pytest.approx(2.0, abs=0.15)
    assert errors[0] < 2e-8


@pytest.mark.slow
def test_second_order_from_slip_to_slip_wherever_in_a_step_elements_stick():
    steps = (1e-4, 5e-5, 2.5e-5, 1.25e-5)
    for name, (found, errors) in event_orders(steps).items():
        assert 1.85 < found < 2.15, name
        assert errors[-1] < 2e-6, name
    made = [slip_to_slip(step)["onset"] for step in steps[1:]]
    for onset in np.abs(np.array(made).mean(axis=1)).T:
        assert order(np.array(steps[1:]), onset) == pytest.approx(2.0, abs=0.15)
    assert np.all(made[0].std(axis=0) < 1e-6)


@pytest.mark.long
def test_event_quantities_converge_with_the_tolerance():
    exact = second_event(factor=3000.0)
    errors = np.abs(np.array([second_event(factor=f) for f in (1.0, 10.0, 100.0)]) / exact - 1.0)
    assert np.all(errors[0] < [1e-4, 1e-2, 5e-3, 1e-3])
    assert np.all(errors[2] < [1e-5, 1e-4, 1e-4, 1e-4])
    assert np.all(errors[2] < 0.2 * errors[0])


@pytest.mark.long
def test_event_quantities_converge_with_the_number_of_elements():
    exact = second_event(2048, 30.0)
    coarse = np.abs(second_event(32, 30.0) / exact - 1.0)
    fine = np.abs(second_event(256, 30.0) / exact - 1.0)
    assert np.all(fine < 1e-4)
    assert np.all(fine < coarse)
    assert np.all(np.abs(second_event(128, 30.0) / exact - 1.0) < 5e-4)


@pytest.mark.long
def test_undamped_ringing_decides_the_onset():
    """Kicks too small to matter, of another phase at each onset: milliseconds without damping, nothing with it."""
    kicks = np.linspace(0.0, 2e-6, 6)
    bare, weak, damped = (np.ptp(brute_onsets(c, kicks, dt=1e-5), axis=0) for c in (0.0, 1.0, 10.0))
    assert np.max(bare) > 1e-3
    assert np.max(weak) < 1e-9 and np.max(damped) < 1e-9
    assert np.max(np.ptp(onset_scatter(0.0, kicks, tighter(10.0)), axis=0)) > 1e-3


@pytest.mark.long
@pytest.mark.parametrize("damping, fall", [(1.0, 4.0), (10.0, 21.0)])
def test_onsets_of_a_damped_block_converge_whatever_the_kick(damping, fall):
    """Kicks shift the steps, and with them the errors: both fall with the tolerance, towards the leapfrog's onsets.

    At the second order by 21 times for a hundredth of the tolerance; the longer the block rings, the finer that begins.
    """
    kicks = np.linspace(0.0, 2e-6, 6)
    exact = brute_onsets(damping, kicks, dt=2.5e-6)
    rough, fine = (onset_scatter(damping, kicks, tighter(f)) for f in (10.0, 1000.0))
    assert np.abs(fine - exact).max() < np.abs(rough - exact).max() / fall
    assert np.ptp(fine, axis=0).max() < np.ptp(rough, axis=0).max() / fall
