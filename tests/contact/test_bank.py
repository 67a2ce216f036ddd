"""Banks of Jenkins elements: exact at the nodes, order two between them, smooth in the parameters."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import (
    Bank,
    RoughLines,
    bank_from_backbone,
    bank_from_contact,
    binning_error,
    default_edges,
    equal_bodies,
    mixture,
    normal_scores,
    power_law_backbone,
    power_law_bank,
    static_contact,
)

from .springs import spring_bank

F_S, U_MAX, P = 0.2604, 1e-6, 3.2


def backbone(u):
    return power_law_backbone(u, U_MAX, F_S, P)


@pytest.mark.parametrize("n", [1, 2, 7, 64, 500])
def test_edges(n):
    edges = default_edges(n)
    assert edges.size == n
    assert edges[-1] == 1.0
    assert np.diff(edges, prepend=0.0).min() > 0.6 / n


def test_edges_are_half_even_in_threshold_and_half_even_in_count():
    edges = default_edges(1000)
    for w in (0.1, 0.5, 0.9):
        below = (edges <= w).mean()
        assert below == pytest.approx(0.5 * w + 0.5 * (1 - (1 - w) ** 2), abs=1.5e-3)


@pytest.mark.parametrize("n", [3, 128])
def test_bank_is_exact_at_its_nodes_and_in_strength(n):
    edges = default_edges(n)
    bank = bank_from_backbone(backbone, U_MAX, edges)
    assert np.allclose(bank.backbone(edges * U_MAX), backbone(edges * U_MAX), rtol=1e-13)
    assert float(bank.total_strength) == pytest.approx(F_S, rel=1e-14)
    assert np.allclose(bank.threshold, edges * U_MAX, rtol=1e-13)
    assert np.allclose(bank.strength, bank.stiffness * bank.threshold, rtol=1e-15)
    assert float(bank.total_stiffness) == pytest.approx(float(backbone(edges[0] * U_MAX) / (edges[0] * U_MAX)))
    assert float(bank.backbone(-3.3e-7)) == -float(bank.backbone(3.3e-7))


@pytest.mark.parametrize("p", [2.0, 3.2, 5.0])
def test_binning_is_of_order_two_and_its_bound_holds(p):
    smooth = lambda u: power_law_backbone(u, U_MAX, F_S, p)  # noqa: E731
    u = jnp.linspace(0, U_MAX, 40001)
    ns, errors = np.array([32, 64, 128, 256, 512]), []
    for n in ns:
        edges = default_edges(n)
        found = bank_from_backbone(smooth, U_MAX, edges).backbone(u) - smooth(u)
        assert float(found.max()) < 1e-15
        errors.append(float(jnp.abs(found).max()) / F_S)
        bound = float(binning_error(smooth, U_MAX, edges))
        assert errors[-1] <= bound < 12 * errors[-1]
    assert -np.polyfit(np.log(ns), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.15)


def test_default_bank_is_within_a_ten_thousandth():
    assert float(binning_error(backbone, U_MAX, default_edges(128))) < 2e-4


def test_no_element_is_negative_or_nan_on_a_straight_backbone():
    bank = bank_from_backbone(lambda u: jnp.minimum(u * 1e6, 0.2), 2e-7, default_edges(50))
    assert (np.asarray(bank.stiffness) >= 0).all()
    assert np.isfinite(bank.threshold).all()
    assert np.allclose(bank.stiffness[:-1], 0, atol=1e6 * 1e-12)
    assert float(bank.total_strength) == pytest.approx(0.2, rel=1e-10)


def test_power_law_is_safe_at_and_beyond_its_end():
    point = (U_MAX, U_MAX, F_S, P)
    for u in (0.0, U_MAX, 2 * U_MAX):
        assert np.isfinite(jax.jacrev(power_law_backbone, argnums=(0, 1, 2, 3))(u, *point[1:])).all()
    assert float(power_law_backbone(2 * U_MAX, *point[1:])) == F_S
    w, step = 0.4, 1e-6
    exact = jax.grad(power_law_backbone, argnums=3)(w * U_MAX, U_MAX, F_S, P)
    assert float(exact) == pytest.approx(-F_S * (1 - w) ** P * np.log(1 - w), rel=1e-12)
    higher, lower = (power_law_backbone(w * U_MAX, U_MAX, F_S, P + s) for s in (step, -step))
    assert float(exact) == pytest.approx(float(higher - lower) / (2 * step), rel=1e-8)


def test_normal_scores():
    for n in (2, 3, 4, 9):
        scores = normal_scores(n)
        assert scores.sum() == pytest.approx(0.0, abs=1e-15)
        assert (scores**2).mean() == pytest.approx(1.0)
        assert (np.diff(scores) > 0).all()
    assert np.array_equal(normal_scores(1), [0.0])
    with pytest.raises(InputError):
        normal_scores(0)


def test_mixture_is_the_sum_of_its_contacts():
    spread, contacts, u = 0.2, 4, np.linspace(0, 2e-6, 50)
    mixed, top = mixture(backbone, spread, contacts)
    each = [power_law_backbone(u, U_MAX * np.exp(spread * z), F_S / 4, P) for z in normal_scores(contacts)]
    assert np.allclose(mixed(u), np.sum(each, axis=0), rtol=1e-14)
    assert float(top) == pytest.approx(np.exp(spread * normal_scores(contacts)[-1]))
    bank = power_law_bank(F_S, U_MAX, P, spread, contacts, 512)
    assert float(bank.total_strength) == pytest.approx(F_S, rel=1e-13)
    assert np.abs(np.asarray(bank.backbone(u) - mixed(u))).max() < 1e-5 * F_S


def test_no_spread_is_one_contact_to_the_last_bit():
    one, four = power_law_bank(F_S, U_MAX, P), power_law_bank(F_S, U_MAX, P, 0.0, 4)
    direct = bank_from_backbone(backbone, U_MAX, default_edges(128))
    for bank in (one, four):
        assert np.array_equal(bank.stiffness, direct.stiffness)
        assert np.array_equal(bank.strength, direct.strength)


@pytest.mark.parametrize("which", range(4), ids=["strength", "u_max", "p", "spread"])
def test_derivatives_of_a_power_law_bank(which):
    point = np.array([F_S, U_MAX, P, 0.1])
    build = jax.jit(
        lambda q: jnp.concatenate(
            [x / s for x, s in zip(jax.tree.leaves(power_law_bank(*q)), (1e4, 1e-3), strict=True)]
        )
    )
    direction = np.eye(4)[which] * point[which]
    exact = np.asarray(jax.jvp(build, (jnp.asarray(point),), (jnp.asarray(direction),))[1])
    for step in (1e-2, 1e-3, 1e-4, 1e-5):  # elements are second differences: rounding of 128^2 eps
        difference = np.asarray(build(point + step * direction) - build(point - step * direction)) / (2 * step)
        assert np.abs(difference - exact).max() < (30 * step**2 + 1e-11 / step) * np.abs(exact).max()


def test_effect_of_the_spread_is_of_second_order():
    """It enters through exp(spread z) with z symmetric, so its derivative is zero at zero and not merely undefined."""
    at_zero = jax.jacfwd(lambda s: power_law_bank(F_S, U_MAX, P, s).stiffness)(0.0)
    assert np.abs(np.asarray(at_zero)).max() < 1e-9 * P * F_S / U_MAX


def test_rough_bank_follows_every_spring():
    table = RoughLines(n_springs=2048, lines=4, seed=3).indentation
    contact = static_contact(table, np.array([0.25, 0.31, 0.31, 0.37]), 0.21)
    springs, u = spring_bank(contact), np.linspace(0, 1.6e-6, 300)
    assert float(springs.total_strength) == pytest.approx(0.21 * 1.24, rel=1e-12)
    assert float(springs.total_stiffness) == pytest.approx(float(contact.stiffness.sum()), rel=1e-12)
    assert np.abs(springs.backbone(u) - contact.force(u[:, None]).sum(axis=1)).max() < 1e-12 * 0.26
    errors = []
    for n in (32, 128, 512):
        bank = bank_from_contact(contact, n)
        assert float(bank.total_strength) == pytest.approx(0.21 * 1.24, rel=1e-12)
        assert (np.asarray(bank.stiffness) >= 0).all()
        errors.append(np.abs(bank.backbone(u) - springs.backbone(u)).max() / 0.26)
    assert errors[1] < 2e-4
    assert errors[2] < errors[1] / 4 < errors[0] / 16


def test_rough_bank_of_the_rig_and_its_derivatives():
    bank = bank_from_contact(RoughLines(lines=4).contact())
    assert float(bank.total_strength) == pytest.approx(4 * 0.21 * 0.31, rel=1e-12)
    assert 0.8e6 < float(bank.total_stiffness) < 1.3e6
    assert 0.6e-6 < float(bank.threshold[-1]) < 1.5e-6
    moduli, few = equal_bodies(), {"n_springs": 512, "lines": 4}
    shape = jax.jacfwd(lambda q: bank_from_contact(RoughLines(*q[:2], **few).contact(*q[2:], moduli), 16).strength)(
        jnp.array([0.3, 2.46e-6, 0.31, 0.21])
    )
    total = np.asarray(shape).sum(axis=0)
    assert np.isfinite(shape).all()
    assert total[:2] == pytest.approx([0, 0], abs=1e-6)
    assert total[2:] == pytest.approx([4 * 0.21, 4 * 0.31], rel=1e-10)


def test_a_bank_needs_elements():
    with pytest.raises(InputError):
        default_edges(0)


def test_a_bank_refuses_elements_without_a_strength():
    """One strength for all would be read as that of each, and the total would be one element's."""
    with pytest.raises(InputError, match=r"bank: every element .*\(\(3,\), \(1,\)\)"):
        Bank(jnp.ones(3), jnp.ones(1))
    lanes = jax.vmap(lambda k: Bank(k, 1e-6 * k).total_strength)(jnp.ones((5, 3)))  # traced banks are as before
    np.testing.assert_allclose(lanes, 3e-6)
