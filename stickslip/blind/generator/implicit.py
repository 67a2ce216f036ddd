"""The implicit solves: a step of creep, and the kick where caps depend on the momentary velocity (compiled)."""

from __future__ import annotations

from . import array_layout as S
from .compiled import jit
from .contacts import contacts
from .laws import advance, body_force, damping, friction, rate_factor, rated, spring_force

FORCE_MISS = 1e-12  # N: the balance of forces of an implicit step
KICK_MISS = 1e-10  # N


@jit
def narrow(lo, r_lo, hi, r_hi, side, at, miss):
    """Put a new point into a bracket; false position after Illinois halves the value of an end kept twice."""
    if miss * r_lo > 0.0:
        return at, miss, hi, r_hi * (0.5 if side == 2 else 1.0), 2
    return lo, r_lo * (0.5 if side == 3 else 1.0), at, miss, 3


@jit
def creep_step(
    f, g, springs, soft, state, trial, rig,
    t1, h, z1, x0, u0, v0, y0, fs0, branch, power, capacity, k_m, fastest,
):  # fmt: skip
    """Backward Euler over ``h``: find the contact's motion ``du`` at which the forces balance.

    Returns whether it was found slower than ``fastest``, and du, x, v, extension, spring force, its branch, contact
    force, moment, sticking stiffness, damping, body force.
    """
    mass, eff = rig[S.MASS], springs.eff
    is_rated = rated(eff)
    tilt = eff[S.TILT_K] * fs0 / capacity if eff[S.TILT_K] != 0.0 else 0.0
    du = lo = hi = r_lo = r_hi = 0.0
    x = v = y = fs = br = fc = moment = stiff = c_now = fb = 0.0
    side = 0
    done = False
    for it in range(200):
        advance(state, trial, du / h, h, rig, eff, power)
        mu = friction(trial, t1, x0 + du, rig, eff)
        plus = mu
        minus = mu
        if is_rated:
            plus = mu * rate_factor(max(du / h, 0.0), trial, eff)
            minus = mu * rate_factor(max(-du / h, 0.0), trial, eff)
        fc, moment, stiff = contacts(f, g, springs, du, 0.0, h, plus, minus, soft, tilt)
        x = u0 + du + (fc / k_m if k_m != 0.0 else 0.0)
        v = (x - x0) / h
        y = z1 - x
        fs, br = spring_force(y, y0, branch, t1, h, rig, eff)
        c_now = damping(v, stiff, fc / capacity, rig, eff)
        fb = body_force(t1, x, v, rig, eff)
        miss = fs - fc - c_now * v + fb - mass * (v - v0) / h
        if abs(miss) < FORCE_MISS:
            done = True
            break
        if it == 0:
            r_lo = miss
            du = v0 * h if v0 * h * miss > 0.0 else (1e-12 if miss > 0.0 else -1e-12)
            continue
        if side == 0:
            if miss * r_lo > 0.0:  # same side as the start: go on
                lo = du
                r_lo = miss
                du *= 3.0
                if abs(du) > 2.0 * fastest * h:
                    break
                continue
            hi = du
            r_hi = miss
            side = 1
        else:
            lo, r_lo, hi, r_hi, side = narrow(lo, r_lo, hi, r_hi, side, du, miss)
        if abs(hi - lo) < 1e-14 * abs(hi) + 1e-21:
            done = True
            break
        du = lo + (hi - lo) * r_lo / (r_lo - r_hi)
    return done and abs(v) <= fastest, du, x, v, y, fs, br, fc, moment, stiff, c_now, fb


@jit
def kick(
    f, g, springs, soft, trial, rig,
    du, dq, h, mu, tilt, fs, fb, c_now, v0, vh,
):  # fmt: skip
    """Velocity of this node where the caps depend on it, given the motion ``du`` up to it.

    Returns the velocity, the contact force, its moment and the sticking stiffness.
    """
    inertia, eff = 2.0 * rig[S.MASS] / h, springs.eff
    lo = hi = r_lo = r_hi = 0.0
    fc = moment = stiff = 0.0
    side = 0
    v = v0
    stretch = 1.0
    for it in range(200):
        plus = mu * rate_factor(max(v, 0.0), trial, eff)
        minus = mu * rate_factor(max(-v, 0.0), trial, eff)
        fc, moment, stiff = contacts(f, g, springs, du, dq, h, plus, minus, soft, tilt)
        miss = fs - fc + fb - c_now * v - inertia * (v - vh)
        if abs(miss) < KICK_MISS:
            break
        if it == 0:
            lo = v
            r_lo = miss
            v += miss / (inertia + c_now)
            continue
        if side == 0:
            if miss * r_lo > 0.0:
                if abs(miss) > 0.5 * abs(r_lo):
                    stretch *= 2.0
                lo = v
                r_lo = miss
                v += stretch * miss / (inertia + c_now)
                continue
            hi = v
            r_hi = miss
            side = 1
        else:
            lo, r_lo, hi, r_hi, side = narrow(lo, r_lo, hi, r_hi, side, v, miss)
        if abs(hi - lo) < 1e-13 * abs(hi) + 1e-17:
            break
        v = lo + (hi - lo) * r_lo / (r_lo - r_hi)
    return v, fc, moment, stiff
