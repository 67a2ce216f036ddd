"""The ringing that is not followed sample by sample: where the block turns, and what a law that goes with it holds."""

from __future__ import annotations

from itertools import pairwise

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.inference.force import later_ringing
from stickslip.inference.force.force_along_motion import along
from stickslip.inference.force.inserted_knots import Inserted
from stickslip.inference.force.later_ringing import later_turns
from stickslip.physics.effects import catalogue
from stickslip.simulation.solve import Tolerance

from . import solver_motion

RATE, PERIOD, DECAY = 1e4, 1.83e-3, 40.0  # Hz, s, 1/s
END = 0.9  # s


def ringing(amplitude: float, noise: float, seed: int = 0, phase: float = 0.4):
    """A block that rings down around a place that creeps, eight times; followed for twelve periods after an arrest."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 0.4, 1.0 / RATE)
    x = 2e-8 * t / t[-1] + amplitude * np.exp(-DECAY * t) * np.cos(2.0 * np.pi * t / PERIOD + phase)
    end = round(12 * PERIOD * RATE)
    records = [x + rng.normal(0.0, noise, t.size) for _ in range(8)]
    time = np.arange(8 * t.size) / RATE
    stretches = [(end + i * t.size, (i + 1) * t.size) for i in range(8)]
    return time, np.concatenate(records), stretches, amplitude * np.exp(-DECAY * t[end])


@pytest.mark.parametrize("noise", [1e-12, 1.5e-9])
def test_the_way_that_is_left_is_that_of_an_exponential_decay(noise):
    t, x, ends, amplitude = ringing(15e-9, noise)
    found = later_turns(t, x, ends, PERIOD, noise)
    own = found.begin == t[ends[0][0]]
    way = 2.0 * np.abs(found.away[own]).sum()
    left = 4.0 * amplitude / (DECAY * PERIOD)
    last = later_ringing.LAST
    assert way == pytest.approx((1.0 - last) * left, rel=0.03 if noise < 1e-10 else 0.2)
    assert np.diff(found.t[own]) == pytest.approx(0.5 * PERIOD)
    assert (np.sign(found.away[own][1:]) == -np.sign(found.away[own][:-1])).all()
    exact = np.cos(2.0 * np.pi * found.t[own] / PERIOD + 0.4)
    assert (np.sign(found.away[own]) * exact).min() > (0.99 if noise < 1e-10 else 0.8)


def test_noise_does_not_ring():
    for seed in range(20):
        t, x, ends, _ = ringing(0.0, 2e-9, seed)
        assert later_turns(t, x, ends, PERIOD, 2e-9).t.size < 20
    assert later_turns(t, x, ends, 0.0, 2e-9).t.size == 0


def test_where_the_block_creeps_faster_than_it_rings_it_does_not_turn():
    t, x, ends, _ = ringing(15e-9, 1e-12)
    found = later_turns(t, x, ends[:1], PERIOD, 1e-12)
    first = t[ends[0][0]]
    windows = np.array([first, first + 0.04, first + 0.08])
    slow = np.array([False, True, True])
    for way, some in ((1e-9, True), (1e-5, False)):
        before, share, at, speed = found.knots(windows, way * np.arange(3.0), slow, PERIOD)
        assert (before.size > 10) == some
        assert (speed == 0.0).all() and ((share > 0.0) & (share < 1.0)).all() and at.size == before.size
    samples = found.knots(windows, np.zeros(3), np.zeros(3, bool), PERIOD)
    assert samples[0].size == 0


@pytest.fixture(scope="module")
def replaced():
    """A block whose junctions are replaced along its way, and its steps."""
    law = eqx.tree_at(lambda e: e.rate, catalogue.get("contact-renewal")(), jnp.asarray(2e4))
    return solver_motion.slipping(law, END, Tolerance(1e-6, 1e-14, 1e-11))


def before_onsets(replaced) -> float:
    """By how much the law along the sampled motion holds too much before an onset, in shares of what renewal takes."""
    model, steps = replaced
    problem, events = solver_motion.sampled(steps, RATE)
    run, way = problem.runs[0], problem.ways[0]
    without = eqx.tree_at(lambda m: m.effects[0].rate, model, jnp.asarray(0.0))
    held, kept = (np.asarray(jax.jit(along)(m, way).contact)[: run.t.size] for m in (model, without))
    late = np.zeros(run.t.size, bool)
    for before, event in pairwise(events):
        late |= (run.t > 0.5 * (before.t_arrest + event.t_onset)) & (run.t < event.t_onset - 0.1 * event.duration)
    assert late.sum() > 20
    off = held - np.interp(run.t, steps.t, steps.contact_force)
    return float(np.mean(off[late]) / np.mean((kept - held)[late]))


@pytest.mark.slow
def test_junctions_are_replaced_on_the_way_of_the_ringing_too(replaced, monkeypatch):
    assert abs(before_onsets(replaced)) < 0.06
    monkeypatch.setattr(later_ringing, "DETECTED", 1e9)  # none of it
    assert before_onsets(replaced) > 0.12


def test_knots_come_in_only_between_windows():
    t = np.linspace(0.0, 1.0, 11)
    none = later_turns(t, t, [], 0.1, 1e-12)
    found = Inserted.of(t, np.zeros(11), np.zeros(11), np.ones(11, bool), np.array([0.5]), 0.2, none)
    assert found.size == t.size
