"""The model driven by a given motion: no equation of motion is integrated, the friction law is fed what was measured.

Inverse dynamics: contact, weakening and every effect are taken by :meth:`stickslip.model.Model.advance` over the
increments of the motion, as the solver does within its steps. What they give is the force that the model holds against
the block along that motion.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..contact import Bank
from ..effects.base import Contact, Drive, Effect, Memory, Motion, Sensor
from ..model import Model, State


class Way(NamedTuple):
    """A motion at its knots, shape (n,), the first of which is the start.

    Attributes:
        t, x, v: time (s), displacement (m) and velocity (m/s) of the block.
        drive: the load point as the drive was told (m).
        strength, stretch: factors on caps and on yield displacements of all elements, which vary from event to event.
    """

    t: Array
    x: Array
    v: Array
    drive: Array
    strength: Array
    stretch: Array


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
    start = State(
        start.x, start.v, start.force, start.cap, start.stiffness, start.psi, start.memory, start.work
    )

    def step(carry: tuple[State, Array], item: tuple[Array, ...]) -> tuple[tuple[State, Array], tuple[Array, ...]]:
        state, pull = carry
        t, dt, x, dx, v, at, strength, stretch = item
        own = Bank(bank.stiffness * (strength / stretch), bank.strength * strength)
        contact = Contact(state.force, own.stiffness, own.strength, pull, state.cap, mass)
        motion = Motion(t, dt, x, v, jnp.zeros(()), dx, at)
        state, forces = model.advance(state, own, contact, motion)
        sticks = jnp.abs(state.force) < state.cap * (1.0 - 1e-6)
        tangent = jnp.sum(jnp.where(sticks, state.stiffness, 0.0))
        out = (forces.spring, forces.body, forces.contact, state.force, tangent)
        return (state, forces.spring), out

    dt, dx = jnp.diff(way.t), jnp.diff(way.x)
    items = (way.t[1:], dt, way.x[1:], dx, way.v[1:], led[1:], way.strength[1:], way.stretch[1:])
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


def undone(model: Model, way: Way, force: Array) -> Way:
    """The motion of the block from that of the reading: the chain of sensor effects undone, knot by knot.

    Args:
        model: with effects on the sensor.
        way: the reading in place of the displacement.
        force: that the contact holds at the knots (N), for sensors that see it, shape (n,).
    """
    sensors: list[Effect] = sorted((e for e in model.effects if isinstance(e, Sensor)), key=_place)
    if not sensors:
        return way
    bank = model.shaped()
    memory = tuple(e.start(bank) if isinstance(e, Memory) else () for e in sensors)
    zero = jnp.zeros_like(bank.stiffness)
    mass = model.mass()

    def step(carry: tuple[Any, Array, Array, Array], item: tuple[Array, ...]) -> tuple[Any, tuple[Array, Array]]:
        states, x0, y0, v0 = carry
        t, dt, y, v, at, f = item
        contact = Contact(zero, bank.stiffness, bank.strength, at - x0, zero, mass)

        def read(shift: Array) -> tuple[Array, Any]:
            # how much the block moved beyond what the reading did; its velocity changes along
            dx = y - y0 + shift
            motion = Motion(t, dt, x0 + dx, v + 2.0 * shift / dt - v0, jnp.zeros(()), dx, at)
            after = tuple(
                e.advance(m, motion, contact) if isinstance(e, Memory) else m
                for e, m in zip(sensors, states, strict=True)
            )
            seen = x0 + dx
            for e, m in zip(sensors, after, strict=True):
                seen = e.read(m, seen, motion, f)  # type: ignore[attr-defined]
            return seen, after

        shift = jnp.zeros(())
        for _ in range(2):  # a chain of linear filters is undone by the first
            (seen, slope) = jax.jvp(lambda s: read(s)[0], (shift,), (jnp.ones(()),))
            shift = shift - (seen - y) / slope
        _, after = read(shift)
        x = x0 + (y - y0) + shift
        return (after, x, y, 2.0 * shift / dt - v0), (x, v + 2.0 * shift / dt - v0)

    dt = jnp.diff(way.t)
    items = (way.t[1:], dt, way.x[1:], way.v[1:], way.drive[1:], force[1:])
    first = (memory, way.x[0], way.x[0], jnp.zeros(()))
    _, (x, v) = jax.lax.scan(step, first, items)
    return way._replace(x=jnp.concatenate([way.x[:1], x]), v=jnp.concatenate([way.v[:1], v]))


def _place(effect: Effect) -> int:
    return getattr(effect, "place", 0)
