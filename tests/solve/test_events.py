"""Onset and arrest: roots of the solver's dense output, the same inside the integration and after it."""

from __future__ import annotations

import diffrax
import jax
import numpy as np
import optimistix
import pytest

from stickslip.simulation.scenario.drive import Motion
from stickslip.simulation.scenario.events import find_events
from stickslip.simulation.solve import Tolerance, Trajectory, integrate
from stickslip.simulation.solve.by_diffrax import step_control
from stickslip.simulation.solve.stepper import ContactStepper

from .rig import STRENGTH, rig, tighter
from .slip_differences import brute_slips

V0 = 5e-5  # m/s
MOTION = Motion(np.array([0.0, 1.0]), np.array([0.0, V0]), None, ())


def events(trajectory: Trajectory):
    return find_events(trajectory, MOTION, STRENGTH)


@pytest.fixture(scope="module")
def shortly_before():
    """The rig's first slip, from a state in the quiet creep before it."""
    _, state = integrate(rig(), 5.14)
    return state, integrate(rig(), 5.3, t0=5.14, state=state)[0]


@pytest.mark.slow
@pytest.mark.parametrize(("field", "rising"), [("onset", True), ("arrest", False)])
def test_an_event_of_diffrax_ends_the_integration_there(field, rising, shortly_before):
    state, trajectory = shortly_before
    solution = jax.jit(
        lambda model: diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, y, args: y), ContactStepper(Tolerance()), 5.14, 5.3, 1e-5, state,
            args=(model, model.shaped()), saveat=diffrax.SaveAt(t1=True, fn=lambda t, y, args: (t, y.v)),
            stepsize_controller=step_control(0.02), adjoint=diffrax.ForwardMode(), max_steps=4096,
            event=diffrax.Event(lambda t, y, args, **kwargs: y.v - V0, optimistix.Bisection(1e-13, 1e-13),
                                direction=rising),
        ).ys
    )(rig())  # fmt: skip
    t, v = (float(a[0]) for a in solution)
    assert v == pytest.approx(V0, abs=1e-9)
    assert getattr(events(trajectory), field)[0] == pytest.approx(t, abs=1e-9)


@pytest.mark.slow
def test_times_and_peaks_lie_between_the_steps():
    """Three slips by coarse steps; taken at the steps, peaks would be low by up to a thousandth."""
    trajectory, _ = integrate(rig(), 7.1, tolerance=tighter(0.1))
    found, t = events(trajectory), trajectory.steps.t
    assert found.number == 3
    for moment in (*found.onset, *found.arrest):
        assert trajectory.at(np.array([moment])).v == pytest.approx(V0, abs=1e-12)
        assert np.min(np.abs(t - moment)) > 1e-6
    low = []
    for onset, arrest, peak in zip(found.onset, found.arrest, found.peak_velocity, strict=True):
        assert peak == pytest.approx(np.max(trajectory.at(np.linspace(onset, arrest, 100_001)).v), rel=1e-6)
        low.append(1.0 - np.max(trajectory.steps.v[(t > onset) & (t < arrest)]) / peak)
    assert max(low) > 1e-5


@pytest.mark.slow
def test_durations_and_sizes_are_known_far_below_a_step():
    """Duration and slip against brute force with 0.25 us: a fiftieth of a step, and better with the tolerance."""
    expected = brute_slips(np.zeros(10), 2.5e-7)
    wrong = []
    for factor in (1.0, 10.0, 100.0):
        trajectory, _ = integrate(rig(), 7.1, tolerance=tighter(factor))
        found, steps = events(trajectory), trajectory.steps.t
        at = np.searchsorted(steps, found.arrest)
        off = np.abs((found.arrest - found.onset) - (expected.arrest - expected.onset))
        assert np.all(off < 0.05 * (steps[at] - steps[at - 1]))
        assert found.slip == pytest.approx(expected.slip, rel=2e-3 / factor**0.8)
        assert found.peak_velocity == pytest.approx(expected.peak_velocity, rel=2e-3 / factor**0.5)
        wrong.append((np.max(off), np.max(np.abs(found.onset - expected.onset))))
    # each tenth of the tolerance takes a third or more off every error
    assert np.all(np.array(wrong[1:]) < np.array(wrong[:-1]) / 3.0)
    assert wrong[-1][0] < 1e-6
    assert wrong[-1][1] < 1e-4
