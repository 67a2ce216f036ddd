"""A piece of an integration, of bounded memory, by diffrax."""

from __future__ import annotations

from typing import Any

import diffrax
import jax
import jax.numpy as jnp

from ...physics.contact import Bank
from ...physics.effects.base import Motion
from ...physics.model import Model, State
from .limits import PIECE, SMALLEST_STEP
from .stepper import ContactStepper, Increments, Step
from .tolerance import Tolerance
from .trajectory import Steps

TERM = Increments()
_BLANK: Any = 0
_CARRIED: Any = jax.tree.structure((Step(_BLANK, _BLANK), (_BLANK, _BLANK, _BLANK)))  # by solver and controller


def error_norm(error: State) -> jax.Array:
    """Largest of the two scaled errors the solver reports."""
    return jnp.maximum(jnp.abs(error.x), jnp.abs(error.v))


def step_control(dtmax: Any = None) -> diffrax.PIDController:
    """The step-size controller; the solver's error is already scaled, so one is the limit."""
    return diffrax.PIDController(
        rtol=0.0, atol=1.0, pcoeff=0.2, icoeff=0.5, norm=error_norm, dtmin=SMALLEST_STEP, dtmax=dtmax, factormax=5.0
    )


def observe(t: Any, y: State, args: tuple[Model, Bank]) -> Steps:
    """What is recorded at the end of a step."""
    model, bank = args
    lead = model.lead(t)
    zero = jnp.zeros(())
    contact_force = jnp.sum(y.force)
    still = Motion(t + zero, zero + 1e-12, y.x, y.v, zero, zero, lead)
    return Steps(
        t=t + zero,
        x=y.x,
        v=y.v,
        reading=model.read(y, still, contact_force),
        spring_force=model.pull(lead - y.x),
        contact_force=contact_force,
        psi=y.psi,
        sliding=jnp.sum(jnp.where(jnp.abs(y.force) >= (1 - 1e-9) * y.cap, bank.strength, 0.0)) / jnp.sum(bank.strength),
        spring_work=y.work.spring,
        friction_work=y.work.friction,
        viscous_work=y.work.viscous,
        body_work=y.work.body,
        stored=model.stored(y),
    )


def _leaves(t: Any, y: State, args: Any) -> list[jax.Array]:
    """The state as a flat list: diffrax cannot buffer a tree with an empty tuple in it."""
    return jax.tree.leaves(y)


def take(model: Model, bank: Bank, tolerance: Tolerance, times: Any, y: State, carried: Any) -> tuple:
    """At most PIECE steps; ``times`` are start, end, first and largest step (s).

    Returns:
        Numbers of accepted and rejected steps, whether the solver was content, the leaves of what it carries on, the
        fields of the steps, and the leaves of the state at the end.
    """
    t0, t1, dt, dtmax = times
    saves = diffrax.SaveAt(
        subs=[diffrax.SubSaveAt(t0=True, steps=True, fn=observe), diffrax.SubSaveAt(t1=True, fn=_leaves)],
        solver_state=True,
        controller_state=True,
    )
    solver_state, controller_state = (None, None) if carried is None else jax.tree.unflatten(_CARRIED, carried)
    solution = diffrax.diffeqsolve(
        TERM,
        ContactStepper(tolerance=tolerance),
        t0,
        t1,
        dt,
        y,
        args=(model, bank),
        saveat=saves,
        stepsize_controller=step_control(dtmax),
        adjoint=diffrax.ForwardMode(),
        max_steps=PIECE,
        throw=False,
        solver_state=solver_state,
        controller_state=controller_state,
        made_jump=None if carried is None else False,
    )
    steps, leaves = solution.ys
    ends = diffrax.RESULTS.successful, diffrax.RESULTS.max_steps_reached
    content = (solution.result == ends[0]) | (solution.result == ends[1])
    carried = solution.solver_state, solution.controller_state
    if jax.tree.structure(carried) != _CARRIED:
        raise TypeError(f"this release of diffrax carries {jax.tree.structure(carried)} from step to step")
    tried = solution.stats["num_accepted_steps"], solution.stats["num_rejected_steps"]
    return *tried, content, tuple(jax.tree.leaves(carried)), tuple(steps), tuple(leaf[0] for leaf in leaves)
