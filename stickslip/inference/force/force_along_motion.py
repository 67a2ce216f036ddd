"""The model driven by a given motion: no equation of motion is integrated, the friction law is fed what was measured.

Inverse dynamics: contact, weakening and every effect are taken by :meth:`stickslip.physics.model.Model.advance` over
the increments of the motion, as the solver does within its steps. What they give is the force that the model holds
against the block along that motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ...physics.contact import Bank
from ...physics.effects.base import Contact, Drive, Memory, Motion, Sensor
from ...physics.effects.lag import slope
from ...physics.model import Model, State

PASSES = 4  # of undoing a sensor by what it shows
NEWTON = 3  # steps to the elongation of a spring under a force; a linear one is there at once


class Way(NamedTuple):
    """A motion at its knots, shape (n,), the first of which is the start.

    Attributes:
        t, x, v: time (s), displacement (m) and velocity (m/s) of the block.
        drive: the load point as the drive was told (m).
        strength, stretch: factors on caps and on yield displacements of all elements, which vary from event to event.
        shape: power of an element's yield displacement, over the mean of all, by which it is stretched besides, of
            every event, shape (e,): powers are slow, and hundreds of knots have the same.
        of: event of each knot, whose ``shape`` it has.
        load: normal load over its median, 1 where it was not measured.
        force: that was measured to pull the block where no spring does (N).
        bend: of the path from the knot before (m), see :class:`~stickslip.physics.effects.base.Motion`; None where
            knots lie so close to each arrest that straight paths do.
        force_scale: measured over true force of the spring with which ``x`` was made of it (1); None where it was
            measured.
    """

    t: Any
    x: Any
    v: Any
    drive: Any
    strength: Any
    stretch: Any
    shape: Any
    of: Any
    load: Any
    force: Any
    bend: Any = None
    force_scale: Any = None


class Held(NamedTuple):
    """What the model holds along a motion, at its knots.

    Attributes:
        pull: force of the spring (N), shape (n,).
        body: force of effects on the block (N), shape (n,).
        contact: force of the contact against the block (N), shape (n,).
        elements: share of its full strength that each element carries, shape (n, k).
        tangent: stiffness of the elements that stick (N/m), shape (n,).
        slides: whether an element is at its cap, shape (n, k).
        sliding: force of those that slide (N), shape (n,).
        psi: state of the weakening, shape (n,).
    """

    pull: Array
    body: Array
    contact: Array
    elements: Array
    tangent: Array
    slides: Array
    sliding: Array
    psi: Array


class _Rows(NamedTuple):
    """What a loop writes for each knot: as few arrays as there can be, for each costs as much as an element's law."""

    forces: Array
    state: Array
    elements: Array
    slides: Array


def lead(model: Model, t: Array, drive: Array) -> Array:
    """Displacement of the load point (m), effects on the drive included; shape as ``t``."""
    return drive + sum((e.lead(t, drive) for e in model.effects if isinstance(e, Drive)), jnp.zeros(()))


def along(model: Model, way: Way, knots: Array | int | None = None) -> Held:
    """Drive the model along a motion.

    Args:
        model: its load point is not used; the motion brings its own.
        way: what moves.
        knots: number of those that count; the rest is padding, which costs nothing and means nothing. Default all.
    """
    bank = model.shaped()
    led = lead(model, way.t, way.drive)
    pull = jax.vmap(model.pull)(led - way.x)
    mass = model.mass()
    start = model.rest(way.t[0], way.x[0], way.v[0])
    dt, dx = jnp.diff(way.t, prepend=way.t[:1]), jnp.diff(way.x, prepend=way.x[:1])
    items = (way.t, dt, way.x, dx, way.v, led, way.strength, way.stretch, way.of, way.load)
    stiffness = bank.stiffness * jnp.exp(-way.shape[:, None] * departures(bank))
    share = 1.0 / jnp.where(bank.strength > 0.0, bank.strength, 1.0)

    def step(i: Array, carry: tuple[State, _Rows]) -> tuple[State, _Rows]:
        state, rows = carry
        t, dt, x, dx, v, at, strength, stretch, of, load = (a[i] for a in items)
        own = Bank(stiffness[of] * (strength / stretch), bank.strength * strength)
        contact = Contact(state.force, own.stiffness, own.strength, pull[i - 1], state.cap, mass)
        motion = Motion(t, dt, x, v, None if way.bend is None else way.bend[i], dx, at, load=load)
        state, forces = model.advance(state, own, contact, motion)
        sticks = jnp.abs(state.force) < state.cap * (1.0 - 1e-6)
        apiece = jnp.stack([jnp.where(sticks, state.stiffness, 0.0), jnp.where(sticks, 0.0, state.force)])
        here = _Rows(
            jnp.stack([forces.body, total(state.force)]),
            jnp.append(total(apiece), state.psi),
            state.force * share,
            ~sticks,
        )
        return state, _Rows(*(a.at[i].set(b) for a, b in zip(rows, here, strict=True)))

    n, k = way.t.size, share.size
    still = jnp.append(jnp.sum(bank.stiffness), jnp.array([0.0, 1.0]))
    first = _Rows(
        jnp.zeros((n, 2)), jnp.zeros((n, 3)).at[0].set(still), jnp.zeros((n, k)), jnp.zeros((n, k), bool)
    )  # fmt: skip
    rows = jax.lax.fori_loop(1, n if knots is None else knots, step, (start, first))[1]
    (body, held), (tangent, sliding, psi) = rows.forces.T, rows.state.T
    return Held(pull, body, held, rows.elements, tangent, rows.slides, sliding, psi)


def total(values: Array) -> Array:
    """Sum over the last axis, by halves: one by one, in an order that a compiler must keep, it takes longer."""
    n = values.shape[-1]
    while n > 8 and n % 2 == 0:
        n //= 2
        values = values[..., :n] + values[..., n:]
    return jnp.sum(values, axis=-1)


def departures(bank: Bank) -> Array:
    """Logarithm of every element's yield displacement over the geometric mean of all, shape (k,)."""
    reach = jnp.log(bank.strength / bank.stiffness)
    return reach - jnp.mean(reach)


def of_block(model: Model, way: Way, scale: Array, knots: Array | int | None = None) -> Way:
    """The motion of the block from what was read: sensors undone, and the spring where its force was read alone.

    Arguments as of :func:`undone` and :func:`of_spring_force`.
    """
    way = as_sensed(model, way, knots)
    return way if way.force_scale is None else of_spring_force(model, way, scale)


def as_sensed(model: Model, way: Way, knots: Array | int | None = None) -> Way:
    """The motion with the sensors undone: a sensor of the spring's force sees its elongation, not the displacement."""
    if not chain(model):
        return way
    # the measured force, near enough for a sensor that sees it
    force = model.block.spring_stiffness * (way.drive - way.x) + way.force
    if way.force_scale is None:
        return undone(model, way, force, knots)
    speed = slope(way.drive, way.t)
    way = undone(model, way._replace(x=way.x - way.drive, v=way.v - speed), force, knots)
    return way._replace(x=way.x + way.drive, v=way.v + speed)


def undone(model: Model, way: Way, force: Array, knots: Array | int | None = None) -> Way:
    """The motion of the block from that of the reading: the chain of sensor effects undone.

    One after the other, the last one first: by the inverse that a sensor has of its own, or by van Cittert's iteration
    ``x <- x + (reading - sensor(x))``, which needs nothing but the sensor itself; it ends for all that shows most of
    what moves, after few passes where it changes little.

    Args:
        model: with effects on the sensor.
        way: the reading in place of the displacement.
        force: that the contact holds at the knots (N), for sensors that see it, shape (n,).
        knots: number of those that count.
    """
    for sensor in reversed(chain(model)):
        shown = way
        before = sensor.undo(way.t, way.x, way.v)
        if before is not None:
            way = _moved(way, before - way.x)
            continue
        for _ in range(PASSES):
            way = _moved(way, shown.x - read(model, way, force, knots, (sensor,)))
    return way


def of_spring_force(model: Model, way: Way, scale: Array) -> Way:
    """The motion of the block where not the displacement was measured but the force of the spring.

    The block is where the spring of the model has the measured force, behind the load point of the model.

    Args:
        model: with its spring.
        way: its displacement made of the force as it was measured.
        scale: measured over true force (1).
    """
    stretch = way.force_scale / scale * (way.drive - way.x)  # of a linear spring
    force = model.block.spring_stiffness * stretch
    pull = jax.vmap(jax.value_and_grad(model.pull))
    for _ in range(NEWTON):
        found, slopes = pull(stretch)
        stretch = stretch - (found - force) / slopes
    return _moved(way, lead(model, way.t, way.drive) - stretch - way.x)


def _moved(way: Way, further: Array) -> Way:
    return way._replace(x=way.x + further, v=way.v + slope(further, way.t))


def chain(model: Model) -> list[Any]:
    """The effects on the sensor, in the order in which they act."""
    return sorted((e for e in model.effects if isinstance(e, Sensor)), key=lambda e: e.place)


def read(
    model: Model, way: Way, force: Array, knots: Array | int | None = None, sensors: Sequence[Any] | None = None
) -> Array:
    """What sensors show of a motion (m), by default all of the model's, shape (n,).

    Arguments as of :func:`undone`, ``way`` that of the block.
    """
    sensors = chain(model) if sensors is None else sensors
    bank = model.shaped()
    memory = tuple(e.start(bank) if isinstance(e, Memory) else () for e in sensors)
    zero, mass = jnp.zeros_like(bank.stiffness), model.mass()
    dt, dx = jnp.diff(way.t, prepend=way.t[:1]), jnp.diff(way.x, prepend=way.x[:1])
    items = (way.t, dt, way.x, dx, way.v, way.drive, force)

    def step(i: Array, carry: tuple[Any, Array]) -> tuple[Any, Array]:
        states, readings = carry
        t, dt, x, dx, v, at, f = (a[i] for a in items)
        contact = Contact(zero, bank.stiffness, bank.strength, f, zero, mass)
        motion = Motion(t, dt, x, v, None, dx, at)
        states = tuple(
            e.advance(m, motion, contact) if isinstance(e, Memory) else m for e, m in zip(sensors, states, strict=True)
        )
        shown = x
        for e, m in zip(sensors, states, strict=True):
            shown = e.read(m, shown, motion, f)
        return states, readings.at[i].set(shown)

    last = way.t.size if knots is None else knots
    return jax.lax.fori_loop(1, last, step, (memory, way.x))[1]
