"""The solver agrees with a simulation that shares nothing with it."""

from __future__ import annotations

import numpy as np
import pytest

from . import brute_force
from .comparison import creep_gaps, pair, rough_contact
from .rig import DEFAULT, MASS, bank, drive, rig, slips, tighter
from .slip_events import run


def test_brute_force_is_right_about_a_free_oscillation():
    path = brute_force.simulate(
        np.array([5e5]), np.array([1e9]), duration=0.05, mass=MASS, spring_stiffness=1000.0, damping=4.0, ratio=1.0,
        slip_distance=1.0, healing_time=1.0, times=[0.0, 1.0], positions=[0.0, 0.0], v=1e-3,
    )  # fmt: skip
    decay = 4.0 / (2.0 * MASS)
    omega = np.sqrt(501e3 / MASS - decay**2)
    exact = 1e-3 / omega * np.exp(-decay * path.t) * np.sin(omega * path.t)
    assert path.x == pytest.approx(exact, abs=1e-5 * np.max(exact))


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [DEFAULT, tighter(10.0)], ids=["default", "tight"])
def test_events_and_creep_agree_for_a_rough_line(tolerance):
    """One line, all its springs on the one side, 128 elements on the other."""
    _agree(pair(*rough_contact(1, 512, 0.7, 1e-6, bins=128), 7.2, tolerance))


@pytest.mark.long
def test_events_and_creep_agree_for_the_rig():
    """Four contacts of 4096 springs each; 256 elements, because the last springs of a single line slide one by one."""
    _agree(pair(*rough_contact(4, 4096, 0.3, 2.46e-6, bins=256), 7.2, tighter(10.0)))


def _agree(both):
    seen, expected = both.made.events, both.reference
    within = 1e-3 * np.mean(expected.recurrence)
    assert len(seen.onset) == len(expected.onset) >= 3
    assert seen.onset == pytest.approx(expected.onset, abs=within)
    assert seen.arrest == pytest.approx(expected.arrest, abs=within)
    assert seen.recurrence == pytest.approx(expected.recurrence, abs=within)
    assert seen.peak == pytest.approx(expected.peak, rel=5e-3)
    for _, gap in creep_gaps(both):
        assert np.max(np.abs(gap)) < 1e-9


@pytest.mark.slow
def test_holds_steps_of_velocity_and_reversal_agree():
    """Slip, hold of 1.5 s, pull backwards until it slips that way; then at twice the speed."""
    load_point = drive((5.5, 5e-5), (1.5, 0.0), (2.4, -2e-4), (FAR_ENOUGH, -4e-4))
    b = bank()
    path = brute_force.simulate(
        b.stiffness, b.strength, duration=10.2, mass=MASS, spring_stiffness=1000.0, damping=10.0, ratio=0.85,
        slip_distance=1e-6, healing_time=0.02, times=load_point.times, positions=load_point.positions, every=50,
    )  # fmt: skip
    stops = [float(t) for t in load_point.times[1:4]]
    made = run(rig(load_point=load_point), 10.2, tighter(10.0), stops=stops)
    s = made.trajectory.steps
    for sign, number in ((1.0, 1), (-1.0, 3)):
        expected, seen = slips(path.t, sign * path.x, sign * path.v), slips(s.t, sign * s.x, sign * s.v)
        assert len(seen.onset) == len(expected.onset) >= number
        assert seen.onset == pytest.approx(expected.onset, abs=2e-4)
        assert seen.arrest == pytest.approx(expected.arrest, abs=2e-4)
    assert all(np.any(s.t == stop) for stop in stops)
    held = (s.t > 6.0) & (s.t <= 7.0)
    assert np.ptp(s.x[held]) < 1e-10
    # the hold is stepped over
    assert np.min(np.diff(s.t[held])[:-1]) >= 0.01
    before = path.t < 5.1
    assert made.trajectory.at(path.t[before]).x == pytest.approx(path.x[before], abs=1e-9)


FAR_ENOUGH = 10.0
