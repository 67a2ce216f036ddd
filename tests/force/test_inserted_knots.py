"""Knots between samples: where they lie, and what a law of the velocity holds after an arrest with them."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.inference.force import inserted_knots
from stickslip.inference.force.force_along_motion import along
from stickslip.inference.force.inserted_knots import Inserted
from stickslip.inference.force.later_ringing import Turns
from stickslip.physics.effects import catalogue
from stickslip.simulation.solve import Tolerance

from . import solver_motion

pytestmark = pytest.mark.slow

NONE = Turns(*(np.zeros(0) for _ in range(4)))  # it rings no more
RATE, END = 1e4, 1.4  # Hz, s


@pytest.fixture(scope="module")
def slips():
    """A block whose friction falls with velocity, and its steps: the motion is known between samples too."""
    law = eqx.tree_at(
        lambda e: (e.drop, e.velocity), catalogue.get("velocity-weakening")(), (jnp.asarray(0.12), jnp.asarray(2.2e-4))
    )
    return solver_motion.slipping(law, END, Tolerance(1e-4, 1e-12, 1e-9))


def after_arrests(slips) -> float:
    """By how much the law along the sampled motion holds too much in the first millisecond of rest (share of all)."""
    model, steps = slips
    problem, events = solver_motion.sampled(steps, RATE)
    run, way = problem.runs[0], problem.ways[0]
    held = np.asarray(jax.jit(along)(model, way).contact)[: run.t.size]
    off = held - np.interp(run.t, steps.t, steps.contact_force)
    strength = float(jnp.sum(model.bank.strength))
    arrests = [e.t_arrest for e in events[1:]]
    assert len(arrests) >= 2
    return max(abs(float(off[(run.t > a) & (run.t < a + 1e-3)].mean())) for a in arrests) / strength


def test_a_law_of_the_velocity_holds_what_the_solver_says_after_an_arrest(slips, monkeypatch):
    assert after_arrests(slips) < 3e-4
    monkeypatch.setattr(inserted_knots, "FINE", 1)  # samples alone, and where the block stands
    assert after_arrests(slips) > 8e-4


def parabola(arrest: float = 0.503, rate: float = 1e2):
    """A block that is braked evenly, comes to rest between two samples and goes back."""
    t = np.arange(0.0, 1.0, 1.0 / rate)
    return t, 1.0 - (t - arrest) ** 2, -2.0 * (t - arrest)


def test_knots_lie_on_the_motion_and_become_close_before_it_stands():
    t, x, v = parabola()
    found = Inserted.of(t, x, v, np.zeros(t.size, bool), np.array([0.5]), 0.2, NONE)
    at = found.between(t)
    assert found.x == pytest.approx(1.0 - (at - 0.503) ** 2, abs=1e-12)
    assert found.v == pytest.approx(-2.0 * (at - 0.503), abs=1e-12)
    stands = found.v == 0.0
    assert at[stands] == pytest.approx([0.503])
    whole = found.joined(t, at)
    assert (np.diff(whole) > 0.0).all()
    last = whole[(whole >= 0.503 - 0.05) & (whole <= 0.503)]
    assert np.diff(last).max() <= 0.2 / 100 + 1e-12
    assert (found.joined(x, found.x)[found.place] == x).all()
    assert not ((at < 0.44) | (at > 0.503 + 1e-12)).any()


def test_windows_have_no_knots_between():
    t, x, v = parabola()
    found = Inserted.of(t, x, v, np.ones(t.size, bool), np.array([0.5]), 0.2, NONE)
    assert found.before.size == 0 and found.size == t.size
