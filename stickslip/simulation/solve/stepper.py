"""TR-BDF2 for a block on a bank of Jenkins elements: a diffrax solver whose step contains the return map.

A vector field with kinks handed to a stock solver is an invalid input: the kinks lie wherever an element starts or
stops to slide. Here a step is an increment, as in finite elements: position and velocity follow TR-BDF2 (Bank et al.
1985; L-stable, second order, third-order error estimate of Hosea & Shampine 1996), while contact and effects are
taken by their own exact or implicit update from the start of the step to each of its two stages. Each stage is a
scalar equation in the velocity, solved by Newton's method. The path of a step is a parabola: where it turns, and
where elements stick as the block slows down, is kept without landing on it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...physics.contact import Bank
from ...physics.effects.base import Contact, Motion
from ...physics.model import Forces, Model, State, Work
from .oscillation import Oscillation
from .tolerance import Tolerance
from .trajectory import hermite

GAMMA = 2.0 - math.sqrt(2.0)
D = GAMMA / 2.0  # weight of the implicit end point in both stages
W = math.sqrt(2.0) / 4.0  # weight of the start and of the first stage in the second
NEAR = 0.01
HELD = 0.25
WIDEST = (1.0, 2.0)
VALUES = (0.2439339828220164, 0.49748737341529026, 0.2585786437626934)
RATES = (0.01809644062711475, -0.048570226039552994, -0.01952621458756389)
STEEP = (1.0, 4.0)
KEPT, OVER = 0.53, 0.3

# embedded third-order weights minus those of the method
E0, E1, E2 = (1.0 - W) / 3.0 - W, (3.0 * W + 1.0) / 3.0 - W, D / 3.0 - D


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
        swing, share = _swing(model, bank, y0, contact, a0, t0, h)

        def stage(t: Array, dt: Array, plan: Stage, guess: Array) -> tuple:
            """Solve for the end velocity; the path runs from the start of the step."""
            problem = (model, bank, y0, a0, contact, t, dt, plan, swing, model.lead(t))
            v, slope, converged, (state, forces, motion) = _root(problem, guess, exact, self.newton_steps)
            beyond = (v - plan.v) / plan.into_v
            a = a0 - swing.stiffness * motion.dx - swing.damping * (v - v0) + beyond
            return v, a, beyond, state, forces, motion, slope, converged

        plan = _first_stage(swing, share, v0, a0, h)
        v1, a1, n1, _, f1, m1, _, ok1 = stage(t0 + GAMMA * h, GAMMA * h, plan, v0)
        plan = _second_stage(swing, share, (v0, v1), (a0, a1), n1, m1.dx, h)
        v2, a2, n2, y1, f2, m2, slope, ok2 = stage(t1, h, plan, v1)

        # of what comes on top of the oscillation, or of all
        beyond = h * (E1 * n1 + E2 * n2)
        ex = share * 0.5 * h * beyond + (1.0 - share) * h * (E0 * v0 + E1 * v1 + E2 * v2)
        ev = share * beyond + (1.0 - share) * h * (E0 * a0 + E1 * a1 + E2 * a2)
        whole = slope * (1.0 + dh * (swing.damping + dh * swing.stiffness))
        slope = slope + (1.0 - share) * (whole - slope)
        # stiff part of the estimate damped by (1 - D h J)^-1, J the tangent of the second stage
        ex, ev = (ex + dh * ev) / slope, (ev - (slope - 1.0) / dh * ex) / slope
        sx = tol.displacement + tol.relative * m2.path
        sv = tol.velocity + tol.relative * jnp.maximum(abs(v0), abs(v2))
        held, driving = jnp.maximum(whole - 1.0, 0.0) / dh**2, model.block.spring_stiffness / model.mass()
        # what rings errs in turns in displacement and velocity; the steps are not to breathe with it
        ex = jnp.sqrt(ex**2 + ev**2 / (held + driving))
        rx, rv = tol.ring(v2, a0, a2, h, held, driving)
        sx, sv = sx + rx, sv + rv
        # beyond the widest angle only what rings no more
        angle, pace = swing.angle(h), jnp.sqrt(swing.stiffness) + 1e-30
        rings = jnp.maximum(jnp.abs(a0), jnp.abs(a2)) / pace + jnp.abs(a2 - a0) / (h * pace**2)
        ahead = jnp.minimum(KEPT * (angle / WIDEST[0]) ** 3, OVER * rings * jnp.maximum(1.0 / sv, 1.0 / (pace * sx)))
        ok = ok1 & ok2
        error = jax.tree.map(jnp.zeros_like, y0)
        error = eqx.tree_at(
            lambda y: (y.x, y.v),
            error,
            (
                jnp.where(ok, ex / sx, jnp.inf),
                jnp.where(ok, jnp.maximum(jnp.abs(ev) / sv, jnp.where(share > 0.0, ahead, 0.0)), jnp.inf),
            ),
        )
        work = _work(y0, contact, (v0, v1, v2), (a0, a1, a2), (m1.dx, m2.dx), (f1, f2), h, share, model)
        y1 = eqx.tree_at(lambda y: y.work, y1, work)
        return y1, error, {"y0": y0, "y1": y1}, Step(a2, ~ok), diffrax.RESULTS.successful


class Stage(NamedTuple):
    """A stage's end as a function of what acts beyond the oscillation there, ``n`` (m/s^2): ``dx + into_x n`` and
    ``v + into_v n``."""

    dx: Array
    v: Array
    into_x: Array
    into_v: Array


def _smooth(s: Array) -> Array:
    """From 0 at 0 to 1 at 1 without an edge."""
    s = jnp.clip(s, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def _swing(model: Model, bank: Bank, y0: State, contact: Contact, a0: Array, t0: Array, h: Array) -> tuple[Oscillation, Array]:
    """The oscillation of the block on all that holds it at the start of a step, and its share in the step, 0 ... 1.

    An element counts as far as it does not slide on the way ahead. Both follow the state without a jump.
    """
    mass = model.mass()
    driving, damping = model.block.spring_stiffness / mass, model.block.damping / mass
    total = jnp.sum(y0.stiffness) / mass + 1e-300
    square = (total + driving) * h * h
    way = h * v_way(y0.v, square, 6.0) + 0.5 * h * h * v_way(a0, square, 12.0)
    blur = NEAR * (jnp.abs(y0.v) * h + 0.5 * jnp.abs(a0) * h * h) + 1e-30
    room = y0.cap - jnp.where(way < 0.0, -1.0, 1.0) * y0.force
    ahead = 1.0 / (jnp.abs(way) + blur)
    held = jnp.sum(jnp.minimum(y0.stiffness, (room + y0.stiffness * blur) * ahead)) / mass
    swing = Oscillation(driving + held, damping)
    zero = jnp.zeros(())
    still = Motion(t0 + zero, zero + 1e-12, y0.x, zero + 1e-12, zero, zero, model.lead(t0))
    steep = h / mass * model.velocity_slope(y0, bank, contact, still)
    share = _smooth((held / total - HELD) / HELD) * _smooth(WIDEST[1] - swing.angle(h))
    share = share * _smooth((STEEP[1] - steep) / (STEEP[1] - STEEP[0]))
    return jax.tree.map(lambda a: jnp.where(share > 0.0, a, 0.0), swing), share


def v_way(v, square, n):
    return v / (1.0 + square / n)


def _first_stage(swing: Oscillation, share: Array, v0: Array, a0: Array, h: Array) -> Stage:
    d, t = D * h, GAMMA * h
    k, c = swing.stiffness, swing.damping
    into = d / (1.0 + d * (c + d * k))
    gain = 2.0 * into * (a0 - d * k * v0)
    plain = Stage(d * (2.0 * v0 + gain), v0 + gain, d * into, into)
    r = swing.responses(t)
    free = v0 * t + a0 * r.constant - k * v0 * r.linear, v0 + a0 * r.push - k * v0 * r.constant
    exact = Stage(*free, r.linear / t, r.constant / t)
    return Stage(*(a + share * (b - a) for a, b in zip(plain, exact, strict=True)))


def _second_stage(swing, share, v, a, n1, dx1, h):
    d, t = D * h, GAMMA * h
    k, c = swing.stiffness, swing.damping
    into = d / (1.0 + d * (c + d * k))
    dx, dv = W * h * (v[0] + v[1]), W * h * (a[0] + a[1])
    gain = (dv + d * (a[0] - k * (dx + d * v[0]))) / (1.0 + d * (c + d * k))
    plain = Stage(dx + d * (v[0] + gain), v[0] + gain, d * into, into)
    r = swing.responses(h)
    free = v[0] * h + a[0] * r.constant - k * v[0] * r.linear, v[0] + a[0] * r.push - k * v[0] * r.constant
    curve = 2.0 / (h * (h - t))  # of the parabola through zero at the start and at the first stage, one at the end
    curve1 = -2.0 / (t * (h - t))
    rise, rise1 = -0.5 * t * curve, 1.0 / t - 0.5 * t * curve1
    exact = Stage(
        free[0] + n1 * (rise1 * r.linear + curve1 * r.quadratic),
        free[1] + n1 * (rise1 * r.constant + curve1 * r.linear),
        rise * r.linear + curve * r.quadratic,
        rise * r.constant + curve * r.linear,
    )
    return Stage(*(a + share * (b - a) for a, b in zip(plain, exact, strict=True)))


def _work(y0: State, contact: Contact, v, a, dx, f: tuple, h: Array, share, model: Model) -> Work:
    """Energies of the step: by the weights of the stages, or with the course of the oscillation between them."""
    v0, v1, v2 = v
    f1, f2 = f
    w, c, pull = y0.work, model.block.damping, contact.spring_force

    def quadrature(p0: Array, p1: Array, p2: Array) -> Array:
        exact = W + share * E0, W + share * E1, D + share * E2
        return h * (exact[0] * p0 + exact[1] * p1 + exact[2] * p2)

    # what the spring's force is without the block's displacement is smooth: a parabola
    c_s, (dx1, dx2) = model.block.spring_stiffness, dx
    rise1, rise2 = f1.spring - pull + c_s * dx1, f2.spring - pull + c_s * dx2
    curve = (rise1 / GAMMA - rise2) / (GAMMA - 1.0)
    dv, da = h * v0, h * h * a[0]
    mean = 0.5 * dx2 + 0.1 * h * (v0 - v2) + h * h * (a[0] + a[2]) / 120.0
    first = (75.0 * dx2 + 8.0 * dv - 13.0 * h * v2) / 210.0 + da / 280.0 + h * h * a[2] / 210.0
    swung = pull * dx2 - 0.5 * c_s * dx2**2 + (rise2 - curve) * (dx2 - mean) + curve * (dx2 - 2.0 * first)
    spring = quadrature(pull * v0, f1.spring * v1, f2.spring * v2)
    plain = quadrature(v0 * v0, v1 * v1, v2 * v2)
    rates = sum(q * p * r for q, p, r in zip(RATES, v, a, strict=True))
    smooth = h * (sum(q * p * p for q, p in zip(VALUES, v, strict=True)) + 2.0 * h * rates)
    body = quadrature(f1.body * v0, f1.body * v1, f2.body * v2)
    spring, square = spring + share * (swung - spring), plain + share * (smooth - plain)
    return Work(w.spring + spring, w.friction + f2.dissipated, w.viscous + c * square, w.body + body + f2.given)


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
    plan: Stage,
    swing: Oscillation,
    lead: Array,
) -> tuple[Array, tuple[State, Forces, Motion]]:
    """Residual of a stage's equation for the end velocity ``v``, and what the increment then leads to."""
    dx = plan.dx + plan.into_x / plan.into_v * (v - plan.v)
    motion = _path(t, dt, y0.x, y0.v, v, dx, lead)
    state, forces = model.advance(y0, bank, contact, motion)
    beyond = forces.net / model.mass() - a0 + swing.stiffness * dx + swing.damping * (v - y0.v)
    return v - plan.v - plan.into_v * beyond, (state, forces, motion)


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
