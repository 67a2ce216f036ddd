"""Responses of the damped oscillation, the stages that follow it, and where a step does so."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm

from stickslip.physics.contact import Bank
from stickslip.simulation.solve import integrate
from stickslip.simulation.solve.oscillation import Oscillation, followed
from stickslip.simulation.solve.stages import (
    GAMMA,
    first_stage,
    integral_of_square,
    local_error,
    second_stage,
    work_of_force,
)

from .rig import FAR, MASS, drive, rig, sliding

RINGS = [(1e7, 100.0, 3e-4), (1e7, 1e3, 1e-6), (1e2, 900.0, 1e-3), (0.0, 0.0, 1e-3)]  # k, c, t; over-damped the third


def propagated(k: float, c: float, t: float) -> np.ndarray:
    """exp(A t) for displacement, velocity, force over mass, its rate and the rate of that."""
    rates = np.zeros((5, 5))
    rates[0, 1] = rates[1, 2] = rates[2, 3] = rates[3, 4] = 1.0
    rates[1, :2] = -k, -c
    return expm(rates * t)


@pytest.mark.parametrize("k, c, t", RINGS)
def test_responses_are_those_of_the_matrix_exponential(k, c, t):
    exact = propagated(k, c, t)
    found = Oscillation(jnp.asarray(k), jnp.asarray(c)).responses(jnp.asarray(t))
    assert found == pytest.approx([exact[1, 1], exact[0, 1], exact[0, 2], exact[0, 3], exact[0, 4]], rel=1e-11)


@pytest.mark.parametrize("k, c, h", RINGS)
def test_stages_are_exact_where_what_comes_on_top_is_a_straight_line(k, c, h):
    v0, a0, slope = 2e-4, -0.3, 40.0
    swing, h, one = Oscillation(jnp.asarray(k), jnp.asarray(c)), jnp.asarray(h), jnp.ones(())
    start = np.array([0.0, v0, a0 + c * v0, slope, 0.0])
    first = first_stage(swing, one, v0, a0, h)
    n1 = slope * GAMMA * h
    v1, a1 = first.v + first.into_v * n1, a0 - k * (first.dx + first.into_dx * n1) + n1
    exact = propagated(k, c, GAMMA * float(h)) @ start
    assert [first.dx + first.into_dx * n1, v1] == pytest.approx(exact[:2], rel=1e-9, abs=1e-12 * v0)
    second = second_stage(swing, one, (v0, v1), (a0, a1), n1, h)
    n2 = slope * h
    exact = propagated(k, c, float(h)) @ start
    found = [second.dx + second.into_dx * n2, second.v + second.into_v * n2]
    assert found == pytest.approx(exact[:2], rel=1e-9, abs=1e-12 * v0)
    assert local_error((v0, v1, found[1]), (a0, a1, a1), (n1, n2), one, h) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_without_a_share_the_stages_are_those_of_tr_bdf2_whatever_the_oscillation():
    v0, a0, h, zero = 2e-4, -0.3, jnp.asarray(1e-3), jnp.zeros(())
    made = []
    for k, c in ((0.0, 0.0), (1e7, 100.0)):
        swing = Oscillation(jnp.asarray(k), jnp.asarray(c))
        force = 3e6, 20.0  # over mass, of displacement and velocity

        def solved(form, k=k, c=c, force=force):
            def gap(n):
                dx, v = form.dx + form.into_dx * n, form.v + form.into_v * n
                return n - (-(force[0] - k) * dx - (force[1] - c) * (v - v0))

            n = -gap(0.0) / jax.grad(gap)(0.0)
            dx, v = form.dx + form.into_dx * n, form.v + form.into_v * n
            return n, dx, v, a0 - force[0] * dx - force[1] * (v - v0)

        n1, dx1, v1, a1 = solved(first_stage(swing, zero, v0, a0, h))
        made.append([dx1, v1, *solved(second_stage(swing, zero, (v0, v1), (a0, a1), n1, h))[1:3]])
    assert np.array(made[1]) == pytest.approx(np.array(made[0]), rel=1e-9)


def test_work_and_loss_of_a_swing_are_its_integrals():
    """Over one radian, with a load point that moves."""
    w, h, u, c_s = 3000.0, 1.0 / 3000.0, 1e-3, 1000.0
    t = np.array([0.0, GAMMA * h, h])
    x = lambda t: 1e-7 * (np.sin(w * t + 0.3) - np.sin(0.3))  # noqa: E731
    v = lambda t: 1e-7 * w * np.cos(w * t + 0.3)  # noqa: E731
    pull = lambda t: 0.2 + c_s * (u * t - x(t))  # noqa: E731
    a = tuple(-1e-7 * w**2 * np.sin(w * t + 0.3))
    one = jnp.ones(())
    work = work_of_force(tuple(pull(t)), c_s, tuple(x(t)[1:]), tuple(v(t)), a, one, h)
    assert work == pytest.approx(quad(lambda t: pull(t) * v(t), 0.0, h, epsrel=1e-13)[0], rel=1e-9)
    square = integral_of_square(tuple(v(t)), a, one, h)
    assert square == pytest.approx(quad(lambda t: v(t) ** 2, 0.0, h, epsrel=1e-13)[0], rel=1e-4)


def share(model, y, a: float, h: float) -> float:
    bank, t = model.shaped(), jnp.zeros(())
    return float(followed(model, bank, y, model.contact(y, bank, t), jnp.asarray(a), t, jnp.asarray(h))[1])


def test_it_is_followed_where_the_contact_holds_and_not_in_slips_or_long_steps():
    model = rig()
    angular = float(np.sqrt((model.bank.total_stiffness + 1000.0) / MASS))
    rest = model.rest(v=1e-5)
    assert share(model, rest, 0.0, 0.5 / angular) == 1.0
    assert 0.0 < share(model, rest, 0.0, 1.5 / angular) < 1.0
    assert share(model, rest, 0.0, 3.0 / angular) == 0.0
    assert share(model, sliding(model, 1e-3), 0.0, 0.5 / angular) == 0.0


def test_few_steps_follow_a_ringing_to_its_end():
    """A stuck block of 100 cycles: six steps in each, and no error is left in phase or amplitude."""
    stuck = Bank(jnp.array([1e6]), jnp.array([1e3]))
    model = rig(springs=stuck, load_point=drive((FAR, 0.0)), damping=1.0, ratio=1.0)
    decay = 1.0 / (2.0 * MASS)
    omega = np.sqrt(1.001e6 / MASS - decay**2)
    end = 100 * 2.0 * np.pi / omega
    steps = integrate(model, end, state=model.rest(v=1e-3))[0].steps
    exact = 1e-3 / omega * np.exp(-decay * steps.t) * np.sin(omega * steps.t)
    assert steps.t.size < 700
    assert steps.x == pytest.approx(exact, abs=1e-8 * 1e-3 / omega)
