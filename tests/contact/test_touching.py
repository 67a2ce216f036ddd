"""The table of the springs that touch answers what the table of all springs does."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.physics.contact import (
    Profile,
    RoughLines,
    creep_curve,
    default_loads,
    equal_bodies,
    flat_punch,
    from_heights,
    indentation,
    sphere,
    static_contact,
    touching,
)

from .springs import exponential_gaps

STEEL = equal_bodies()
L = 20e-6


def rough(H=0.3, springs=1024, h_rms=2.46e-6):
    return from_heights(RoughLines(H, h_rms, L, n_springs=springs, lines=12, seed=4).heights, L / springs)


@pytest.mark.slow
@pytest.mark.parametrize("load", [1e-9, 1e-3, 0.31, 3.0, 60.0], ids=str)
@pytest.mark.parametrize(
    "profile", [rough(), rough(0.8), sphere(30e-6, 5000, 1e-3), exponential_gaps(1e-7, 3000, 1e-8)]
)
def test_all_that_is_asked_below_the_largest_load(profile, load):
    whole, part = indentation(profile), touching(profile, load / (STEEL.normal * profile.dx))
    tau = default_loads(40)[:, None] if profile.gaps.ndim == 2 else default_loads(40)
    one, other = (static_contact(table, load, 0.21) for table in (whole, part))
    for ask in (
        lambda c: c.depth,
        lambda c: c.stiffness,
        lambda c: c.contact_share,
        lambda c: c.displacement(tau),
        lambda c: c.force(tau * jnp.max(c.u_max)),
    ):
        exact = np.asarray(ask(one))
        assert np.abs(np.asarray(ask(other)) - exact).max() <= 1e-12 * np.abs(exact).max()


def test_springs_that_stay_away_are_left_out():
    profile = rough(springs=4096)
    part = touching(profile, 0.31 / (STEEL.normal * profile.dx))
    assert part.gaps.shape == (12, 1024)
    assert part.n_springs == indentation(profile).n_springs == 4096


def test_each_line_may_have_its_own_load():
    profile, load = rough(), np.geomspace(0.01, 1.0, 12)
    part, whole = touching(profile, load / (STEEL.normal * profile.dx)), indentation(profile)
    assert np.allclose(part.depth(load, STEEL.normal), whole.depth(load, STEEL.normal), rtol=1e-13)


def test_where_every_spring_touches_all_are_sorted():
    punch = flat_punch(1e-5, 400)
    assert touching(punch, 1.0).gaps.shape == (400,)
    thin = Profile(jnp.sort(jnp.asarray(np.random.default_rng(0).uniform(0, 1, 1000))).at[0].set(0.0), 1.0)
    assert touching(thin, 1e6).gaps.shape == (1000,)


def test_a_highest_spring_between_the_thinned_ones():
    """The thinned line lies a kilometre below; only what is not thinned carries."""
    gaps = np.full(256, 1e3)
    gaps[3] = 0.0
    part = touching(Profile(jnp.asarray(gaps), 1.0), 1e-3)
    assert float(part.depth(1e-3, 1.0)) == pytest.approx(1e-3, rel=1e-14)
    assert part.gaps.shape == (64,)


@pytest.mark.slow
def test_traced_and_known_curves_are_the_same():
    def curve(H):
        return creep_curve(RoughLines(H, lines=6, n_springs=1024).contact())

    known, traced = curve(0.3), jax.jit(curve)(0.3)
    assert known.n_springs == traced.n_springs == 1024
    for name in ("u", "t", "force", "u_max", "stiffness", "contact_share"):
        one, other = np.asarray(getattr(known, name)), np.asarray(getattr(traced, name))
        assert np.abs(one - other).max() <= 1e-12 * np.abs(one).max(), name
