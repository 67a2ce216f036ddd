"""What a step of the own solver costs, from the contact's law upwards, beside a step of the compiled leapfrog."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from stickslip.physics.model import State
from stickslip.simulation.solve import Tolerance
from stickslip.simulation.solve.by_diffrax import step_control
from stickslip.simulation.solve.stepper import ContactStepper, D, Increments, _increment

from .case import Case, leapfrog
from .measuring import head, keep, last_table, row, timed
from .own import model, own_run

STEPS, LENGTH = 20_000, 2e-5  # of the loops; s
SPRINGS = (64, 250)
SECONDS = 5.0  # of drive, of the runs


def report(small: bool = False) -> None:
    """Processor time of a step (us), and of what it is made of."""
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
    still, stepper = rig.rest(), ContactStepper(Tolerance())

    def law(i: Array, carried: Loop) -> Loop:
        y, v, given = carried
        value, (y, _, _) = _increment(v, *_problem(given, y, i))
        return y, _next(case, i, value), given

    def derived(i: Array, carried: Loop) -> Loop:
        y, v, given = carried
        problem = _problem(given, y, i)
        (value, (y, _, _)), (slope, _) = jax.jvp(lambda v: _increment(v, *problem), (v,), (jnp.ones(()),))
        return y, _next(case, i, value + slope), given

    def whole(i: Array, carried: Any) -> Any:
        y, solver, given = carried
        times = LENGTH * i, LENGTH * (i + 1.0)
        y, error, _, solver, _ = stepper.step(Increments(), *times, y, given, solver, False)
        return _moved(y, y.x + 1e-30 * error.x), solver, given

    @jax.jit
    def solved(given: Any, y: State) -> Any:
        found = diffrax.diffeqsolve(
            Increments(), stepper, 0.0, case.duration, 1e-5, y, args=given,
            saveat=diffrax.SaveAt(t1=True, fn=lambda t, y, args: y.x), stepsize_controller=step_control(0.02),
            adjoint=diffrax.ForwardMode(), max_steps=100_000,
        )  # fmt: skip
        return found.ys, found.stats["num_steps"]

    given = rig, rig.shaped()
    solver = stepper.init(Increments(), 0.0, LENGTH, still, given)
    leapfrog_s = timed(lambda: leapfrog(case, 5e-5))[1]
    own_run(case, 1.0)
    trajectory, own_s, _ = timed(lambda: own_run(case, 1.0))
    count = int(solved(given, still)[1])
    solved_s = timed(lambda: jax.block_until_ready(solved(given, still)))[1]
    one = still, jnp.zeros(()), given
    return {
        "leapfrog, numba": 1e6 * leapfrog_s / (case.duration / 5e-5),
        "residual of a stage: the law of the contact over one increment": _each(
            law, (still, jnp.zeros(()), given), steps
        ),
        "the same with its derivative": _each(derived, one, steps),
        "step: two stages, each with both": _each(whole, (still, solver, given), steps),
        "step in diffrax's loop, its length controlled": 1e6 * solved_s / count,
        "step of a run, recorded": 1e6 * own_s / (trajectory.stats.steps + trajectory.stats.rejected),
    }


Loop = tuple[State, Array, Any]


def _problem(given: Any, y: State, i: Array) -> tuple:
    """What the residual of a stage is of; the path bends, so that elements may stick within it."""
    rig, bank = given
    t = LENGTH * (i + 1.0)
    return rig, bank, y, rig.contact(y, bank, t - LENGTH), t, LENGTH, 0.0 * t, y.v, rig.lead(t), D * LENGTH


def _next(case: Case, i: Array, value: Array) -> Array:
    """A velocity that goes up and down, so that elements slide and stick; of the last result, but for its size."""
    return case.velocity * (1.0 + 2.0 * jnp.sin(0.1 * i)) + 1e-30 * value


def _moved(y: State, x: Array) -> State:
    return eqx.tree_at(lambda y: y.x, y, x)


def _each(body: Callable[[Array, Any], Any], begun: Any, steps: int) -> float:
    """Processor time of one pass of a compiled loop (us)."""

    @jax.jit
    def loop(carried: Any) -> Any:
        return lax.fori_loop(0, steps, lambda i, c: body(i + 0.0, c), carried)

    jax.block_until_ready(loop(begun))
    return 1e6 * timed(lambda: jax.block_until_ready(loop(begun)), 5)[1] / steps
