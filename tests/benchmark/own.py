"""The rig by the project's solver, and what its derivatives cost."""

from __future__ import annotations

import functools
from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from stickslip.physics.contact import Bank, bank_from_backbone, binning_error, default_edges
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.simulation.solve import Tolerance, Trajectory, integrate
from stickslip.simulation.solve.by_diffrax import step_control
from stickslip.simulation.solve.stepper import ContactStepper
from tests.solve.rig import tighter

from .case import C_S, D_C, DAMPING, MASS, RATIO, T_H, Answer, Case, on_grid

HOLDING = 10.0  # s, the longest step of runs with a hold
_TERM = diffrax.ODETerm(lambda t, y, args: y)


def model(case: Case, theta: Array | None = None, bank: Bank | None = None) -> Model:
    """The rig; eight of its parameters multiplied by ``exp(theta)``."""
    factor = jnp.ones(8) if theta is None else jnp.exp(theta)
    m, c_s, c, d_c, t_h, v0, k, cap = factor * jnp.array([MASS, C_S, DAMPING, D_C, T_H, case.velocity, 1.0, 1.0])
    bank = Bank(case.stiffness, case.cap) if bank is None else bank
    times, positions = (jnp.asarray(a) for a in case.drive)
    return Model(
        Block(m, c_s, c),
        Bank(k * bank.stiffness, cap * bank.strength),
        Weakening(RATIO, d_c, t_h),
        LoadPoint(times, positions / case.velocity * v0),
    )


def binned(case: Case, n: int) -> tuple[Bank, float]:
    """The case's bank in n elements, and the bound of its error as a share of the strength."""
    every = Bank(jnp.asarray(case.stiffness), jnp.asarray(case.cap))
    far = jnp.max(every.threshold)
    edges = default_edges(n)
    return bank_from_backbone(every.backbone, far, edges), float(binning_error(every.backbone, far, edges))


def own_run(case: Case, factor: float, bank: Bank | None = None) -> Trajectory:
    """By `integrate`, at the default tolerance divided by ``factor``."""
    held = {"stops": case.drive[0][1:], "largest_step": HOLDING} if case.hold else {}
    trajectory, _ = integrate(model(case, bank=bank), case.duration, tolerance=tighter(factor), **held)
    return trajectory


def answer(case: Case, trajectory: Trajectory) -> Answer:
    """On the grid on which traces are compared, finer than any step: no part of what is timed."""
    steps = trajectory.steps
    return on_grid(case, steps.t, steps.x, steps.v)


def displacement(theta: Array, case: Case, tolerance: Tolerance) -> Array:
    """Displacement (m) at 2001 times of the rig whose eight parameters are multiplied by ``exp(theta)``."""
    rig = model(case, theta)
    ts = jnp.linspace(0.0, case.duration, 2001)
    return diffrax.diffeqsolve(
        _TERM, ContactStepper(tolerance), 0.0, case.duration, 1e-5, rig.rest(), args=(rig, rig.shaped()),
        saveat=diffrax.SaveAt(ts=ts, fn=lambda t, y, args: y.x), stepsize_controller=step_control(0.02),
        adjoint=diffrax.ForwardMode(), max_steps=16384, throw=False,
    ).ys  # fmt: skip


def jacobian_runs(case: Case, factor: float) -> dict[str, Callable[[], np.ndarray]]:
    """One plain run, and three ways to its Jacobian in eight parameters: displacement at 2001 times."""
    zero = jnp.zeros(8)
    run = functools.partial(displacement, case=case, tolerance=tighter(factor))
    plain, forward, many = jax.jit(run), jax.jit(jax.jacfwd(run)), jax.jit(jax.vmap(run))
    moved = jnp.concatenate([zero[None], 0.02 * jnp.eye(8)])
    return {
        "plain run": lambda: np.asarray(plain(zero)),
        "forward mode": lambda: np.asarray(forward(zero)),
        "differences, one by one": lambda: np.stack([np.asarray(plain(m)) for m in moved]),
        "differences, as one batch": lambda: np.asarray(many(moved)),
    }
