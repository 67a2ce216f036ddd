"""The velocity at the knots of a creep and a nucleation, beside that of the solver, through a sensor that counts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from stickslip.inference.force import smoothing
from stickslip.inference.force.smoothing import crept

from .counted_motions import Moved, moved, read

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def motion() -> Moved:
    """The base model at 100 um/s."""
    return moved(1e-4, 6.0)


def off(motion: Moved) -> np.ndarray:
    """Relative errors of velocities from 1 to 30 um/s, in the later part of sticks."""
    campaign = read([motion], seed=2)
    (run,) = campaign.prepare().problem.runs
    events = campaign.events[0].events
    late = np.zeros(run.t.size, bool)
    for before, event in pairwise(events):
        late |= (run.t > 0.5 * (before.t_arrest + event.t_onset)) & (run.t < event.t_onset)
    true = motion.course(run.t, 1)
    own = late & (true > 1e-6) & (true < 3e-5)
    assert own.sum() > 60
    return run.v[own] / true[own] - 1.0


def test_a_slow_velocity_is_found_through_the_counts_of_the_sensor(motion, monkeypatch):
    error = off(motion)
    assert np.sqrt(np.mean(error**2)) < 0.12 and abs(np.mean(error)) < 0.06
    monkeypatch.setattr(smoothing, "STEPS", np.inf)  # over two periods of the ringing, and from window to window
    assert np.sqrt(np.mean(off(motion) ** 2)) > 2.0 * np.sqrt(np.mean(error**2))


def test_a_polynomial_has_its_own_slope_and_a_stretch_ends_it():
    t = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 60))
    x = 1.0 + 0.3 * t + 2e-3 * t**2 + 1e-5 * t**3
    speed = np.full(60, np.nan)
    stretch = np.where(np.arange(60) < 30, 0, 1)
    kink = np.where(t > t[30], x + 5.0 * (t - t[30]), x)
    found = crept(t, kink, np.ones(60), stretch, speed, 0.2, speed, 1e-3)
    true = 0.3 + 4e-3 * t + 3e-5 * t**2
    assert found[:30] == pytest.approx(true[:30], rel=1e-9)
    assert found[31:] == pytest.approx(true[31:] + 5.0, rel=1e-9)


def test_a_creep_that_grows_towards_its_onset_is_as_fast_as_it_is():
    """The rate is that of the inverse of the time left, from a thousand periods to one."""
    left = np.geomspace(1.0, 1e-3, 40)
    x, onset = -2e-8 * np.log(left), np.zeros(40)
    found = crept(-left, x, np.ones(40), np.zeros(40, int), onset, 8e-9, np.full(40, np.nan), 1e-4)
    assert found == pytest.approx(2e-8 / left, rel=5e-3)


def test_a_stretch_in_which_it_does_not_move_far_keeps_what_is_known():
    t, x = np.arange(20.0), 1e-3 * np.arange(20.0)
    speed = np.full(20, 7.0)
    none = np.full(20, np.nan)
    assert (crept(t, x, np.ones(20), np.zeros(20, int), none, 1.0, speed, 1e-3) == 7.0).all()
    assert (crept(t, 1e3 * x, np.ones(20), np.full(20, -1), none, 1.0, speed, 1e-3) == 7.0).all()
