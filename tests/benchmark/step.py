"""What a step of the own solver costs, from the contact's law upwards, beside a step of the compiled leapfrog."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
from jax import Array, lax

from stickslip.physics.effects.base import Motion
from stickslip.physics.model import State
from stickslip.simulation.solve import ContactStepper, Tolerance
from stickslip.simulation.solve.integrate import step_control
from stickslip.simulation.solve.stepper import Increments

from .case import Case, leapfrog
from .measuring import head, keep, last_table, row, timed
from .own import model, own_run

STEPS, LENGTH = 20_000, 2e-5  # of the loops; s
SPRINGS = (64, 250)
SECONDS = 5.0  # of drive, of the runs


def report(small: bool = False) -> None:
    """Processor time of a step (us), by parts that contain one another."""
    steps = STEPS // 20 if small else STEPS
    columns = [_costs(Case(n, 0.2 if small else SECONDS), steps) for n in SPRINGS]
    head("step", *(f"{n} springs, us" for n in SPRINGS))
    for name in columns[0]:
        row(name, *(f"{column[name]:.2f}" for column in columns))
    if not small:
        keep("step", "step", **last_table())


def _costs(case: Case, steps: int) -> dict[str, float]:
    """Name -> processor time of a step (us)."""
    rig = model(case)
    bank, still = rig.shaped(), rig.rest()
    tolerance = Tolerance()
    stepper = ContactStepper(tolerance)

    def increment(i: Array, y: State) -> tuple[State, Array]:
        t = LENGTH * (i + 1.0)
        dx = 1e-3 * case.velocity * LENGTH * (1.0 + i % 2)
        motion = Motion(t, jnp.asarray(LENGTH), y.x + dx, dx / LENGTH, jnp.zeros(()), dx, rig.lead(t))
        y, forces = rig.advance(y, bank, rig.contact(y, bank, t - LENGTH), motion)
        return y, forces.net

    def law(i: Array, y: State) -> State:
        y, net = increment(i, y)
        return _with_x(y, y.x + 1e-30 * net)

    def derived(i: Array, y: State) -> State:
        (after, _), (_, slope) = jax.jvp(lambda x: increment(i, _with_x(y, x)), (y.x,), (jnp.ones(()),))
        return _with_x(after, after.x + 1e-30 * slope)

    def whole(i: Array, carried: Any) -> Any:
        y, solver = carried
        y, error, _, solver, _ = stepper.step(
            Increments(), LENGTH * i, LENGTH * (i + 1.0), y, (rig, bank), solver, False
        )
        return _with_x(y, y.x + 1e-30 * error.x), solver

    @jax.jit
    def solved() -> Any:
        found = diffrax.diffeqsolve(
            Increments(), stepper, 0.0, case.duration, 1e-5, still, args=(rig, bank),
            saveat=diffrax.SaveAt(t1=True, fn=lambda t, y, args: y.x), stepsize_controller=step_control(0.02),
            adjoint=diffrax.ForwardMode(), max_steps=100_000,
        )  # fmt: skip
        return found.ys, found.stats["num_steps"]

    leapfrog_s = timed(lambda: leapfrog(case, 5e-5))[1]
    begun = still, stepper.init(Increments(), 0.0, LENGTH, still, (rig, bank))
    own_run(case, 1.0)
    trajectory, own_s, _ = timed(lambda: own_run(case, 1.0))
    tried = trajectory.stats.steps + trajectory.stats.rejected
    count = int(solved()[1])
    return {
        "leapfrog, numba": 1e6 * leapfrog_s / (case.duration / 5e-5),
        "law of the contact over one increment": _each(law, still, steps),
        "the same with its derivative in the displacement": _each(derived, still, steps),
        "step of the solver: two stages of Newton's method, each with both": _each(whole, begun, steps),
        "the same in diffrax's loop, with control of the step": 1e6 * timed(lambda: _ready(solved()))[1] / count,
        "the same in a run, recorded": 1e6 * own_s / tried,
    }


def _with_x(y: State, x: Array) -> State:
    return State(x, y.v, y.force, y.cap, y.stiffness, y.psi, y.memory, y.work)


def _each(body: Callable[[Array, Any], Any], begun: Any, steps: int) -> float:
    """Processor time of one pass of a compiled loop (us)."""

    @functools.partial(jax.jit)
    def loop(carried: Any) -> Any:
        return lax.fori_loop(0, steps, lambda i, c: body(i + 0.0, c), carried)

    _ready(loop(begun))
    return 1e6 * timed(lambda: _ready(loop(begun)), 5)[1] / steps


def _ready(found: Any) -> Any:
    return jax.block_until_ready(found)
