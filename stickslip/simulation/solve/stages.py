"""The two stages of a step, for a part of the motion that is known in closed form and what acts beyond it.

Beyond the oscillation acts ``n = a - (a0 - k dx - c (v - v0))`` (m/s^2). TR-BDF2 (Bank et al. 1985) knows nothing of
the oscillation; it is L-stable and second order. A step that follows the oscillation takes n for a straight line up to
the first stage and for the parabola through start and both stages after that, and has its exact response: third order,
and exact where n is a straight line. Both give displacement and velocity at a stage as linear functions of n there; a
step that follows a share of the oscillation lies between the two by that share.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from .oscillation import Oscillation, Responses

GAMMA = 2.0 - math.sqrt(2.0)
D = GAMMA / 2.0  # weight of the implicit end point in both stages
W = math.sqrt(2.0) / 4.0  # weight of the start and of the first stage in the second
# weights of third order minus those of the method
E0, E1, E2 = (1.0 - W) / 3.0 - W, (3.0 * W + 1.0) / 3.0 - W, D / 3.0 - D
# of values and rates at the start and both stages, exact up to the fifth power of time
VALUES = (0.24393398282201833, 0.4974873734152912, 0.2585786437626905)
RATES = (0.018096437050320306, -0.04857022603955168, -0.019526214587563645)


class Stage(NamedTuple):
    """Displacement since the start of the step, ``dx + into_dx n`` (m), and velocity, ``v + into_v n`` (m/s)."""

    dx: Array
    v: Array
    into_dx: Array
    into_v: Array


def first_stage(swing: Oscillation, share: Array, v0: Array, a0: Array, h: Array) -> Stage:
    """That at ``GAMMA h``, of a step of ``h`` (s) from velocity ``v0`` (m/s) and acceleration ``a0`` (m/s^2)."""
    d, t = D * h, GAMMA * h
    into = d / (1.0 + d * (swing.damping + d * swing.stiffness))
    gain = 2.0 * into * (a0 - d * swing.stiffness * v0)
    plain = Stage(d * (2.0 * v0 + gain), v0 + gain, d * into, into)
    r = swing.responses(t)
    return _between(plain, Stage(*_free(swing, r, v0, a0, t), r.linear / t, r.constant / t), share)


def second_stage(
    swing: Oscillation, share: Array, v: tuple[Array, Array], a: tuple[Array, Array], n: Array, h: Array
) -> Stage:
    """That at the end of the step, from start and first stage, where ``n`` acts beyond the oscillation."""
    d, t, k = D * h, GAMMA * h, swing.stiffness
    into = d / (1.0 + d * (swing.damping + d * k))
    dx, dv = W * h * (v[0] + v[1]), W * h * (a[0] + a[1])
    gain = (dv + d * (a[0] - k * (dx + d * v[0]))) / (1.0 + d * (swing.damping + d * k))
    plain = Stage(dx + d * (v[0] + gain), v[0] + gain, d * into, into)
    r = swing.responses(h)
    free = _free(swing, r, v[0], a[0], h)
    # curvature and initial slope of parabolas that are one at one of the stages and zero at the other
    curve1, curve2 = -2.0 / (t * (h - t)), 2.0 / (h * (h - t))
    slope1, slope2 = -0.5 * curve1 * h, -0.5 * curve2 * t
    exact = Stage(
        free[0] + n * (slope1 * r.linear + curve1 * r.quadratic),
        free[1] + n * (slope1 * r.constant + curve1 * r.linear),
        slope2 * r.linear + curve2 * r.quadratic,
        slope2 * r.constant + curve2 * r.linear,
    )
    return _between(plain, exact, share)


def _free(swing: Oscillation, r: Responses, v0: Array, a0: Array, t: Array) -> tuple[Array, Array]:
    """Displacement and velocity where nothing acts beyond the oscillation."""
    k = swing.stiffness
    return v0 * t + a0 * r.constant - k * v0 * r.linear, v0 + a0 * r.push - k * v0 * r.constant


def _between(plain: Stage, exact: Stage, share: Array) -> Stage:
    return Stage(*(a + share * (b - a) for a, b in zip(plain, exact, strict=True)))


def local_error(v: tuple, a: tuple, n: tuple[Array, Array], share: Array, h: Array) -> tuple[Array, Array]:
    """Estimate for displacement and velocity: what weights of third order make of the motion, or of ``n`` alone."""
    beyond = h * (E1 * n[0] + E2 * n[1])
    ex, ev = (h * (E0 * p[0] + E1 * p[1] + E2 * p[2]) for p in (v, a))
    return ex + share * (0.5 * h * beyond - ex), ev + share * (beyond - ev)


def integral(p: tuple, share: Array, h: Array) -> Array:
    """Of what has the values ``p`` at the start and both stages, by weights of second order, or of third."""
    return h * sum((w + share * e) * q for w, e, q in zip((W, W, D), (E0, E1, E2), p, strict=True))


def integral_of_square(v: tuple, a: tuple, share: Array, h: Array) -> Array:
    """Of the squared velocity (m^2/s), with the course of the oscillation between the stages."""
    plain = integral(tuple(u * u for u in v), share, h)
    values = sum(w * u * u for w, u in zip(VALUES, v, strict=True))
    rates = sum(w * u * b for w, u, b in zip(RATES, v, a, strict=True))
    return plain + share * (h * (values + 2.0 * h * rates) - plain)


def work_of_force(
    force: tuple, stiffness: Array, dx: tuple[Array, Array], v: tuple, a: tuple, share: Array, h: Array
) -> Array:
    """Work (J) of a ``force`` (N; at the start and both stages) that falls by ``stiffness`` (N/m) with displacement.

    Where the oscillation is followed the force without the block's displacement is a parabola of time, and the
    displacement that of fifth power through both ends.
    """
    plain = integral(tuple(f * u for f, u in zip(force, v, strict=True)), share, h)
    rise1, rise2 = (f - force[0] + stiffness * way for f, way in zip(force[1:], dx, strict=True))
    curve = (rise1 / GAMMA - rise2) / (GAMMA - 1.0)
    way = dx[1]
    # of the displacement over the share s of the step: its integral and that of s times it
    mean = 0.5 * way + 0.1 * h * (v[0] - v[2]) + h * h * (a[0] + a[2]) / 120.0
    moment = (75.0 * way + 8.0 * h * v[0] - 13.0 * h * v[2]) / 210.0 + h * h * (3.0 * a[0] + 4.0 * a[2]) / 840.0
    along = force[0] * way - 0.5 * stiffness * way**2 + (rise2 - curve) * (way - mean) + curve * (way - 2.0 * moment)
    return jnp.asarray(plain + share * (along - plain))
