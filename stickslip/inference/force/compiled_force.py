"""The forces along the motion of one run and their derivatives, compiled."""

from __future__ import annotations

from functools import lru_cache
from operator import attrgetter
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ...physics.contact import Bank
from ...physics.effects.base import Effect, Sensor
from ...physics.model import Block, LoadPoint, Model, Weakening
from ...system.trace_cache import Program, of_this_package
from .composition import DAMPING, PULL, SCALE
from .force_along_motion import Way, along, as_sensed, lead, of_spring_force
from .point import LOCAL, OWN

PROGRAMS = 64  # compiled at a time: each takes some two hundred mappings of memory, of which a process has 65530
EMPTY = 1e-30  # N; an element that holds nothing still shows what it would do
SHAPE = LOCAL.index("shape")
VALUES = np.array([i for i in range(OWN) if i != SHAPE])  # of what is an event's own, those that are given at knots


class Own(NamedTuple):
    """What differs from event to event in one run.

    Attributes:
        value: of every knot's event, in the order of :data:`LOCAL` without the shape, shape (n, 3); zero where none is.
        moves: 1 at a knot of an event, else 0, shape (n, 3).
        shape: of every event; the last one stands for none, and is zero, shape (e,).
        shapes: 1 for an event, else 0, shape (e,).
        of: event of each knot, shape (n,).
    """

    value: Any
    moves: Any
    shape: Any
    shapes: Any
    of: Any


class CommonInput(NamedTuple):
    """What the forces of all runs are computed from.

    Attributes:
        effects: their leaves; those that are free have other values.
        weights, reach: of the bank, shapes (k,): strengths (N) and yield displacements (m).
    """

    effects: Any
    weights: Any
    reach: Any

    @property
    def bank(self) -> Bank:
        """The contact."""
        return Bank(self.weights / self.reach, self.weights)


class RunInput(NamedTuple):
    """What the forces of one run are computed from besides.

    Attributes:
        spring: of the run (N/m), nan where it has none of its own.
        way: the measured motion.
        knots: how many points of it count.
        own: of its events.
    """

    spring: Any
    way: Way
    knots: Any
    own: Own


@lru_cache(maxsize=PROGRAMS)
def compiled(names: tuple[str, ...], phases: tuple[str, ...], structure: Any, whole: bool) -> Program:
    """The compiled forces at the knots of one run, shape (n,), with derivatives in shared, phases and locals.

    Those in locals alone where they are not wanted as a ``whole``.

    Runs and events are not in its shapes, so that all campaigns share it.
    """
    a, b = len(names), len(phases)

    def forces(z: Any, turn: Any, own: Own, scales: Any, fixed: Any, common: CommonInput, run: RunInput) -> Any:
        effects, way, knots = jax.tree.unflatten(structure, common.effects), run.way, run.knots
        si = {n: jnp.where(s == 0.0, jnp.exp(v), v * s) for n, v, s in zip(names, z, scales, strict=True)}
        values = {**fixed, **si, **dict(zip(phases, turn, strict=True))}
        if PULL in values:
            stiffness = jnp.where(jnp.isnan(run.spring), values["rig.spring_stiffness"], run.spring)
            way = way._replace(drive=way.drive + values[PULL] / stiffness)
        model = model_of(values, effects, common.bank, run.spring)
        seen, delay = way, jnp.zeros(())
        if any(isinstance(e, Sensor) for e in effects):

            def before(rate: Any) -> Way:
                return as_sensed(model, way._replace(v=rate), knots)

            seen, ahead = jax.jvp(before, (way.v,), (jnp.ones_like(way.v),))
            delay = jnp.sum(ahead.x) / way.x.size  # a reading that is late is taken ahead by its rate
        # how much what is sensed changes where the reading does
        steps = jnp.diff(way.x if way.force_scale is None else way.x - way.drive)
        gain = 1.0 + jnp.sum(steps * jnp.diff(seen.x - way.x)) / jnp.sum(steps**2)
        if way.force_scale is not None:
            seen = of_spring_force(model, seen, values[SCALE])
        shift = seen.x - way.x
        held = along(model, of_events(seen, own), knots)
        led = lead(model, way.t, way.drive)
        steep = jax.vmap(jax.grad(model.pull))(led - seen.x)
        # what a reading counts for: by the force of the spring, and by the displacement
        creeps, moves = gain * steep, gain * jnp.ones_like(steep)
        if way.force_scale is not None:
            told = gain * way.force_scale / values[SCALE] * model.block.spring_stiffness  # the force itself is read
            creeps, moves = told * jnp.ones_like(steep), told / steep
        return (
            (held.pull + way.force + held.body - held.contact, shift, model.mass(), steep, creeps, moves, delay),
            (held.elements, held.tangent, held.slides, held.sliding, held.psi),
        )

    def derived(z: Any, turn: Any, scales: Any, turn_scale: Any, fixed: Any, common: CommonInput, run: RunInput) -> Any:
        own = run.own

        def moved(row: Any) -> Any:
            def f(z: Any, turn: Any, value: Any, shape: Any) -> Any:
                return forces(z, turn, own._replace(value=value, shape=shape), scales, fixed, common, run)

            # all events are moved at once: each acts on its own points only
            steps = own.moves * row[a + b :][VALUES], own.shapes * row[a + b + SHAPE]
            given = (z, turn, own.value, own.shape), (row[:a], row[a : a + b] * turn_scale, *steps)
            return jax.jvp(f, *given, has_aux=True)

        out, slope, aux = jax.vmap(moved, out_axes=(None, 0, None))(jnp.eye(a + b + OWN)[0 if whole else a + b :])
        return *out, *slope, *aux

    name = f"{'along' if whole else 'forces along'} {names} {phases} {structure}"
    return Program(derived, name if of_this_package(structure) else None)


def model_of(values: dict[str, Any], effects: tuple[Effect, ...], bank: Bank, own: Any) -> Model:
    """The model with these numbers; ``own`` is the spring of the run (N/m), nan where it has none."""
    spring = jnp.where(jnp.isnan(own), values["rig.spring_stiffness"], own)
    block = Block(mass=values["rig.mass"], spring_stiffness=spring, damping=values[DAMPING])
    weakening = Weakening(
        ratio=1.0 - values["weakening.drop"],
        slip_distance=values["weakening.slip_distance"],
        healing_time=values["weakening.healing_time"],
    )
    still = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, 0.0]))
    return Model(block, bank, weakening, still, tuple(_set(e, values) for e in effects))


def _set(effect: Effect, values: dict[str, Any]) -> Effect:
    for name, value in values.items():
        tag, _, own = name.partition(".")
        if tag == effect.tag:
            effect = eqx.tree_at(attrgetter(own), effect, value)
    return effect


def of_events(way: Way, own: Own) -> Way:
    """The way with what differs from event to event."""
    strength, stretch, offset = own.value.T
    return way._replace(
        x=way.x + offset,
        strength=way.strength * jnp.exp(strength),
        stretch=way.stretch * jnp.exp(stretch),
        shape=own.shape,
        of=own.of,
    )
