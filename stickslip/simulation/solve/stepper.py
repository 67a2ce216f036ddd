"""TR-BDF2 for a block on a bank of Jenkins elements: a diffrax solver whose step contains the return map.

A vector field with kinks handed to a stock solver is an invalid input: the kinks lie wherever an element starts or
stops to slide. Here a step is an increment, as in finite elements: position and velocity follow TR-BDF2 (Bank et al.
1985; L-stable, second order, third-order error estimate of Hosea & Shampine 1996), while contact and effects are
taken by their own exact or implicit update from the start of the step to each of its two stages. Each stage is a
scalar equation in the velocity, solved by Newton's method. Where the contact holds the block the stages follow its
oscillation in closed form (:mod:`.stages`). The path of a step is a parabola: where it turns, and where elements stick
as the block slows down, is kept without landing on it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, ClassVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...physics.contact import Bank
from ...physics.effects.base import BodyForce, Contact, Motion
from ...physics.model import Forces, Model, State, Work
from .oscillation import Oscillation, followed, widest
from .stages import (
    GAMMA,
    D,
    Stage,
    first_stage,
    integral_of_square,
    local_error,
    second_stage,
    work_of_force,
)
from .tolerance import TINY, Tolerance
from .trajectory import hermite

SHORT = 0.53  # error after which the controller keeps the length of the step
UNHEARD = 0.3  # of the velocity's amplitude: at most the error of a step that does not follow the oscillation


class Increments(diffrax.AbstractTerm):
    """Stands where diffrax wants a vector field: the solver takes the model through increments itself.

    diffrax asks it for nothing but shapes; an ODETerm would promote the state's types leaf by leaf for that.
    """

    def vf(self, t: Any, y: Any, args: Any) -> Any:
        return y

    def contr(self, t0: Any, t1: Any, **kwargs: Any) -> Any:
        return t1 - t0

    def prod(self, vf: Any, control: Any) -> Any:
        return vf


class HermiteInterpolation(diffrax.AbstractLocalInterpolation):
    """Cubic in the displacement, its derivative in the velocity, linear in the rest."""

    t0: Any  # type: ignore[misc]  # diffrax declares both as class variables
    t1: Any  # type: ignore[misc]
    y0: State
    y1: State

    def evaluate(self, t0: Any, t1: Any = None, left: bool = True) -> State:
        if t1 is not None:
            return jax.tree.map(jnp.subtract, self.evaluate(t1), self.evaluate(t0))
        h = self.t1 - self.t0
        length = jnp.where(h > 0, h, 1.0)
        s = jnp.where(h > 0, (t0 - self.t0) / length, 0.0)
        y = jax.tree.map(lambda a, b: a + s * (b - a), self.y0, self.y1)
        dx, v0, v1 = self.y1.x - self.y0.x, self.y0.v, self.y1.v
        x = self.y0.x + hermite(s, h, dx, v0, v1)
        v = 6.0 * s * (1.0 - s) * dx / length + (1.0 - s) * (1.0 - 3.0 * s) * v0 + s * (3.0 * s - 2.0) * v1
        return eqx.tree_at(lambda y: (y.x, y.v), y, (x, v))


class Step(eqx.Module):
    """What the solver carries from step to step: the acceleration at its start and the share of sliding elements."""

    acceleration: Array
    failed: Array


class ContactStepper(diffrax.AbstractAdaptiveSolver):
    """The solver. ``terms`` is an :class:`Increments`: its vector field is never called, the model is ``args``.

    Attributes:
        tolerance: see :class:`Tolerance`; the returned error is already divided by it.
        newton_steps: most Newton iterations of a stage; a stage that needs more makes the step fail and be halved.
    """

    tolerance: Tolerance
    newton_steps: int = eqx.field(default=12, static=True)

    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar[Callable[..., HermiteInterpolation]] = HermiteInterpolation

    def order(self, terms: Any) -> int:
        return 2

    def error_order(self, terms: Any) -> int:
        return 3

    def init(self, terms: Any, t0: Any, t1: Any, y0: State, args: tuple[Model, Bank]) -> Step:
        return Step(self.func(terms, t0, y0, args).v, jnp.zeros((), bool))

    def func(self, terms: Any, t0: Any, y0: State, args: tuple[Model, Bank]) -> State:
        """Rate of position and velocity at a point (the rest of the state has no rate of its own)."""
        model, bank = args
        zero = jnp.zeros(())
        lead = model.lead(t0)
        still = Motion(t0 + zero, zero + 1e-12, y0.x, y0.v, zero, zero, lead)
        _, forces = model.advance(y0, bank, model.contact(y0, bank, t0), still)
        rate = jax.tree.map(jnp.zeros_like, y0)
        return eqx.tree_at(lambda y: (y.x, y.v), rate, (y0.v, forces.net / model.mass()))

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: State, args: tuple[Model, Bank], solver_state: Step, made_jump: Any
    ) -> tuple[State, State, dict, Step, Any]:
        model, bank = args
        h = t1 - t0
        a0, v0 = solver_state.acceleration, y0.v
        contact = model.contact(y0, bank, t0)
        tol = self.tolerance
        dh = D * h
        exact = 1e-3 * tol.velocity + 1e-4 * tol.relative * jnp.abs(v0)
        swing, share = followed(model, bank, y0, contact, a0, t0, h)

        def stage(t: Array, dt: Array, form: Stage, guess: Array) -> tuple:
            """Solve for the velocity at the stage; the path runs from the start of the step."""
            problem = (model, bank, y0, a0, contact, t, dt, form, swing, model.lead(t))
            v, slope, converged, (state, forces, motion) = _root(problem, guess, exact, self.newton_steps)
            beyond = (v - form.v) / form.into_v
            a = a0 - swing.stiffness * motion.dx - swing.damping * (v - v0) + beyond
            return v, a, beyond, state, forces, motion, slope, converged

        first = first_stage(swing, share, v0, a0, h)
        v1, a1, n1, _, f1, m1, _, ok1 = stage(t0 + GAMMA * h, GAMMA * h, first, v0 + share * (first.v - v0))
        second = second_stage(swing, share, (v0, v1), (a0, a1), n1, h)
        guess = second.v + second.into_v * n1 / GAMMA
        v2, a2, n2, y1, f2, m2, slope, ok2 = stage(t1, h, second, v1 + share * (guess - v1))

        v, a = (v0, v1, v2), (a0, a1, a2)
        ex, ev = local_error(v, a, (n1, n2), share, h)
        whole = slope * (1.0 + dh * (swing.damping + dh * swing.stiffness))  # with the tangent of the oscillation
        slope = whole + share * (slope - whole)
        # stiff part of the estimate damped by (1 - D h J)^-1, J the tangent of the second stage
        ex, ev = (ex + dh * ev) / slope, (ev - (slope - 1.0) / dh * ex) / slope
        sx = tol.displacement + tol.relative * m2.path
        sv = tol.velocity + tol.relative * jnp.maximum(abs(v0), abs(v2))
        held, driving = jnp.maximum(whole - 1.0, 0.0) / dh**2, model.block.spring_stiffness / model.mass()
        # what rings errs in turns in displacement and velocity; the steps are not to breathe with it
        ex = jnp.sqrt(ex**2 + ev**2 / (held + driving))
        rx, rv = tol.ring(v2, a0, a2, h, held, driving)
        sx, sv = sx + rx, sv + rv
        # no error would tell of a step so wide that it does not follow what it should
        rate = jnp.sqrt(swing.stiffness) + TINY
        rings = jnp.maximum(abs(a0), abs(a2)) / rate + abs(a2 - a0) / (h * rate**2)
        missed = UNHEARD * rings * jnp.maximum(1.0 / sv, 1.0 / (rate * sx))
        wide = jnp.where(share > 0.0, jnp.minimum(SHORT * (swing.angle(h) / widest(model)) ** 3, missed), 0.0)
        ok = ok1 & ok2
        error = jax.tree.map(jnp.zeros_like, y0)
        error = eqx.tree_at(
            lambda y: (y.x, y.v),
            error,
            (
                jnp.where(ok, ex / sx, jnp.inf),
                jnp.where(ok, jnp.maximum(abs(ev) / sv, wide), jnp.inf),
            ),
        )
        w, block, way = y0.work, model.block, (m1.dx, m2.dx)
        pull, push = (contact.spring_force, f1.spring, f2.spring), (f1.body, f1.body, f2.body)
        if any(isinstance(e, BodyForce) for e in model.effects):  # by the equation of motion
            pushed = model.mass() * a0 - contact.spring_force + jnp.sum(y0.force) + block.damping * v0
            push = pushed, f1.body, f2.body
        work = Work(
            w.spring + work_of_force(pull, block.spring_stiffness, way, v, a, share, h),
            w.friction + f2.dissipated,
            w.viscous + block.damping * integral_of_square(v, a, share, h),
            w.body + work_of_force(push, jnp.zeros(()), way, v, a, share, h) + f2.given,
        )
        y1 = eqx.tree_at(lambda y: y.work, y1, work)
        return y1, error, {"y0": y0, "y1": y1}, Step(a2, ~ok), diffrax.RESULTS.successful


def _path(t: Array, dt: Array, x0: Array, v0: Array, v: Array, dx: Array, lead: Array) -> Motion:
    """The increment, with a velocity that changes linearly."""
    return Motion(t, dt, x0 + dx, v, 0.5 * dt * (v0 - v), dx, lead)


@jax.jit  # traced once, though every step calls it and its derivative twice
def _increment(
    v: Array,
    model: Model,
    bank: Bank,
    y0: State,
    a0: Array,
    contact: Contact,
    t: Array,
    dt: Array,
    form: Stage,
    swing: Oscillation,
    lead: Array,
) -> tuple[Array, tuple[State, Forces, Motion]]:
    """Residual of a stage's equation for the end velocity ``v``, and what the increment then leads to."""
    dx = form.dx + form.into_dx / form.into_v * (v - form.v)
    motion = _path(t, dt, y0.x, y0.v, v, dx, lead)
    state, forces = model.advance(y0, bank, contact, motion)
    beyond = forces.net / model.mass() - a0 + swing.stiffness * dx + swing.damping * (v - y0.v)
    return v - form.v - form.into_v * beyond, (state, forces, motion)


@functools.partial(jax.custom_jvp, nondiff_argnums=(3,))
def _root(problem: tuple, guess: Array, exact: Array, most: int) -> tuple[Array, Array, Array, Any]:
    """Root of the scalar, monotone, piecewise smooth residual; slope near it; whether it was reached; what follows.

    Most residuals are all but straight, and one step is enough: what follows from its end tells.
    """

    def cond(carry: tuple) -> Array:
        _, _, step, n, _ = carry
        return (n == 0) | (abs(step) > exact) & (n < most)

    def body(carry: tuple) -> tuple:
        v, _, _, n, _ = carry
        value, slope = jax.jvp(lambda v: _increment(v, *problem)[0], (v,), (jnp.ones(()),))
        v = v - value / slope
        value, end = _increment(v, *problem)
        return v, slope, value / slope, n + 1, end

    blank = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), jax.eval_shape(_increment, guess, *problem)[1])
    v, slope, step, _, end = jax.lax.while_loop(cond, body, (guess, jnp.ones(()), jnp.full((), jnp.inf), 0, blank))
    return v, slope, abs(step) <= exact, end


@_root.defjvp
def _root_jvp(most: int, primals: tuple, tangents: tuple) -> tuple:
    """Implicit function theorem; the slope only serves the error estimate and carries no derivative."""
    problem, guess, exact = primals
    found = v, slope, _, _ = _root(problem, guess, exact, most)
    # Newton's own slope belongs to the point before its last step
    _, tangent = jax.jvp(lambda v: _increment(v, *problem)[0], (v,), (jnp.ones(()),))
    _, change = jax.jvp(lambda *p: _increment(v, *p)[0], problem, tangents[0])
    moved = -change / tangent
    _, (_, end) = jax.jvp(_increment, (v, *problem), (moved, *tangents[0]))
    return found, (moved, jnp.zeros_like(slope), np.zeros((), jax.dtypes.float0), end)
