"""The model driven by a given motion: no equation of motion is integrated, the friction law is fed what was measured.

Inverse dynamics: contact, weakening and every effect are taken by :meth:`stickslip.model.Model.advance` over the
increments of the motion, as the solver does within its steps. What they give is the force that the model holds against
the block along that motion.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from ..contact import Bank
from ..effects.base import Contact, Drive, Memory, Motion, Sensor
from ..model import Model, State

PASSES = 4  # of undoing the sensor


class Way(NamedTuple):
    """A motion at its knots, shape (n,), the first of which is the start.

    Attributes:
        t, x, v: time (s), displacement (m) and velocity (m/s) of the block.
        drive: the load point as the drive was told (m).
        turn: from the knot before to the turning point within the increment (m); zero where there is none.
        strength, stretch: factors on caps and on yield displacements of all elements, which vary from event to event.
    """

    t: Any
    x: Any
    v: Any
    drive: Any
    turn: Any
    strength: Any
    stretch: Any


class Held(NamedTuple):
    """What the model holds along a motion, at its knots.

    Attributes:
        pull: force of the spring (N), shape (n,).
        body: force of effects on the block (N), shape (n,).
        contact: force of the contact against the block (N), shape (n,).
        elements: share of its full strength that each element carries, shape (n, k).
        tangent: stiffness of the elements that stick (N/m), shape (n,).
    """

    pull: Array
    body: Array
    contact: Array
    elements: Array
    tangent: Array


def lead(model: Model, t: Array, drive: Array) -> Array:
    """Displacement of the load point (m), effects on the drive included; shape as ``t``."""
    return drive + sum((e.lead(t, drive) for e in model.effects if isinstance(e, Drive)), jnp.zeros(()))


def along(model: Model, way: Way) -> Held:
    """Drive the model along a motion.

    Args:
        model: its load point is not used; the motion brings its own.
        way: what moves.
    """
    bank = model.shaped()
    led = lead(model, way.t, way.drive)
    mass = model.mass()
    start = model.rest(way.t[0], way.x[0], way.v[0])

    def step(carry: tuple[State, Array], item: tuple[Array, ...]) -> tuple[tuple[State, Array], tuple[Array, ...]]:
        state, pull = carry
        t, dt, x, dx, v, at, turn, strength, stretch = item
        own = Bank(bank.stiffness * (strength / stretch), bank.strength * strength)
        contact = Contact(state.force, own.stiffness, own.strength, pull, state.cap, mass)
        motion = Motion(t, dt, x, v, turn, dx, at)
        state, forces = model.advance(state, own, contact, motion)
        sticks = jnp.abs(state.force) < state.cap * (1.0 - 1e-6)
        tangent = jnp.sum(jnp.where(sticks, state.stiffness, 0.0))
        out = (forces.spring, forces.body, forces.contact, state.force, tangent)
        return (state, forces.spring), out

    dt, dx = jnp.diff(way.t), jnp.diff(way.x)
    items = (way.t[1:], dt, way.x[1:], dx, way.v[1:], led[1:], way.turn[1:], way.strength[1:], way.stretch[1:])
    pull = model.pull(led[0] - way.x[0])
    _, (pulls, body, contact, elements, tangent) = jax.lax.scan(step, (start, pull), items)

    def begun(first: Array, rest: Array) -> Array:
        return jnp.concatenate([first[None], rest])

    share = bank.strength
    return Held(
        begun(pull, pulls),
        begun(jnp.zeros(()), body),
        begun(jnp.zeros(()), contact),
        begun(jnp.zeros_like(share), elements / jnp.where(share > 0.0, share, 1.0)),
        begun(jnp.sum(bank.stiffness), tangent),
    )


def turning(t: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Way from the knot before to the turning point of each increment (m), by a constant deceleration; else zero."""
    before, after = v[:-1], v[1:]
    reverses = before * after < 0.0
    apart = np.where(reverses, before - after, 1.0)
    return np.concatenate([[0.0], np.where(reverses, 0.5 * np.diff(t) * before**2 / apart, 0.0)])


def undone(model: Model, way: Way, force: Array) -> Way:
    """The motion of the block from that of the reading: the chain of sensor effects undone.

    By van Cittert's iteration ``x <- x + (reading - sensor(x))``, which needs nothing but the sensor itself; it ends
    for every filter that loses or delays less than it shows, after few passes where it changes little.

    Args:
        model: with effects on the sensor.
        way: the reading in place of the displacement.
        force: that the contact holds at the knots (N), for sensors that see it, shape (n,).
    """
    if not any(isinstance(e, Sensor) for e in model.effects):
        return way
    seen = way.x
    for _ in range(PASSES):
        shift = way.x + (seen - read(model, way, force)) - seen
        way = way._replace(x=seen + shift, v=way.v + _slope(shift, way.t) - _slope(way.x - seen, way.t))
    return way


def read(model: Model, way: Way, force: Array) -> Array:
    """What the sensors show of a motion (m), shape (n,); arguments as of :func:`undone`, ``way`` that of the block."""
    sensors: list[Any] = sorted((e for e in model.effects if isinstance(e, Sensor)), key=lambda e: e.place)
    bank = model.shaped()
    memory = tuple(e.start(bank) if isinstance(e, Memory) else () for e in sensors)
    zero, mass = jnp.zeros_like(bank.stiffness), model.mass()

    def step(states: Any, item: tuple[Array, ...]) -> tuple[Any, Array]:
        t, dt, x, dx, v, at, f = item
        contact = Contact(zero, bank.stiffness, bank.strength, f, zero, mass)
        motion = Motion(t, dt, x, v, jnp.zeros(()), dx, at)
        states = tuple(
            e.advance(m, motion, contact) if isinstance(e, Memory) else m for e, m in zip(sensors, states, strict=True)
        )
        shown = x
        for e, m in zip(sensors, states, strict=True):
            shown = e.read(m, shown, motion, f)
        return states, shown

    items = (way.t[1:], jnp.diff(way.t), way.x[1:], jnp.diff(way.x), way.v[1:], way.drive[1:], force[1:])
    _, shown = jax.lax.scan(step, memory, items)
    return jnp.concatenate([way.x[:1], shown])


def _slope(y: Array, t: Array) -> Array:
    """Rate of change at the knots by parabolas through three of them."""
    dt, dy = jnp.diff(t), jnp.diff(y)
    rate = dy / dt
    inner = (rate[:-1] * dt[1:] + rate[1:] * dt[:-1]) / (dt[:-1] + dt[1:])
    return jnp.concatenate([rate[:1], inner, rate[-1:]])
