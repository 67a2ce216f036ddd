"""Integrate a model from a state to a time, in pieces of bounded memory, with progress and errors that teach."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ...errors import ArgumentError, InputError, SolveError
from ...physics.contact import Bank
from ...physics.model import Model, State
from ...physics.params import check
from ...system.trace_cache import Program, of_this_package
from .limits import PIECE, SMALLEST_STEP
from .tolerance import Tolerance
from .trajectory import UNITS, Stats, Steps, Trajectory, energy_error

LEAST_ADVANCE = 4e-2  # of the contact's period in PIECE steps; the tightest tolerance takes a hundred times as much
ZOOMS = 3  # into a hundredth of a step each, to find where a condition turns true

_ARRAY = "an array"  # in the place of an argument's leaf that is traced


@lru_cache(maxsize=64)
def _program(structure: Any, fixed: tuple, effects: Any) -> Program:
    """:func:`.by_diffrax.take` of arguments of one structure: of their arrays and, by its values, of what is ``fixed``.

    Its trace is kept where all effects are this package's own.
    """

    def piece(*arrays: Any) -> tuple:
        from .by_diffrax import take  # with diffrax, which nobody waits for where the trace is kept

        given = iter(arrays)
        return take(*jax.tree.unflatten(structure, [next(given) if f is _ARRAY else f for f in fixed]))

    return Program(piece, f"piece {structure} {fixed}" if of_this_package(effects) else None)


def _run_piece(*args: Any) -> tuple:
    """:func:`.by_diffrax.take`, compiled; as by ``equinox.filter_jit`` what is no array is not traced."""
    leaves, structure = jax.tree.flatten(args)
    fixed = tuple(_ARRAY if eqx.is_array(leaf) else leaf for leaf in leaves)
    arrays = (leaf for leaf, f in zip(leaves, fixed, strict=True) if f is _ARRAY)
    found: tuple = _program(structure, fixed, jax.tree.structure(args[0].effects))(*arrays)
    return found


def integrate(
    model: Model,
    t1: float,
    *,
    t0: float = 0.0,
    state: State | None = None,
    tolerance: Tolerance | None = None,
    stops: Sequence[float] = (),
    largest_step: float = 0.02,
    most_steps: int = 50_000_000,
    progress: Callable[[float, Steps], None] | None = None,
    until: Callable[[Steps], Any] | None = None,
) -> tuple[Trajectory, State]:
    """Integrate the equation of motion.

    Args:
        model: block, contact, drive and effects.
        t1, t0: end and start (s).
        state: state at ``t0``; a virgin contact at rest at the load point's first position if not given.
        tolerance: error allowed in a step.
        stops: times (s) to land on: kinks of the drive.
        largest_step: longest step (s).
        most_steps: give up after so many steps.
        progress: called now and then with the time reached (s) and the last piece's steps.
        until: ends the run early, where it first turns true: takes :class:`Steps` and says True or False for each of
            them, such as ``lambda steps: steps.x > 1e-4``. What is true within a step only is not seen. One answer for
            all of them, such as ``lambda steps: time.monotonic() > deadline``, ends the run at the last of them.

    Returns:
        The trajectory and the state at its end, which is ``t1`` or where ``until`` turned true.

    Raises:
        InputError: mass, spring, damping, weakening or an element of the contact is outside its range; the end is not
            after the start, the longest step is not positive, the state is that of a model of another form, or
            ``until`` is true at the start, asks for what steps do not have, or does not give True or False for each.
        SolveError: the steps became too small to get anywhere or a number was lost; says when and what to change, and
            has the motion up to there as its ``trajectory``.
    """
    began = time.perf_counter()
    tolerance = Tolerance() if tolerance is None else tolerance
    bank = model.shaped()
    least = LEAST_ADVANCE / PIECE * _refuse_impossible(model, bank)
    if not t0 < t1 < np.inf:
        raise InputError("the end of a run must be after its start", key="t1", value=t1, allowed=f"above {t0:g} s")
    if until is not None and not callable(until):
        allowed = "a function of Steps, such as  lambda steps: steps.x > 1e-4"
        raise ArgumentError("no condition", key="until", value=until, allowed=allowed)
    if not largest_step > 0.0:
        raise InputError(
            "the longest step must be positive", key="largest_step", value=largest_step, allowed="above 0 s"
        )
    state = model.rest(t0) if state is None else state
    kind = jax.tree.structure(state)
    if len(state.memory) != len(model.effects) or np.shape(state.force) != np.shape(bank.strength):
        what = "the state is not one of this model: its effects or the number of its elements are others"
        raise InputError(what, key="state", hint="begin with model.rest(), or go on with the model the state is of")
    kinks = sorted({float(s) for s in stops if t0 < s < t1} | {float(t1)})
    pieces: list[Steps] = []
    accepted = rejected = 0
    now, dt, carried = float(t0), 1e-5, None
    ended = "complete"
    for stop in kinks:
        while now < stop:
            times = jnp.asarray(np.array([now, stop, dt, largest_step]))
            n, missed, content, carry, made, last = _run_piece(model, bank, tolerance, times, state, carried)
            n, missed = int(n), int(missed)
            steps = Steps(*(np.asarray(a)[: n + 1] for a in made))
            if until is not None and ended == "complete" and (moment := _turns(until, steps)) is not None:
                stop, ended = moment, "until"
                if stop < steps.t[-1]:  # the piece once more, to there: its end is a state from which to go on
                    continue
            state, carried = jax.tree.unflatten(kind, last), carry
            accepted, rejected = accepted + n, rejected + missed
            if not pieces:
                pieces.append(Steps(*(a[:1] for a in steps)))
            piece = Steps(*(a[1:] for a in steps))
            pieces.append(piece)
            reached = float(steps.t[-1])
            why = _failure(bool(content), state, accepted, most_steps)
            tried = n + missed
            if why is None and reached < stop and reached - now < least * tried:
                why = (
                    f"{tried} steps advanced it by only {reached - now:.3g} s; look for an effect with a force that "
                    "jumps, or loosen the tolerance"
                )
            if why is not None:
                error = SolveError(
                    f"the integration stopped at t = {reached:.6g} s (v = {float(state.v):.3g} m/s): {why}"
                )
                error.trajectory = _trajectory(pieces, accepted, rejected, began, "failed")
                raise error
            if n > 1:
                dt = float(piece.t[-1] - piece.t[-2])
            now = reached
            if progress is not None:
                progress(now, piece)
        if ended == "until":
            break
        dt = min(dt, 1e-4)
    return _trajectory(pieces, accepted, rejected, began, ended), state


def _turns(until: Callable[[Steps], Any], steps: Steps) -> float | None:
    """Time (s) at which a condition first turns true; None where it does not."""

    def holds(steps: Steps) -> np.ndarray:
        try:
            found = np.asarray(until(steps))
        except AttributeError as error:
            if not isinstance(error.obj, Steps):
                raise
            fields = ", ".join(f"{name} ({UNITS.get(name, 'J')})" for name in Steps._fields)
            what = f"steps have no field '{error.name}'"
            raise ArgumentError(what, key="until", allowed=fields) from None
        if found.dtype != bool or found.shape not in ((), steps.t.shape):
            what, allowed = "it must give True or False for each step", "such as  lambda steps: steps.x > 1e-4"
            raise ArgumentError(what, key="until", value=f"{found.dtype} {found.shape}", allowed=allowed)
        return found

    true = holds(steps)
    if not true.any():
        return None
    if true.ndim == 0:
        return float(steps.t[-1])
    if true[0]:
        raise ArgumentError("it is true at the start already", key="until", value=f"at {steps.t[0]:g} s")
    last = int(np.argmax(true))
    step = Trajectory(Steps(*(a[last - 1 : last + 1] for a in steps)), Stats(1, 0, 0.0, 0.0))
    low, high = map(float, step.steps.t)
    for _ in range(ZOOMS):
        t = np.linspace(low, high, 101)
        first = 1 + int(np.argmax(np.append(holds(step.at(t))[1:-1], True)))
        low, high = float(t[first - 1]), float(t[first])
    return max(high, float(steps.t[0]) + SMALLEST_STEP)


def _trajectory(pieces: list[Steps], accepted: int, rejected: int, began: float, ended: str) -> Trajectory:
    steps = Steps(*(np.concatenate(parts) for parts in zip(*pieces, strict=True)))
    with np.errstate(invalid="ignore", over="ignore"):  # where a number was lost
        error = energy_error(steps)
    return Trajectory(steps, Stats(accepted, rejected, error, time.perf_counter() - began, ended))


def _refuse_impossible(model: Model, bank: Bank) -> float:
    """Refuse what cannot be a rig; the period of the block on its virgin contact and spring (s)."""
    check(model.block, where="block")
    check(model.weakening, where="weakening")
    mass = float(model.mass())
    if not (np.isfinite(mass) and mass > 0.0):
        raise InputError("the moving mass must be positive", key="block.mass", value=mass, allowed="above 0 kg")
    stiffness, strength = np.asarray(bank.stiffness), np.asarray(bank.strength)
    for name, values in (("stiffness", stiffness), ("strength", strength)):
        if not np.all(np.isfinite(values) & (values >= 0.0)):
            worst = float(np.min(values))
            raise InputError(
                f"{name} of a Jenkins element is impossible", key=f"bank.{name}", value=worst, allowed=">= 0"
            )
    return float(2.0 * np.pi * np.sqrt(mass / (stiffness.sum() + float(model.block.spring_stiffness))))


def _failure(content: bool, state: State, accepted: int, most_steps: int) -> str | None:
    """What diffrax reports, in words that say what to change; None where nothing failed."""
    if accepted >= most_steps:
        return f"{accepted} steps were not enough; loosen the tolerance, raise the damping, or simulate less time"
    if not (np.isfinite(state.x) and np.isfinite(state.v)):
        return "position or velocity is no longer a number; look for a parameter far outside its usual range"
    if not content:
        return (
            f"the step size fell below {SMALLEST_STEP:g} s without the error of a step coming down; loosen the "
            "tolerance, or look for an effect with a force that jumps"
        )
    return None
