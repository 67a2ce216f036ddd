"""The solver as a part of diffrax and as a function: interpolation, repeatability, symmetry, restarts, refusals."""

from __future__ import annotations

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.effects.base import BodyForce
from stickslip.errors import SolveError
from stickslip.solve import ContactStepper, Tolerance, integrate
from stickslip.solve.integrate import step_control

from .rig import rig


@pytest.fixture(scope="module")
def first_event():
    return integrate(rig(), 5.6)[0]


def test_repeats_bit_for_bit(first_event):
    again, _ = integrate(rig(), 5.6)
    assert all(np.array_equal(a, b) for a, b in zip(first_event.steps, again.steps, strict=True))
    assert np.max(first_event.steps.v) > 1e-3


def test_pulling_the_other_way_mirrors_everything_bit_for_bit(first_event):
    mirrored, _ = integrate(rig(-5e-5), 5.6)
    s, m = first_event.steps, mirrored.steps
    assert np.array_equal(m.t, s.t)
    assert np.array_equal(m.x, -s.x)
    assert np.array_equal(m.contact_force, -s.contact_force)
    assert np.array_equal(m.friction_work, s.friction_work)


def test_goes_on_from_a_state(first_event):
    _, state = integrate(rig(), 4.0)
    rest, _ = integrate(rig(), 5.6, t0=4.0, state=state)
    s = rest.steps
    assert s.t[0] == 4.0
    # another first step is another discretisation, no more
    assert s.t[np.argmax(s.v > 5e-4)] == pytest.approx(
        first_event.steps.t[np.argmax(first_event.steps.v > 5e-4)], abs=5e-4
    )
    assert s.x[-1] == pytest.approx(first_event.steps.x[-1], rel=1e-2)


def test_a_trace_is_read_off_between_the_steps(first_event):
    """`SaveAt(ts=...)` of diffrax, `Trajectory.at`, and the integral of the velocity."""
    model = rig()
    ts = np.linspace(5.15, 5.25, 1237)
    solution = jax.jit(
        lambda model: diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, y, args: y), ContactStepper(Tolerance()), 0.0, 5.6, 1e-5, model.rest(),
            args=(model, model.shaped()), saveat=diffrax.SaveAt(ts=ts, fn=lambda t, y, args: (y.x, y.v, y.psi)),
            stepsize_controller=step_control(0.02), adjoint=diffrax.ForwardMode(), max_steps=4096,
        ).ys
    )(model)  # fmt: skip
    at = first_event.at(ts)
    for own, stock in zip((at.x, at.v, at.psi), solution, strict=True):
        assert own == pytest.approx(np.asarray(stock), rel=1e-9, abs=1e-13)
    assert not np.any(np.isin(ts, first_event.steps.t))
    fine = np.linspace(5.15, 5.25, 40_001)
    slope = np.gradient(first_event.at(fine).x, fine)
    assert slope[1:-1] == pytest.approx(first_event.at(fine).v[1:-1], abs=1e-3 * np.max(at.v))


@pytest.mark.parametrize(
    "wrong",
    [
        {"mass": float("nan")},
        {"ratio": float("nan")},
        {"spring_stiffness": float("inf")},
        {"velocity": float("nan")},
        {"slip_distance": 0.0},
    ],
    ids=lambda w: next(iter(w)),
)
def test_impossible_parameters_are_refused(wrong):
    with pytest.raises(SolveError, match=r"stopped at t = .* no longer a number; look for a parameter"):
        integrate(rig(**wrong), 1.0)


class _Lost(BodyForce):
    """No number beyond a displacement."""

    def force(self, state, motion, contact):
        return jnp.where(motion.x > 1e-7, jnp.nan, 0.0)


class _Jump(BodyForce):
    """A wall that pushes back with a finite force at once: its point of balance does not exist."""

    def force(self, state, motion, contact):
        return jnp.where(motion.x > 1e-7, -10.0, 10.0)


def test_a_number_lost_on_the_way_is_reported_with_its_time():
    with pytest.raises(SolveError, match=r"t = [1-3]\.\d+ s .*no longer a number|force that jumps"):
        integrate(rig(effects=(_Lost(),)), 4.0)


def test_a_force_that_jumps_is_given_up_with_advice():
    with pytest.raises(SolveError, match=r"steps were not enough|force that jumps"):
        integrate(rig(effects=(_Jump(),)), 4.0, most_steps=4000)
