"""The contact after a slip event: residual forces, rebound, and the creep that is left."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import (
    arrest,
    arrest_force,
    loading_displacement,
    power_law_backbone,
    power_law_bank,
    reload_displacement,
)

F_S, U_MAX, P = 0.2604, 1e-6, 3.2
# ratio of kinetic to static friction; share of full friction left, rebound and creep left (nm), virgin over this creep
TABLE = [(0.95, 0.90, 16, 36, 21), (0.90, 0.80, 32, 83, 9.2), (0.85, 0.70, 48, 134, 5.7), (0.70, 0.40, 102, 298, 2.6)]


@pytest.fixture(scope="module")
def bank():
    return power_law_bank(F_S, U_MAX, P, n=1000)


def after_slip(bank, ratio):
    """Share of full friction, rebound, creep left and creep of a virgin contact (nm) after an undamped slip."""
    state = arrest(bank, ratio)
    creep = [float(reload_displacement(bank, f, 0.99 * F_S)) for f in (state.element_force, 0 * state.element_force)]
    return float(state.force) / F_S, *(1e9 * u for u in (float(state.rebound), *creep))


@pytest.mark.parametrize("ratio, force, rebound, creep, factor", TABLE)
def test_residual_state(bank, ratio, force, rebound, creep, factor):
    """Displacements to 2 %; factors to the digits they are known with."""
    left, back, available, virgin = after_slip(bank, ratio)
    assert left == pytest.approx(force, rel=1e-9)
    assert back == pytest.approx(rebound, rel=0.02)
    assert available == pytest.approx(creep, rel=0.02)
    assert virgin == pytest.approx(763, rel=0.02)
    assert float(f"{virgin / available:.2g}") == factor


@pytest.mark.parametrize("ratio", [0.7, 0.9])
def test_rebound_obeys_masing_with_kinetic_caps(bank, ratio):
    state = arrest(bank, ratio)
    kinetic = lambda u: ratio * power_law_backbone(u, ratio * U_MAX, F_S, P)  # noqa: E731
    assert float(ratio * F_S - 2 * kinetic(state.rebound / 2)) == pytest.approx(float(state.force), rel=1e-4)


def test_elements_after_arrest(bank):
    state = arrest(bank, 0.8, force=0.1)
    kinetic = 0.8 * np.asarray(bank.strength)
    by_hand = np.clip(kinetic - np.asarray(bank.stiffness * state.rebound), -kinetic, kinetic)
    assert np.allclose(state.element_force, by_hand, rtol=1e-12)
    assert by_hand.sum() == pytest.approx(0.1, rel=1e-12)
    assert np.asarray(state.element_force)[:50].min() < 0 < np.asarray(state.element_force)[-50:].min()


def test_memory_may_be_partial(bank):
    full, half, none = (arrest(bank, 0.85, kept=kept) for kept in (1.0, 0.5, 0.0))
    assert np.allclose(half.element_force, 0.5 * full.element_force)
    creep = [float(reload_displacement(bank, state.element_force, 0.99 * F_S)) for state in (full, half, none)]
    assert creep[0] < creep[1] < creep[2]
    assert creep[2] == pytest.approx(U_MAX * (1 - 0.01 ** (1 / P)), rel=1e-4)


def test_undamped_slip_ends_as_far_below_as_it_began_above():
    assert float(arrest_force(1.0, 0.85)) == pytest.approx(0.7)


def test_loading_displacement_inverts_the_sum():
    rng = np.random.default_rng(0)
    stiffness, room = rng.random(40), rng.random(40)
    stiffness[[3, 17]] = room[[3, 17]] = 0.0
    target = np.linspace(0, room.sum(), 60)
    x = np.asarray(loading_displacement(jnp.asarray(stiffness), jnp.asarray(room), target))
    assert np.allclose(np.minimum(stiffness * x[:, None], room).sum(axis=1), target, rtol=1e-12, atol=1e-14)
    assert x[0] == 0.0
    beyond = loading_displacement(jnp.asarray(stiffness), jnp.asarray(room), 2 * room.sum())
    assert float(beyond) == pytest.approx((room[room > 0] / stiffness[room > 0]).max())


def test_derivatives_of_the_rebound(bank):
    rebound = jax.jit(lambda u_max, ratio: arrest(power_law_bank(F_S, u_max, P), ratio).rebound)
    by_u_max, by_ratio = jax.jit(jax.grad(rebound, argnums=(0, 1)))(U_MAX, 0.85)
    assert float(by_u_max) == pytest.approx(float(rebound(U_MAX, 0.85)) / U_MAX, rel=1e-10)
    for step in (1e-4, 1e-5, 1e-6):
        difference = (rebound(U_MAX, 0.85 + step) - rebound(U_MAX, 0.85 - step)) / (2 * step)
        assert float(difference) == pytest.approx(float(by_ratio), rel=5e-3)


@pytest.mark.parametrize(
    "change", [{"ratio": 0.0}, {"ratio": 1.1}, {"kept": 1.5}, {"force": 0.25}, {"force": -0.25}], ids=str
)
def test_impossible_states_are_refused(bank, change):
    with pytest.raises(InputError, match="out of range"):
        arrest(bank, **{"ratio": 0.85, **change})
