"""All contacts together, and what happens to their springs between slips (compiled)."""

from __future__ import annotations

import math

import numpy as np

from . import array_layout as S
from .compiled import jit
from .springs import plain, rich


@jit
def contacts(old, new, springs, du, dq, h, plus, minus, soft, tilt):
    """All contacts moved by ``du`` (and the yaw ``dq``): (force, force of the yaw moment, sticking stiffness)."""
    total = 0.0
    moment = 0.0
    stiff = 0.0
    start = springs.start
    n = start.size - 1
    for j in range(n):
        side = 1.0 if 2 * j < n else -1.0
        step = (du + side * dq) * soft
        a = tilt
        if springs.eff[S.TILT_FORM] == 1.0:  # the front contacts lose three times what the rear ones gain
            a = 3.0 * tilt if side > 0.0 else -tilt
        p = plus * (1.0 - a)
        m = minus * (1.0 - a)
        if springs.is_rich:
            f, s = rich(old, new, springs, start[j], start[j + 1], step, h, p, m)
        else:
            f, s = plain(old[0], new[0], springs, start[j], start[j + 1], step, p, m)
        total += f
        moment += side * f
        stiff += s * soft
    return total, moment, stiff


@jit
def needs_rich(eff):
    return eff[S.SLIPW_EPS] != 0.0 or eff[S.CREEP_V] != 0.0 or eff[S.VISCO_G] != 0.0 or eff[S.RENEW_RATE] != 0.0


@jit
def fresh_lines(f, normal_old, normal, count_old, count, start):
    """Move the forces to new lines by rank: every spring keeps its share of the cap, every contact its force."""
    out = np.zeros_like(f)
    for j in range(start.size - 1):
        lo = start[j]
        was = 0.0
        now = 0.0
        for i in range(count_old[j]):
            was += f[0, lo + i] + f[1, lo + i]
        for i in range(count[j]):
            src = min(int((i + 0.5) / count[j] * count_old[j]), count_old[j] - 1)
            share = normal[lo + i] / normal_old[lo + src]
            out[0, lo + i] = f[0, lo + src] * share
            out[1, lo + i] = f[1, lo + src] * share
            out[2, lo + i] = f[2, lo + src]
            out[3, lo + i] = f[3, lo + src]
            now += out[0, lo + i] + out[1, lo + i]
        if now != 0.0:
            for i in range(count[j]):
                out[0, lo + i] *= was / now
                out[1, lo + i] *= was / now
    return out


@jit
def new_life(eff, rng):
    """Distance a junction lasts: exponentially distributed, or the same for all."""
    if eff[S.RENEW_FORM] == 0.0:
        return -math.log(1.0 - rng.random()) / eff[S.RENEW_RATE]
    return 1.0 / eff[S.RENEW_RATE]


@jit
def relax(fade, tau, h, eff):
    """Fill ``fade`` with the relaxation of each branch in ``h``; returns ``h``."""
    if eff[S.VISCO_G] != 0.0:
        for i in range(tau.size):
            fade[i] = math.exp(-h / tau[i])
    return h


@jit
def forget(f, eff, rng):
    """Take residual load off the springs at an arrest, all by a share or a share of them wholly; the force left."""
    force = 0.0
    for i in range(f.shape[1]):
        keep = 1.0 - eff[S.RESIDUAL_EPS]
        if eff[S.RESIDUAL_FORM] == 1.0:
            keep = 0.0 if rng.random() < eff[S.RESIDUAL_EPS] else 1.0
        f[0, i] *= keep
        f[1, i] *= keep
        force += f[0, i] + f[1, i]
    return force
