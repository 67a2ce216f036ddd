"""The rig by the project's solver, and what its derivatives cost."""

from __future__ import annotations

import functools
from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from stickslip.contact import Bank
from stickslip.model import Block, LoadPoint, Model, Weakening
from stickslip.solve import ContactStepper, Stats, Tolerance, integrate
from stickslip.solve.integrate import step_control
from tests.solve.rig import tighter

from .case import C_S, CAP, D_C, DAMPING, DURATION, GRID, MASS, RATIO, STIFFNESS, T_H, VELOCITY, Answer

_TERM = diffrax.ODETerm(lambda t, y, args: y)


def model(theta: Array | None = None) -> Model:
    """The rig; eight of its parameters multiplied by ``exp(theta)``."""
    factor = jnp.ones(8) if theta is None else jnp.exp(theta)
    m, c_s, c, d_c, t_h, v0, k, cap = factor * jnp.array([MASS, C_S, DAMPING, D_C, T_H, VELOCITY, 1.0, 1.0])
    return Model(
        Block(m, c_s, c),
        Bank(k * STIFFNESS, cap * CAP),
        Weakening(RATIO, d_c, t_h),
        LoadPoint(jnp.array([0.0, 1.0]), jnp.stack([0.0 * v0, v0])),
    )


def own_answer(factor: float) -> tuple[Answer, Stats]:
    """By `integrate`, at the default tolerance divided by ``factor``."""
    trajectory, _ = integrate(model(), DURATION, tolerance=tighter(factor))
    at = trajectory.at(GRID)
    return Answer(at.x, at.v), trajectory.stats


def _displacement(theta: Array, tolerance: Tolerance) -> Array:
    rig = model(theta)
    ts = jnp.linspace(0.0, DURATION, 2001)
    return diffrax.diffeqsolve(
        _TERM, ContactStepper(tolerance), 0.0, DURATION, 1e-5, rig.rest(), args=(rig, rig.shaped()),
        saveat=diffrax.SaveAt(ts=ts, fn=lambda t, y, args: y.x), stepsize_controller=step_control(0.02),
        adjoint=diffrax.ForwardMode(), max_steps=16384, throw=False,
    ).ys  # fmt: skip


def jacobian_runs(factor: float) -> dict[str, Callable[[], np.ndarray]]:
    """One plain run, and three ways to its Jacobian in eight parameters: displacement at 2001 times."""
    zero = jnp.zeros(8)
    tolerance = tighter(factor)
    plain = jax.jit(functools.partial(_displacement, tolerance=tolerance))
    forward = jax.jit(jax.jacfwd(functools.partial(_displacement, tolerance=tolerance)))
    many = jax.jit(jax.vmap(functools.partial(_displacement, tolerance=tolerance)))
    moved = jnp.concatenate([zero[None], 0.02 * jnp.eye(8)])
    return {
        "plain run": lambda: np.asarray(plain(zero)),
        "forward mode": lambda: np.asarray(forward(zero)),
        "differences, one by one": lambda: np.stack([np.asarray(plain(m)) for m in moved]),
        "differences, as one batch": lambda: np.asarray(many(moved)),
    }
