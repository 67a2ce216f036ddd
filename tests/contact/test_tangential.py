"""The closed-form tangential curve: against the plain sum, analytic contacts, and the facts of rough lines."""

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import (
    RoughLines,
    add_curvature,
    cone,
    equal_bodies,
    flat_punch,
    from_heights,
    indentation,
    power_law,
    sphere,
    static_contact,
)

from .springs import exponential_gaps

STEEL = equal_bodies()
L = 20e-6
MU = 0.21


def brute_force(gaps, dx, depth, u):
    """Sum of min(c_t u, mu f_n,i) over the springs, one displacement after the other."""
    caps = MU * STEEL.normal * dx * np.maximum(depth[..., None] - gaps, 0)
    return np.stack([np.minimum(STEEL.tangential * dx * x, caps).sum(axis=-1) for x in u])


def profiles():
    z = np.asarray(RoughLines(0.3, lines=5, n_springs=1024, seed=1).heights)
    rolled = np.asarray(RoughLines(0.3, lines=5, n_springs=1024, seed=1, roll_off=0.1 * L, cut_off=0.01 * L).heights)
    return {
        "rough": from_heights(z, L / 1024),
        "rolled-off": from_heights(rolled, L / 1024),
        "curved": from_heights(add_curvature(z, L / 1024, 1e4), L / 1024),
        "sphere": sphere(L, 1000, 1e-3),
        "cone": cone(L / 2, 1001, 0.05),
        "punch": flat_punch(L / 2, 100),
        "exponential": exponential_gaps(2e-8, 1000, 1e-8),
    }


def closed_form_error(profile):
    """Largest difference of the closed form to the sum over springs, over full friction."""
    contact = static_contact(indentation(profile), 0.31, MU)
    u = np.linspace(0, 1.2, 50) * float(jnp.max(contact.u_max))
    exact = brute_force(np.asarray(profile.gaps), profile.dx, np.asarray(contact.depth), u)
    force = contact.force(u.reshape(-1, *[1] * contact.depth.ndim))
    return np.abs(np.asarray(force) - exact).max() / (MU * 0.31)


@pytest.mark.parametrize("name", profiles())
def test_closed_form_is_the_sum_over_springs(name):
    assert closed_form_error(profiles()[name]) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("name", profiles())
def test_displacement_inverts_force(name):
    contact = static_contact(indentation(profiles()[name]), 0.31, MU)
    tau = np.linspace(0, 1, 41).reshape(-1, *[1] * contact.depth.ndim)
    u = contact.displacement(tau)
    assert np.abs(np.asarray(contact.force(u)) / (MU * 0.31) - tau).max() < 1e-12
    assert np.allclose(u[-1], contact.u_max, rtol=1e-3 if name in ("sphere", "cone") else 1e-12)
    assert np.allclose(contact.force(2 * contact.u_max), contact.strength, rtol=1e-14)


def test_stiffness_is_the_first_slope_and_u_max_is_where_it_ends():
    contact = static_contact(indentation(profiles()["rough"]), 0.31, MU)
    u = 1e-13
    assert np.allclose(contact.force(u) / u, contact.stiffness, rtol=1e-4)
    assert np.allclose(contact.u_max, MU * STEEL.normal / STEEL.tangential * contact.depth)
    assert (np.asarray(contact.force(0.999 * contact.u_max)) < contact.strength).all()


POWERS = [(0.3, 2_000_000), (1.0, 4000), (2.0, 4000), (8.0, 40000)]  # and numbers of springs


def power_law_error(n, springs):
    """Largest departure of a profile x^n from 1 - (1 - w)^((n + 1)/n), over full friction."""
    profile = power_law(L / 2, springs, n, 1e-6 / (L / 2) ** n)
    table = indentation(profile)
    contact = static_contact(table, table.force(0.8e-6, STEEL.normal), MU)
    w = np.linspace(0, 1, 60)
    exact = 1 - (1 - w) ** ((n + 1) / n)
    return np.abs(contact.force(w * contact.u_max) / contact.strength - exact).max()


@pytest.mark.slow
@pytest.mark.parametrize("n, springs", POWERS)
def test_power_law_profiles(n, springs):
    assert power_law_error(n, springs) < 1e-5


def sphere_error(n_springs, width):
    """Distance to Cattaneo and Mindlin's curve, with their radius of contact and not the springs' own u_max."""
    radius, load = 1e-3, 0.31
    a = (0.75 * load * radius / STEEL.normal) ** (1 / 3)
    contact = static_contact(indentation(sphere(width * a, n_springs, radius)), load, MU)
    u_max = 3 * MU * load / (4 * STEEL.tangential * a)
    w = np.linspace(0, 1, 2001)
    return np.abs(contact.force(w * u_max) / (MU * load) - (1 - (1 - w) ** 1.5)).max()


@pytest.mark.slow
def test_sphere_is_cattaneo_mindlin_with_order_two():
    widths = np.linspace(1.2, 1.25, 11)  # the error depends on where between two springs the contact ends
    coarse, fine = (np.mean([sphere_error(n, width) for width in widths]) for n in (200, 2000))
    assert coarse < 1e-4
    assert coarse / fine == pytest.approx(100, rel=0.2)


def test_cone_through_its_known_force():
    """Sneddon: F_n = 2 E* d^2/(pi slope)."""
    contact = static_contact(indentation(cone(L / 2, 20001, 0.05)), 0.05, MU)
    assert float(contact.depth) == pytest.approx(np.sqrt(np.pi * 0.05 * 0.05 / (2 * STEEL.normal)), rel=1e-4)


def test_exponential_gaps_make_the_exponential_iwan_bank():
    decay = 5e-8
    table = indentation(exponential_gaps(decay, 200_000, 1e-10))
    contact = static_contact(table, table.force(decay * np.log(1e5), STEEL.normal), MU)
    u = np.linspace(0, 5, 30) * MU * STEEL.normal / STEEL.tangential * decay
    exact = 1 - np.exp(-u / (MU * STEEL.normal / STEEL.tangential * decay))
    assert np.abs(contact.force(u) / contact.strength - exact).max() < 1e-3


def mean_w(H, h_rms, force, tau, n_springs=4096, lines=100, seed=0):
    contact = RoughLines(H, h_rms, L, n_springs=n_springs, lines=lines, seed=seed).contact(force, MU)
    return float(contact.displacement(tau).mean() / contact.u_max.mean())


def test_smaller_H_breaks_loose_more_suddenly():
    half = [mean_w(H, 2.86e-6, 0.31, 0.5) for H in (0.1, 0.3, 0.5, 0.7, 0.9)]
    late = [mean_w(H, 2.86e-6, 0.31, 0.99) for H in (0.1, 0.3, 0.5, 0.7, 0.9)]
    assert np.all(np.diff(half) > 0.01)
    assert np.all(np.diff(late) > 0.01)
    assert half[2] == pytest.approx(0.218, abs=0.01)
    assert [half[0], half[4]] == pytest.approx([0.152, 0.281], abs=0.01)
    assert [late[0], late[2], late[4]] == pytest.approx([0.75, 0.825, 0.895], abs=0.02)


@pytest.mark.slow
def test_normal_force_does_not_change_the_normalised_curve():
    """While neither a few springs nor the whole line carries it; 16384 springs are many enough down to 0.03 N."""
    at = lambda force: mean_w(0.3, 2.46e-6, force, 0.5, 16384, 400)  # noqa: E731
    reference = at(0.31)
    assert [at(f) for f in (0.03, 0.1, 1.0)] == pytest.approx([reference] * 3, abs=0.01)
    assert at(0.003) > reference + 0.02


def test_scale_of_u_max():
    """u_max ~ mu h^(1/(1+H)) (F_n/E* L)^(H/(1+H)), where the exponent of F_n against d is the theory's."""
    H = 0.7
    table = RoughLines(H, 1.0, L, n_springs=16384).indentation
    u_max = lambda h, f, mu: float(static_contact(table.scaled(h), f, mu).u_max.mean())  # noqa: E731
    base = u_max(3e-6, 0.1, 0.21)
    assert u_max(3e-6, 0.1, 0.42) == pytest.approx(2 * base, rel=1e-12)
    assert np.log(u_max(6e-6, 0.1, 0.21) / base) / np.log(2) == pytest.approx(1 / (1 + H), abs=0.02)
    assert np.log(u_max(3e-6, 0.2, 0.21) / base) / np.log(2) == pytest.approx(H / (1 + H), abs=0.02)


@pytest.mark.parametrize("force, friction", [(0.0, 0.2), (-0.3, 0.2), (0.3, 0.0), (0.3, float("inf"))])
def test_bad_loads_are_refused(force, friction):
    with pytest.raises(InputError, match="out of range"):
        RoughLines(n_springs=64, lines=2).contact(force, friction)
