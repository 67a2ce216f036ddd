"""The model through the events of a measured run: multiple shooting with the clock and position of the data.

A run is a chain of cycles, each from one arrest to the next. Within a cycle the model is on its own; at each arrest its
clock is set to what was measured, and its position to where its sensor shows what was measured, so drive phase and
holds stay where the data have them and no event can be paired wrongly. The contact's state (forces, weakening, memory
of every effect) is the model's own throughout.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..physics.contact.memory import loading_displacement
from ..physics.effects.base import Motion
from ..physics.model import Model, State
from .solve.by_diffrax import TERM, step_control
from .solve.stepper import ContactStepper
from .solve.tolerance import Tolerance

LARGEST_STEP = 0.01  # s
MOST_STEPS = 3072  # of one cycle; ordinary stick-slip takes 300 to 1200, a hold a hundred more each second


def longest(most_steps: int) -> float:
    """Duration (s) of a cycle that so many steps take to its end, if it is quiet."""
    return LARGEST_STEP * most_steps


class Cycles(NamedTuple):
    """What the data say of one run's cycles; arrays of shape (n,) but for the load point's nodes (m,).

    Attributes:
        start: time of the arrest (or of the trace's start) the cycle begins with (s).
        position: reading there (m).
        limit: time at which an unfinished cycle is given up (s).
        least_slip: displacement after which standing still is an arrest (m).
        ends: whether the cycle ends with an arrest in the data.
        used: false for padding.
        load_times, load_positions: nodes of the load point (s, m).
        stiffness: of the driving spring where this run has another than the rig (N/m), else nan.
        virgin: whether the run starts from a force-free contact at rest.
        run: number of the run.
        stretch: load point less reading at the onsets (m): where the record does not begin with a virgin contact,
            the spring is stretched already, by what is known only from when it slips.
    """

    start: Any
    position: Any
    limit: Any
    least_slip: Any
    ends: Any
    used: Any
    load_times: Any
    load_positions: Any
    stiffness: Any
    virgin: Any
    run: Any = 0
    stretch: Any = 0.0


class Track(NamedTuple):
    """Accepted steps of one cycle, shape (most_steps,), padded with the last one.

    Attributes:
        t, x, v, reading: time (s), displacement (m), velocity (m/s), reading (m).
        arrest: time of the arrest, in the cycle's clock (s); the end of the track where there was none.
        arrested: whether there was one.
        steps: number of steps.
    """

    t: Array
    x: Array
    v: Array
    reading: Array
    arrest: Array
    arrested: Array
    steps: Array


def cut_short(tracks: Track, cycles: Cycles) -> np.ndarray:
    """Which used cycles broke off before the arrest and before the limit, shape (n,).

    They wanted more steps than they were given, or a step became too small: what the track says of such a cycle, and of
    those after it, is not what the model says. Taken from the finished tracks, so that the compiled program stays as
    it is (another output would change its rounding).
    """
    ends, limits = np.asarray(tracks.t)[..., -1], np.asarray(cycles.limit)
    early = ends < limits - 1e-9 * np.maximum(np.abs(limits), 1.0)
    return np.asarray(cycles.used) & ~np.asarray(tracks.arrested) & early


def _reading(model: Model, t: Any, y: State) -> Array:
    """What the sensor shows of a state (m)."""
    still = Motion(t + 0.0 * y.x, 1e-12 + 0.0 * y.x, y.x, y.v, 0.0 * y.x, 0.0 * y.x, model.lead(t))
    return model.read(y, still, jnp.sum(y.force))


def _observe(t: Any, y: State, args: Any) -> tuple[Array, ...]:
    model, *_ = args
    seen = t + 0.0 * y.x, y.x, y.v, _reading(model, t, y)
    return (*seen, model.rising(y)) if model.late else seen


class _CycleStepper(ContactStepper):
    """The same solver; ``args`` also hold where the cycle began."""

    def init(self, terms: Any, t0: Any, t1: Any, y0: State, args: Any) -> Any:
        return super().init(terms, t0, t1, y0, args[:2])

    def func(self, terms: Any, t0: Any, y0: State, args: Any) -> Any:
        return super().func(terms, t0, y0, args[:2])

    def step(self, terms: Any, t0: Any, t1: Any, y0: State, args: Any, solver_state: Any, made_jump: Any) -> Any:
        return super().step(terms, t0, t1, y0, args[:2], solver_state, made_jump)


def _arrested(t: Any, y: State, args: Any, **kwargs: Any) -> Array:
    model, _, x0, least_slip = args
    return (model.rising(y) <= 0.0) & (y.x - x0 > least_slip)


def run_cycle(
    model: Model, y: State, t0: Array, limit: Array, least_slip: Array, tolerance: Tolerance, most_steps: int
) -> tuple[Track, State, Array]:
    """Integrate one cycle until the reading stands still after a slip, or until ``limit`` (s).

    The data know an arrest as the top of the reading. Without a sensor that is late that is where the block stands.

    Returns:
        The track, the state at its end, and the time of that end (s).
    """
    args = (model, model.shaped(), y.x, least_slip)
    solution = diffrax.diffeqsolve(
        TERM,
        _CycleStepper(tolerance=tolerance),
        t0,
        limit,
        jnp.minimum(2e-5, 0.5 * (limit - t0)),
        y,
        args=args,
        saveat=diffrax.SaveAt(
            subs=[
                diffrax.SubSaveAt(steps=True, fn=_observe),
                diffrax.SubSaveAt(t1=True, fn=lambda t, y, a: jax.tree.leaves(y)),
            ]
        ),
        stepsize_controller=step_control(LARGEST_STEP),
        adjoint=diffrax.ForwardMode(),
        max_steps=most_steps,
        throw=False,
        event=diffrax.Event(_arrested),
    )
    n = solution.stats["num_accepted_steps"]
    (t, x, v, reading, *rising), leaves = solution.ys
    end = jax.tree.unflatten(jax.tree.structure(y), [leaf[0] for leaf in leaves])
    last = jnp.maximum(n - 1, 0)
    padded = jnp.arange(most_steps) < n
    t, x, v, reading = (jnp.where(padded, a, a[last]) for a in (t, x, v, reading))
    arrested = (model.rising(end) <= 0.0) & (end.x - y.x > least_slip)
    before = jnp.maximum(n - 2, 0)
    (rate,) = rising or (v,)
    fall = jnp.where(arrested, rate[before] - rate[last], 1.0)
    # the rate is nearly linear in time around its zero: two steps share the crossing
    arrest = jnp.where(arrested, t[last] + (t[last] - t[before]) * rate[last] / fall, t[last])
    return Track(t, x, v, reading, arrest, arrested, n), end, t[last]


def _share(new: Array, old: Array) -> Array:
    """new/old, one for an element that had no strength."""
    return jnp.where(old > 0, new / jnp.where(old > 0, old, 1.0), 1.0)


def _in_stick(model: Model, pull: Array) -> Array:
    """Forces (N) of the elements of a contact that rests under a ``pull`` (N) at full strength, some time after an
    arrest: there each was at its weakened cap; since then all were moved by one distance."""
    bank = model.shaped()
    left = bank.strength * model.weakening.ratio
    load = pull - jnp.sum(left)
    further = loading_displacement(bank.stiffness, bank.strength - left, load)
    back = loading_displacement(bank.stiffness, bank.strength + left, -load)
    return jnp.clip(left + bank.stiffness * (further - back), -bank.strength, bank.strength)


def run_cycles(
    build: Callable[[Any, tuple[Array, Array]], Model],
    events: Any,
    cycles: Cycles,
    tolerance: Tolerance,
    most_steps: int = MOST_STEPS,
) -> Track:
    """All cycles of one run.

    Args:
        build: the model of a cycle, from that cycle's entry of ``events`` and the load point's nodes.
        events: a pytree of arrays (n, ...): what varies from event to event.
        cycles: what the data say.
        tolerance: of the solver.
        most_steps: of one cycle.

    Returns:
        Tracks with a leading axis of cycles.
    """
    nodes = (cycles.load_times, cycles.load_positions)
    first = build(jax.tree.map(lambda a: a[0], events), nodes)
    start = first.rest(cycles.start[0], cycles.position[0])
    pull = first.pull(first.lead(cycles.start[0]) - start.x)
    start = eqx.tree_at(lambda s: s.force, start, jnp.where(cycles.virgin, start.force, _in_stick(first, pull)))

    def cycle(carry: tuple, item: tuple) -> tuple[tuple, Track]:
        y, past, offset, strength = carry
        event, t0, position, limit, least_slip, used = item
        model = build(event, nodes)
        # new lines keep the share of its cap that every element carries: at arrest all of them are at their caps
        y = eqx.tree_at(
            lambda s: (s.x, s.force),
            y,
            (position + offset, y.force * _share(model.bank.strength, strength)),
        )
        zero = jax.tree.map(jnp.zeros_like, y.work)
        y = eqx.tree_at(lambda s: s.work, y, zero)
        track, end, now = run_cycle(
            model, y, t0 + past, jnp.where(used, limit, t0 + past + 1e-6), least_slip, tolerance, most_steps
        )
        late = now - track.arrest
        # the velocity is nearly linear around its zero: how far the block has come back since the arrest; a reading
        # that is late is flat there
        back = 0.0 if model.late else 0.5 * track.v[-1] * late
        return (end, late, end.x - track.reading[-1] + back, model.bank.strength), track

    zero = jnp.zeros(())
    # of the reading, as at every later arrest; a virgin contact's spring is as long as it is, whatever the sensor shows
    ahead = jnp.where(cycles.virgin, 0.0, start.x - _reading(first, cycles.start[0], start))
    items = (events, cycles.start, cycles.position, cycles.limit, cycles.least_slip, cycles.used)
    tracks: Track
    _, tracks = jax.lax.scan(cycle, (start, zero, ahead, first.bank.strength), items)
    return tracks
