"""The scalar laws of the kernel: slow states, cap factors, drive and body forces (compiled)."""

from __future__ import annotations

import math

from . import array_layout as S
from .compiled import jit


@jit
def decay(theta: float, speed: float, length: float, h: float) -> float:
    """Age after ``h`` seconds of theta' = 1 - speed theta / length, exact for constant speed."""
    a = speed * h / length
    e = math.exp(-a)
    grown = h * ((1.0 - e) / a if a > 1e-6 else 1.0 - 0.5 * a)
    return theta * e + grown


@jit
def advance(old, new, v, h, rig, eff, power):
    """Slow states after a step of ``h`` at velocity ``v``; ``power`` is the frictional heating, W."""
    speed = abs(v)
    r = 1.0 / rig[S.HEAL_TIME] + speed / rig[S.SLIP_LENGTH]
    level = 1.0 / (rig[S.HEAL_TIME] * r)
    new[S.PSI] = level + (old[S.PSI] - level) * math.exp(-r * h)
    new[S.PATH] = old[S.PATH] + speed * h
    if eff[S.AGE_B] != 0.0:
        new[S.AGE] = decay(old[S.AGE], speed, eff[S.AGE_D], h)
    if eff[S.RS_B] != 0.0:
        full = speed + eff[S.RS_V]
        if eff[S.RS_FORM] == 0.0:
            theta = math.exp(old[S.LOG_STATE]) * eff[S.RS_D] / eff[S.RS_V]
            theta = decay(theta, full, eff[S.RS_D], h)
            new[S.LOG_STATE] = math.log(theta * eff[S.RS_V] / eff[S.RS_D])
        else:
            target = -math.log(full / eff[S.RS_V])
            new[S.LOG_STATE] = target + (old[S.LOG_STATE] - target) * math.exp(-full * h / eff[S.RS_D])
    if eff[S.HEAT_CHI] != 0.0:
        rate = eff[S.HEAT_LOSS] / eff[S.HEAT_CAPACITY]
        level = power / eff[S.HEAT_LOSS]
        new[S.TEMPERATURE] = level + (old[S.TEMPERATURE] - level) * math.exp(-rate * h)
    if eff[S.RAMP_EPS] != 0.0:
        new[S.REST] = decay(old[S.REST], speed, eff[S.RAMP_LENGTH], h)


@jit
def friction(new, t, x, rig, eff):
    """Friction coefficient common to all contacts, without its dependence on the momentary velocity."""
    mu = rig[S.MU_K] + (rig[S.MU_S] - rig[S.MU_K]) * new[S.PSI]
    if eff[S.AGE_B] != 0.0:
        grown = math.log(1.0 + new[S.AGE] / eff[S.AGE_T0])
        p = eff[S.AGE_POWER]
        mu *= 1.0 + eff[S.AGE_B] * (grown if p == 0.0 else math.expm1(p * grown) / p)
    if eff[S.MOD_EPS] != 0.0:
        mu *= 1.0 + eff[S.MOD_EPS] * wave(eff[S.MOD_F] * t + eff[S.MOD_PHASE], eff[S.MOD_FORM])
    if eff[S.POS_EPS] != 0.0:
        mu *= 1.0 + eff[S.POS_EPS] * wave(x / eff[S.POS_LENGTH] + eff[S.POS_PHASE], eff[S.POS_FORM])
    if eff[S.WEAR_EPS] != 0.0:
        s = new[S.PATH] / eff[S.WEAR_LENGTH]
        if eff[S.WEAR_FORM] == 0.0:
            mu *= 1.0 + eff[S.WEAR_EPS] * s
        elif eff[S.WEAR_FORM] == 1.0:
            mu *= 1.0 + eff[S.WEAR_EPS] * math.log(1.0 + s)
        elif eff[S.WEAR_FORM] == 2.0:
            mu *= 1.0 + eff[S.WEAR_EPS] * 8.0 * (1.0 - math.exp(-s / 8.0))
    if eff[S.HEAT_CHI] != 0.0:
        mu /= 1.0 + eff[S.HEAT_CHI] * new[S.TEMPERATURE]
    if eff[S.RAMP_EPS] != 0.0:
        mu *= 1.0 + eff[S.RAMP_EPS] * math.tanh(new[S.REST] / eff[S.RAMP_TAU])
    return mu


@jit
def wave(cycles, form):
    """A periodic signal of unit size: 0 sine, 1 triangle, 2 three incommensurate sines, 3 smoothed saw."""
    a = 2.0 * math.pi * cycles
    if form == 0.0:
        return math.sin(a)
    if form == 1.0:
        return 2.0 / math.pi * math.asin(math.sin(a))
    if form == 2.0:
        return 0.6 * math.sin(a) + 0.45 * math.sin(1.618 * a + 1.0) + 0.35 * math.sin(2.41 * a + 2.3)
    return math.atan2(0.8 * math.sin(a), 1.0 + 0.8 * math.cos(a)) / 0.927


@jit
def rated(eff):
    """Whether the caps depend on the momentary velocity (then the kick is solved implicitly)."""
    return eff[S.STRIBECK_EPS] != 0.0 or eff[S.DIRECT_A] != 0.0 or eff[S.RS_B] != 0.0


@jit
def rate_factor(v, new, eff):
    """Factor on the caps of springs that slide at velocity ``v`` >= 0."""
    g = 1.0
    if eff[S.DIRECT_A] != 0.0:
        r = v / eff[S.DIRECT_V]
        g += eff[S.DIRECT_A] * (math.log(1.0 + r) if eff[S.DIRECT_FORM] == 0.0 else math.asinh(0.5 * r))
    if eff[S.RS_B] != 0.0:
        g += eff[S.RS_B] * (new[S.LOG_STATE] + eff[S.RS_RATIO] * math.log(1.0 + v / eff[S.RS_V]))
    if eff[S.STRIBECK_EPS] != 0.0:
        r = v / eff[S.STRIBECK_V]
        q = eff[S.STRIBECK_Q]
        g -= eff[S.STRIBECK_EPS] * (1.0 - (1.0 / (1.0 + r) if q == 0.0 else math.exp(-(r**q))))
    return g


@jit
def load_point(t, times, positions, eff):
    """Position of the load point at time ``t``: the commanded piecewise line and its ripple, locked to position."""
    n = times.size
    i = 0
    while i < n - 2 and t >= times[i + 1]:
        i += 1
    z = positions[i] + (positions[i + 1] - positions[i]) / (times[i + 1] - times[i]) * (t - times[i])
    if eff[S.RIPPLE_A] != 0.0:
        turns = z / eff[S.RIPPLE_PITCH]
        p = eff[S.RIPPLE_PHASE]
        ripple = wave(turns + p, 0.0) - wave(p, 0.0)
        if eff[S.RIPPLE_FORM] == 1.0:
            ripple += 0.35 * (wave(2.0 * turns + 1.7 * p, 0.0) - wave(1.7 * p, 0.0))
        elif eff[S.RIPPLE_FORM] == 2.0:
            ripple = wave(turns + p, 1.0) - wave(p, 1.0)
        z += eff[S.RIPPLE_A] * ripple
    return z


@jit
def stiffness_now(t, rig, eff):
    """Stiffness of the drive spring at time ``t`` (a clamp that works loose)."""
    c = rig[S.SPRING]
    if eff[S.LOOSE_EPS] != 0.0:
        s = t / eff[S.LOOSE_TIME]
        c *= 1.0 - eff[S.LOOSE_EPS] * (s if eff[S.LOOSE_FORM] == 0.0 else 1.0 - math.exp(-s))
    return c


@jit
def spring_force(y, y_old, branch_old, t, h, rig, eff):
    """Force of the drive spring at extension ``y`` and its relaxing branch (anelastic spring)."""
    c = stiffness_now(t, rig, eff)
    branch = 0.0
    force = c * y
    if eff[S.NLS_EPS] != 0.0:
        r = y / eff[S.NLS_Y0]
        force *= 1.0 + eff[S.NLS_EPS] * (abs(r) if eff[S.NLS_FORM] == 1.0 else r * r)
    if eff[S.ANEL_G] != 0.0:
        a = h / eff[S.ANEL_TAU]
        branch = (branch_old + eff[S.ANEL_G] * c * (y - y_old)) * math.exp(-a)
        force = force * (1.0 - eff[S.ANEL_G]) + branch
    return force, branch


@jit
def body_force(t, x, v, rig, eff):
    """Force on the block that is neither spring nor contact nor damping, N."""
    force = 0.0
    if eff[S.VIB_A] != 0.0:
        f, p = eff[S.VIB_F], eff[S.VIB_PHASE]
        a = wave(f * t + p, 0.0)
        if eff[S.VIB_FORM] == 1.0:  # a narrow band instead of a line
            a = 0.5 * (a + wave(0.93 * f * t + 2.0 * p, 0.0) + wave(1.09 * f * t + 3.0 * p, 0.0))
        elif eff[S.VIB_FORM] == 2.0:  # two table modes
            a = 0.7 * (a + wave(2.37 * f * t + 2.0 * p, 0.0))
        force -= rig[S.MASS] * eff[S.VIB_A] * a
    if eff[S.EDDY_C] != 0.0:
        force -= eff[S.EDDY_C] * (x / eff[S.EDDY_LENGTH]) * v
    if eff[S.DETENT_F] != 0.0:
        force += eff[S.DETENT_F] * wave(x / eff[S.DETENT_LENGTH] + eff[S.DETENT_PHASE], 0.0)
    return force


@jit
def damping(v, stuck, share, rig, eff):
    """Coefficient of the force opposing the velocity, N s/m; ``share`` is contact force over capacity."""
    c = rig[S.DAMPING]
    if eff[S.DRAG_C] != 0.0:  # DRAG_C is the force coefficient scaled so that forms meet at 1 mm/s
        c += eff[S.DRAG_C] * ((abs(v) + 1e-9) / 1e-3) ** (eff[S.DRAG_N] - 1.0)
    if eff[S.KELVIN_ETA] != 0.0:
        if eff[S.KELVIN_FORM] == 0.0:
            c += eff[S.KELVIN_ETA] * stuck
        else:
            c += eff[S.KELVIN_ETA] * stuck * (1.0 - min(1.0, share * share))
    return c
