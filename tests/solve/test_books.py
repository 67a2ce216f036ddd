"""Energy is kept, and the contact remembers its turning points."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.physics.contact import Hysteresis
from stickslip.physics.effects.wear import Wear
from stickslip.simulation.solve import integrate

from .energy_balance import imbalance, slow_cycle
from .rig import STRENGTH, rig, tighter
from .slip_events import run


@pytest.mark.slow
def test_energy_balance_closes():
    """Work of the spring = kinetic + stored + lost in friction + lost in damping, through a slip and its ringing."""
    made = run(rig(), 5.6, tighter(1000.0))
    s = made.trajectory.steps
    assert len(made.events.onset) == 1
    assert np.max(np.abs(imbalance(s))) < 1e-6
    assert made.trajectory.stats.energy_error < 1e-6
    # every term takes part
    assert min(s.friction_work[-1], s.viscous_work[-1], np.max(s.stored)) > 1e-3 * s.spring_work[-1]


def test_energy_balance_at_the_default_tolerance():
    made = run(rig(), 5.6)
    assert np.max(np.abs(imbalance(made.trajectory.steps))) < 2e-6


@pytest.mark.slow
@pytest.mark.parametrize("drift", [0.4, -0.4])
def test_energy_balance_closes_while_wear_changes_the_stiffness(drift):
    """What loaded elements store more or less because their stiffness changed is in the books."""
    worn = Wear(drift=drift, path=5e-5, changes="thresholds")
    trajectory, state = integrate(rig(effects=(worn,)), 6.5, tolerance=tighter(100.0))
    s = trajectory.steps
    assert trajectory.stats.energy_error < 1e-5
    # far more than that is at stake
    assert abs(s.body_work[-1]) > 1e-3 * s.spring_work[-1]
    assert np.max(np.abs(imbalance(s))) > 1e-3
    assert float(state.stiffness.sum()) == pytest.approx(
        float(rig().bank.total_stiffness) / (1.0 + drift * float(state.memory[0]) / 5e-5), rel=1e-9
    )


def test_slow_cycles_obey_masing_and_forget_closed_loops():
    cycle = slow_cycle()
    s = cycle.steps
    assert s.contact_force == pytest.approx(cycle.force, abs=1e-8 * STRENGTH)
    turned = np.count_nonzero(np.diff(np.sign(s.v[s.v != 0.0])))
    assert turned == 3
    assert cycle.remembered == 1
    # the branch that is left after the inner loop is the one that was interrupted: as if the loop had never been
    backbone = rig().bank.backbone
    never = Hysteresis(backbone)
    never.move_to(float(np.max(s.x)))
    assert never.move_to(float(s.x[-1])) == pytest.approx(s.contact_force[-1], abs=1e-7 * STRENGTH)
