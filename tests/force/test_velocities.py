"""The velocity at the knots of a creep and a nucleation, beside that of the solver, through a sensor that counts."""

from __future__ import annotations

from itertools import pairwise

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import stickslip as ss
from stickslip.inference.force import smoothing
from stickslip.inference.force.smoothing import crept
from stickslip.simulation.conformance.rig import base_model
from stickslip.simulation.solve import Tolerance, integrate

SPEED, RATE, END = 1e-4, 1e4, 6.0  # m/s, Hz, s
COUNT, NOISE = 7.9e-9, 1.3e-9  # m
RIG = {"mass": "0.0894 kg", "spring_stiffness": "1000 N/m", "contacts": 4, "normal_force": "0.31 N"}


@pytest.fixture(scope="module")
def motion():
    """The base model, and until when it was simulated (s)."""
    times = np.array([0.0, END])
    model = eqx.tree_at(
        lambda m: (m.load_point.times, m.load_point.positions, m.block.mass, m.block.spring_stiffness),
        base_model(()), tuple(jnp.asarray(a) for a in (times, times * SPEED, 0.0894, 1000.0)),
    )  # fmt: skip
    steps = integrate(model, END, tolerance=Tolerance(1e-4, 1e-12, 1e-9), largest_step=4e-3)[0].steps
    return CubicHermiteSpline(steps.t, steps.x, steps.v), float(steps.t[-1])


def off(motion) -> np.ndarray:
    """Relative errors of velocities from 1 to 30 um/s, in the later part of sticks."""
    course, end = motion
    t = np.arange(0.0, end, 1.0 / RATE)
    read = course(t) + NOISE * np.random.default_rng(2).standard_normal(t.size)
    trace = ss.Trace.from_arrays(
        "run", time=t, displacement=COUNT * np.round(read / COUNT), drive_velocity=SPEED, resolution=COUNT
    )
    campaign = ss.Campaign.from_traces(
        [trace], {**RIG, "friction_coefficient": {"guess": 0.21, "lower": 0.15, "upper": 0.3}}
    )
    (run,) = campaign.prepare().problem.runs
    events = campaign.events[0].events
    late = np.zeros(run.t.size, bool)
    for before, event in pairwise(events):
        late |= (run.t > 0.5 * (before.t_arrest + event.t_onset)) & (run.t < event.t_onset)
    true = course(run.t, 1)
    own = late & (true > 1e-6) & (true < 3e-5)
    assert own.sum() > 80
    return run.v[own] / true[own] - 1.0


def test_a_slow_velocity_is_found_through_the_counts_of_the_sensor(motion, monkeypatch):
    error = off(motion)
    assert np.sqrt(np.mean(error**2)) < 0.12 and abs(np.mean(error)) < 0.06
    monkeypatch.setattr(smoothing, "STEPS", np.inf)  # over two periods of the ringing, and from window to window
    assert np.sqrt(np.mean(off(motion) ** 2)) > 0.3


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
