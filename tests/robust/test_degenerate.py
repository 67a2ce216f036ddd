"""Physics at the edge: the right answer, where one is known, or a refusal in words."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import Bank, power_law_bank
from stickslip.physics.effects.load_modulation import LoadModulation
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.simulation.scenario.load import make_scenario
from stickslip.simulation.solve import Tolerance, integrate

N, STRENGTH, U_MAX, P, SPRING = 32, 0.26, 1e-6, 2.0, 1000.0
FINE = Tolerance(1e-4, 1e-13, 1e-9)
BANK = power_law_bank(STRENGTH, U_MAX, P, n=N)


def model(*pieces, mass=0.1, spring=SPRING, damping=10.0, bank=BANK, ratio=0.85, healing=0.02, effects=()):
    """Load point through pieces (s, m/s); always three, so that all rigs compile to one program."""
    pieces = [*pieces, *[(1e6, pieces[-1][1])] * (3 - len(pieces))]
    times = np.concatenate([[0.0], np.cumsum([d for d, _ in pieces])])
    positions = np.concatenate([[0.0], np.cumsum([d * v for d, v in pieces])])
    points = LoadPoint(jnp.asarray(times), jnp.asarray(positions))
    return Model(Block(mass, spring, damping), bank, Weakening(ratio, 1e-6, healing), points, effects)


def backbone(bank: Bank, u):
    """Force of a virgin bank at a displacement (m)."""
    k, cap = np.asarray(bank.stiffness), np.asarray(bank.strength)
    return np.minimum(k * np.atleast_1d(u)[:, None], cap).sum(axis=1)


@pytest.mark.slow
def test_a_drive_that_stands_still_moves_nothing():
    trajectory, _ = integrate(model((1.0, 0.0)), 10.0)
    s = trajectory.steps
    assert np.all(s.x == 0.0)
    assert np.all(s.contact_force == 0.0)
    assert s.psi == pytest.approx(1.0, abs=1e-12)
    assert trajectory.stats.energy_error == 0.0


def test_events_of_a_drive_that_stands_still_are_refused():
    content = {
        "schema": 1, "block": {"mass": 0.1, "spring_stiffness": 1e3}, "drive": {"velocity": 0.0, "events": 3},
        "contact": {"kind": "power-law", "normal_force": 1, "friction_coefficient": 0.2, "u_max": 1e-6, "p": 2.0},
    }  # fmt: skip
    with pytest.raises(InputError, match="without drive motion there is no slip"):
        make_scenario(content)
    no_load = {
        **content,
        "drive": {"velocity": 1e-4, "duration": 1},
        "contact": {**content["contact"], "normal_force": 0},
    }
    with pytest.raises(InputError, match="out of range") as caught:
        make_scenario(no_load)
    assert "normal_force" in str(caught.value)


@pytest.mark.parametrize("empty", ["no spring of the contact touches", "all contacts unloaded"])
def test_without_contact_the_block_is_a_driven_oscillator(empty):
    """x = v t - (v/w_d) e^(-zeta w t) sin(w_d t) + ... of a damped oscillator whose spring's end moves at v."""
    k = np.zeros(N) if empty.startswith("no spring") else np.asarray(BANK.stiffness)
    bank = Bank(jnp.asarray(k), jnp.zeros(N))
    m, c, v = 0.1, 2.0, 1e-3
    trajectory, state = integrate(model((1.0, v), mass=m, damping=c, bank=bank), 0.5, tolerance=FINE)
    t = np.linspace(0.01, 0.5, 200)
    w, lag = np.sqrt(SPRING / m), c / SPRING
    zeta = c / (2.0 * np.sqrt(SPRING * m))
    wd = w * np.sqrt(1 - zeta**2)
    a, b = v * lag, (v * lag * zeta * w - v) / wd
    want = v * (t - lag) + np.exp(-zeta * w * t) * (a * np.cos(wd * t) + b * np.sin(wd * t))
    assert trajectory.at(t).x == pytest.approx(want, abs=2e-3 * v / w)
    assert np.all(np.asarray(state.force) == 0.0)
    assert np.all(trajectory.steps.friction_work == 0.0)


def test_friction_that_grows_with_slip_is_refused():
    with pytest.raises(InputError, match="weakening") as caught:
        integrate(model((1.0, 1e-4), ratio=1.2), 1.0)
    assert caught.value.exit_code == 2
    assert "0 ... 1" in str(caught.value)


def test_a_mass_so_small_that_all_is_quasi_static():
    """Constant friction: at every step the spring's force is the contact's, the virgin backbone, and the damper's.

    Within a step in which a spring begins to slide the cubic that is drawn is off by up to the step's tolerance.
    """
    v = 1e-4
    trajectory, _ = integrate(model((1.0, v), mass=1e-9, damping=0.01, ratio=1.0), 2.4, tolerance=FINE)
    t = np.linspace(0.05, 2.4, 60)
    at = trajectory.at(t)
    s = trajectory.steps
    assert s.t.size > 100
    assert backbone(BANK, s.x) == pytest.approx(SPRING * (v * s.t - s.x) - 0.01 * s.v, abs=1e-6 * STRENGTH)
    assert np.all(np.diff(at.x) > 0)


def test_a_mass_so_large_that_it_never_sticks():
    """A block of a tonne at the drive's speed: friction and spring change its speed by far less than itself.

    From full sliding, friction at its kinetic value: m dv/dt = c_s (v0 t - x) - F_k - c v, F_k in steady sliding.
    """
    v, mass = 1e-2, 1e3
    rig = model((1.0, v), mass=mass, damping=0.0, ratio=0.85)
    trajectory, _ = integrate(rig, 20.0, state=rig.rest(v=v), tolerance=FINE)
    s = trajectory.steps
    assert np.min(s.v) > 0.0
    psi = 1.0 / (1.0 + v * 0.02 / 1e-6)
    kinetic = STRENGTH * (0.85 + 0.15 * psi)
    w = np.sqrt(SPRING / mass)
    t = np.linspace(1.0, 20.0, 100)
    want = v * t - kinetic / SPRING * (1.0 - np.cos(w * t))
    assert trajectory.at(t).x == pytest.approx(want, abs=2e-3 * kinetic / SPRING)


@pytest.mark.slow
def test_a_drive_that_turns_follows_masing():
    """Slowly there and back, constant friction: on the way back twice the virgin curve at half the distance."""
    v = 1e-6
    rig = model((260.0, v), (400.0, -v), ratio=1.0, damping=100.0)
    trajectory, _ = integrate(rig, 600.0, stops=(260.0,), tolerance=FINE, largest_step=1.0)
    turn = trajectory.at(np.array([260.0]))
    t = np.linspace(265.0, 600.0, 50)
    at = trajectory.at(t)
    masing = turn.contact_force - 2.0 * backbone(BANK, (turn.x - at.x) / 2.0)
    assert at.contact_force == pytest.approx(masing, abs=2e-4 * STRENGTH)
    assert at.contact_force[-1] < 0.0


@pytest.mark.slow
def test_a_load_that_swings_through_zero():
    """Depth one: each period the caps fall to zero and the block follows the spring; laws and books hold."""
    wobble = LoadModulation(depth=1.0, frequency=5.0)
    trajectory, state = integrate(
        model((1.0, 1e-4), effects=(wobble,), ratio=1.0), 3.0, tolerance=Tolerance(1e-3, 1e-12, 1e-8), largest_step=1e-3
    )
    s = trajectory.steps
    assert all(np.isfinite(part).all() for part in s)
    assert trajectory.stats.energy_error < 1e-2
    assert np.all(np.asarray(state.force) ** 2 <= np.asarray(state.cap) ** 2 * (1 + 1e-9))
    force = np.abs(s.contact_force)
    assert np.max(force) <= 2.0 * STRENGTH * (1 + 1e-9)
    # once in every period the contact lets go, and the block arrives where the spring has no force
    for period in range(3, 14):
        inside = (s.t >= period / 5.0) & (s.t < (period + 1) / 5.0)
        assert np.min(force[inside]) < 1e-3 * STRENGTH


def test_a_load_that_would_become_negative_is_refused():
    content = {
        "schema": 1, "block": {"mass": 0.1, "spring_stiffness": 1e3}, "drive": {"velocity": 1e-4, "duration": 1},
        "contact": {"kind": "power-law", "normal_force": 1, "friction_coefficient": 0.2, "u_max": 1e-6, "p": 2.0},
        "effect": [{"type": "load-modulation", "depth": 1.5, "frequency": 5.0}],
    }  # fmt: skip
    with pytest.raises(InputError, match="depth"):
        make_scenario(content)
