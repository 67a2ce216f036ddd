"""F_n(d) and d(F_n): exact against the plain sum, exponents of rough lines, saturation, derivatives."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.physics.contact import (
    Profile,
    RoughLines,
    SaturationWarning,
    check_saturation,
    creep_curve,
    equal_bodies,
    flat_punch,
    from_heights,
    indentation,
    static_contact,
)
from stickslip.physics.contact.indentation import sort_gaps

STEEL = equal_bodies()
L = 20e-6


def brute_force(gaps, dx, depth):
    return STEEL.normal * dx * np.maximum(depth[..., None] - gaps, 0).sum(axis=-1)


@pytest.fixture(scope="module")
def lines():
    z = np.asarray(RoughLines(0.3, lines=12, n_springs=1024, seed=4).heights)
    return from_heights(z, L / 1024)


def test_force_is_the_sum_over_springs(lines):
    depth = np.linspace(-1e-6, 12e-6, 60)[:, None] * np.ones(12)
    exact = brute_force(np.asarray(lines.gaps), lines.dx, depth)
    assert np.abs(np.asarray(indentation(lines).force(depth, STEEL.normal)) - exact).max() < 1e-13 * exact.max()


def test_depth_inverts_force(lines):
    table = indentation(lines)
    force = jnp.asarray(np.concatenate([[0.0], np.geomspace(1e-7, 30, 80)]))[:, None]
    depth = table.depth(force, STEEL.normal)
    assert depth.shape == (81, 12)
    assert (depth[0] == 0.0).all()
    assert np.allclose(brute_force(np.asarray(lines.gaps), lines.dx, np.asarray(depth)), force, rtol=1e-12, atol=0)


def test_stiffness_is_the_derivative_of_force(lines):
    table, depth = indentation(lines), jnp.linspace(1e-8, 8e-6, 33)[:, None]
    slope = jax.vmap(jax.vmap(jax.grad(lambda d, i: table.force(d, STEEL.normal)[i]), (None, 0)), (0, None))(
        depth[:, 0], jnp.arange(12)
    )
    assert np.allclose(slope, STEEL.normal * table.contact_length(depth), rtol=1e-12)
    assert np.array_equal(
        np.asarray(table.contact_share(depth)), (np.asarray(lines.gaps) <= np.asarray(depth)[..., None]).mean(axis=-1)
    )


def test_equal_gaps_and_flat_punch():
    table = indentation(flat_punch(L / 2, 64))
    assert float(table.depth(0.3, STEEL.normal)) == pytest.approx(0.3 / (STEEL.normal * L), rel=1e-14)
    stepped = indentation(Profile(jnp.repeat(jnp.array([0.0, 1e-7, 2e-7]), 5), L / 15))
    depth = np.array([5e-8, 1e-7, 1.5e-7, 2e-7, 3e-7])
    assert np.allclose(
        stepped.force(depth, STEEL.normal), brute_force(np.repeat([0, 1e-7, 2e-7], 5), L / 15, depth), rtol=1e-14
    )


def test_scaling_needs_no_new_sort(lines):
    again = indentation(Profile(3.7 * lines.gaps, lines.dx))
    scaled = indentation(lines).scaled(3.7)
    assert np.allclose(scaled.depth(0.4, STEEL.normal), again.depth(0.4, STEEL.normal), rtol=1e-13)
    assert np.allclose(scaled.force(5e-6, STEEL.normal), again.force(5e-6, STEEL.normal), rtol=1e-13)


def test_parameter_sets_and_lines_at_once_equal_the_loop(lines):
    heights, forces = np.array([0.5, 1.0, 2.0]), np.array([0.1, 0.3, 1.0])
    table = indentation(lines)
    together = table.scaled(heights[:, None]).depth(forces[:, None], STEEL.normal)
    assert together.shape == (3, 12)
    for row, (h, f) in zip(np.asarray(together), zip(heights, forces, strict=True), strict=True):
        for i, value in enumerate(row):
            one = indentation(Profile(h * lines.gaps[i], lines.dx))
            assert value == pytest.approx(float(one.depth(f, STEEL.normal)), rel=1e-13)


def test_wrong_broadcast_is_refused(lines):
    with pytest.raises(ValueError, match="broadcast"):
        indentation(Profile(lines.gaps[:1], lines.dx)).depth(jnp.ones(5), STEEL.normal)


def test_sort_and_its_derivatives():
    gaps = jnp.asarray(np.random.default_rng(0).random((3, 50)) * 1e-6).at[1, 7].set(-0.0)
    assert np.array_equal(np.asarray(sort_gaps(gaps)), np.sort(np.asarray(gaps), axis=-1))
    weights = jnp.arange(50.0) ** 2
    gradient = jax.grad(lambda g: (sort_gaps(g) * weights).sum())(gaps)
    ranks = np.argsort(np.argsort(np.asarray(gaps), axis=-1), axis=-1)
    assert np.array_equal(np.asarray(gradient), ranks.astype(float) ** 2)
    assert np.array_equal(
        np.asarray(jax.jvp(sort_gaps, (gaps,), (weights + 0 * gaps,))[1]), np.argsort(gaps, -1) ** 2.0
    )


def test_derivatives_in_heights_and_force(lines):
    """By the theory of the foundation: dd/dF = 1/k_n, and raising the gap of one of n touching springs costs 1/n."""
    gaps = lines.gaps[0]
    depth = lambda g, f: indentation(Profile(g, lines.dx)).depth(f, STEEL.normal)  # noqa: E731
    d, (by_gap, by_force) = depth(gaps, 0.31), jax.grad(depth, argnums=(0, 1))(gaps, 0.31)
    touching = np.asarray(gaps) < float(d)
    assert float(by_force) == pytest.approx(1 / (STEEL.normal * lines.dx * touching.sum()), rel=1e-12)
    assert np.allclose(by_gap, touching / touching.sum(), rtol=1e-10, atol=1e-14)


def exponents(H, n_springs, lines):
    """Exponents of F_n against d, and of k_n against F_n, over 0.01 to 1 N (1 to 30 % in contact)."""
    table = RoughLines(H, length=L, n_springs=n_springs, lines=lines).indentation
    force = np.geomspace(0.01, 1.0, 41)
    depth = table.depth(force[:, None], STEEL.normal)
    fit = lambda y: np.polyfit(np.log(force), np.log(np.asarray(y).mean(axis=1)), 1)[0]  # noqa: E731
    return 1 / fit(depth), fit(table.contact_length(depth))


@pytest.mark.parametrize("H", [0.5, 0.7, 0.9])
def test_force_exponent_is_that_of_self_affine_surfaces(H):
    assert exponents(H, 65536, 40)[0] == pytest.approx((H + 1) / H, abs=0.15)


def test_force_exponent_at_small_H_is_set_by_the_number_of_springs():
    """A warning in numbers: far below (H + 1)/H = 6, and still rising with N."""
    coarse, fine = exponents(0.2, 4096, 40)[0], exponents(0.2, 65536, 40)[0]
    assert fine < 6 - 1
    assert fine > coarse + 0.4


@pytest.mark.parametrize("H, exponent", [(0.1, 0.80), (0.2, 0.77), (0.3, 0.73), (0.5, 0.65), (0.7, 0.59), (0.9, 0.54)])
def test_stiffness_exponent(H, exponent):
    assert exponents(H, 4096, 100)[1] == pytest.approx(exponent, abs=0.05)


@pytest.mark.slow
def test_saturation_warns_above_half_contact():
    with pytest.warns(SaturationWarning, match="line_length L"):
        creep_curve(RoughLines(h_rms=0.35e-6).contact())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_saturation(np.array([0.1, 0.5]))
        creep_curve(RoughLines(lines=20).contact())


def test_saturation_is_an_error_at_full_contact():
    with pytest.raises(InputError, match="touch over their whole length") as caught:
        creep_curve(RoughLines(h_rms=0.01e-6, lines=5).contact())
    for knob in ("line_length L", "h_rms", "F_n"):
        assert knob in str(caught.value)


def test_a_punch_that_is_flat_is_not_called_saturated():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        curve = creep_curve(static_contact(indentation(flat_punch(L / 2, 64)), 0.31, 0.21))
    assert np.allclose(curve.u / curve.u_max, curve.tau)
