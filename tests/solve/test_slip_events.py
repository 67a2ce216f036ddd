"""Slip events against the classical block on a spring, and the creep that follows them."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.physics.contact import arrest, reload_displacement
from stickslip.simulation.solve import integrate

from .rig import STRENGTH, bank, rig, tighter
from .slip_events import classical, creep_to, critical_velocity, growth, run


@pytest.mark.parametrize("damping", [0.0, 10.0])
def test_constant_friction_never_slips(damping):
    s = run(rig(ratio=1.0, damping=damping), 12.0).trajectory.steps
    # the spring never gives back what a slip would release, and the block ends up sliding with the drive
    assert np.max(np.maximum.accumulate(s.spring_force) - s.spring_force) < 0.01 * STRENGTH
    assert s.x[-1] > 3e-4
    assert np.max(s.v) < 2.0 * 5e-5 + 1e-12


@pytest.fixture(scope="module")
def slightly_damped():
    return run(rig(damping=0.5), 8.0)


def test_slip_is_that_of_a_block_on_a_spring():
    """Damped so that its ringing sets off no slip early: at 0.5 N s/m the first peak is low by 10.1 % (brute force)."""
    made = run(rig(damping=2.0), 8.0)
    events, s = made.events, made.trajectory.steps
    expected = classical(1000.0, 2.0)
    assert len(events.onset) >= 2
    assert events.size == pytest.approx(expected.slip, rel=0.1)
    assert events.arrest - events.onset == pytest.approx(expected.duration, rel=0.1)
    assert events.peak == pytest.approx(expected.peak, rel=0.1)
    assert np.interp(events.arrest, s.t, s.spring_force) == pytest.approx(expected.left, rel=0.1)
    assert events.recurrence == pytest.approx(expected.slip / 5e-5 + expected.duration, rel=0.1)


def test_sliding_is_stable_above_the_critical_velocity_only():
    expected = critical_velocity()
    shares = np.array([0.9, 0.95, 1.05, 1.1])
    rates = np.array([growth(share * expected) for share in shares])
    assert np.all(rates[:2] > 0.0)
    assert np.all(rates[2:] < 0.0)
    seen = np.interp(0.0, -rates, shares)
    assert seen == pytest.approx(1.0, abs=0.1)
    assert expected == pytest.approx(np.sqrt(0.15 * STRENGTH * 5e-5 / 0.5) - 5e-5, rel=0.1)


@pytest.mark.parametrize(("ratio", "factor"), [(0.85, 5.7), (0.70, 2.6)])
def test_creep_after_an_event_is_smaller_by_the_known_factor(ratio, factor, slightly_damped):
    """The factors are those of a contact that stopped at 2 F_k - F_s with every element at its kinetic cap."""
    made = slightly_damped if ratio == 0.85 else run(rig(damping=0.5, ratio=ratio), 9.0)
    virgin, *later = creep_to(made, 1e-6)
    assert len(later) >= 1
    assert virgin / np.array(later) == pytest.approx(factor, rel=0.1)
    static = bank()
    held = arrest(static, ratio).element_force
    load = 0.99 * STRENGTH
    ratio_of_curves = reload_displacement(static, 0.0 * held, load) / reload_displacement(static, held, load)
    assert float(ratio_of_curves) == pytest.approx(factor, rel=0.02)


def test_later_creep_follows_the_static_curve_of_the_residual_forces():
    model = rig(damping=2.0)
    first = run(model, 8.0, tighter(10.0)).events
    settled = float(first.arrest[0]) + 0.5
    _, state = integrate(model, settled, tolerance=tighter(10.0))
    trajectory, _ = integrate(model, 8.0, t0=settled, state=state, tolerance=tighter(10.0))
    s = trajectory.steps
    creeping = (s.spring_force < 0.95 * STRENGTH) & (s.t < first.onset[1])
    # the caps are rested again, and what the slip left in the elements decides the curve
    static = np.asarray(reload_displacement(model.bank, state.force, s.spring_force[creeping]))
    virgin = np.asarray(reload_displacement(model.bank, 0.0 * state.force, s.spring_force[creeping]))
    assert static.max() > 3e-8
    assert s.x[creeping] - s.x[0] == pytest.approx(static, abs=1e-10)
    assert np.ptp(virgin) > 3.0 * np.ptp(static)
