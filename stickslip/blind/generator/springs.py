"""The return map over the springs of one contact (compiled): plain, and with memory of slip, time and life."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from . import array_layout as S
from .compiled import jit


class Springs(NamedTuple):
    """The springs of all contacts on their present lines.

    Attributes:
        k, normal: stiffness and normal force of each, shape (n,).
        fade: factor by which the branch of each relaxes in a step, shape (n,).
        start: first spring of every contact, and the end of the last.
        is_rich: whether they have a memory (:func:`rich`).
        eff: amplitudes and inner parameters of the effects.
    """

    k: np.ndarray
    normal: np.ndarray
    fade: np.ndarray
    start: np.ndarray
    is_rich: bool
    eff: np.ndarray


@jit
def clip(trial, normal, plus, minus):
    """The return map: a trial force brought back between its caps."""
    held = min(trial, plus * normal)
    return max(held, -minus * normal)


@jit
def plain(old, new, springs, lo, hi, du, plus, minus):
    """Springs lo..hi moved by ``du`` between caps +plus f_n and -minus f_n: (force, stiffness still sticking).

    Four sums side by side let the processor overlap them in an order that is always the same; leaving the order to
    the compiler made results depend, in the last digit, on where the arrays lay in memory.
    """
    k, normal = springs.k, springs.normal
    f0 = f1 = f2 = f3 = 0.0
    s0 = s1 = s2 = s3 = 0.0
    whole = lo + (hi - lo) // 4 * 4
    for i in range(lo, whole, 4):
        t0 = old[i] + k[i] * du
        t1 = old[i + 1] + k[i + 1] * du
        t2 = old[i + 2] + k[i + 2] * du
        t3 = old[i + 3] + k[i + 3] * du
        h0 = clip(t0, normal[i], plus, minus)
        h1 = clip(t1, normal[i + 1], plus, minus)
        h2 = clip(t2, normal[i + 2], plus, minus)
        h3 = clip(t3, normal[i + 3], plus, minus)
        new[i] = h0
        new[i + 1] = h1
        new[i + 2] = h2
        new[i + 3] = h3
        f0 += h0
        f1 += h1
        f2 += h2
        f3 += h3
        s0 += k[i] if h0 == t0 else 0.0
        s1 += k[i + 1] if h1 == t1 else 0.0
        s2 += k[i + 2] if h2 == t2 else 0.0
        s3 += k[i + 3] if h3 == t3 else 0.0
    for i in range(whole, hi):
        trial = old[i] + k[i] * du
        held = clip(trial, normal[i], plus, minus)
        new[i] = held
        f0 += held
        s0 += k[i] if held == trial else 0.0
    return (f0 + f1) + (f2 + f3), (s0 + s1) + (s2 + s3)


@jit
def creep_rate(ratio, eff):
    """Slip rate of a stuck spring at force over cap ``ratio``: Eyring's law, or a power law with the same slope."""
    alpha = eff[S.CREEP_ALPHA]
    r = min(1.0, abs(ratio))
    if 1.0 - r > 30.0 * alpha:  # both laws are below 1e-13 there, and most springs are there
        return 0.0
    if eff[S.CREEP_FORM] == 0.0:
        rate = math.exp((r - 1.0) / alpha) - math.exp(-(r + 1.0) / alpha)
    else:
        rate = r ** (1.0 / alpha)
    return eff[S.CREEP_V] * (rate if ratio >= 0.0 else -rate)


@jit
def rich(old, new, springs, lo, hi, du, h, plus, minus):
    """As ``plain`` for springs with a relaxing branch, slip weakening, thermal creep and a finite life.

    Rows of ``old`` and ``new``: elastic force, force of the branch, slip since arrest, life left.
    """
    k, normal, fade, eff = springs.k, springs.normal, springs.fade, springs.eff
    force = 0.0
    stuck = 0.0
    g = eff[S.VISCO_G]
    for i in range(lo, hi):
        if normal[i] == 0.0:
            continue
        up = plus * normal[i]
        down = minus * normal[i]
        slip = old[2, i]
        if eff[S.SLIPW_EPS] != 0.0:
            s = slip / eff[S.SLIPW_D]
            if eff[S.SLIPW_FORM] == 0.0:
                w = 1.0 - math.exp(-s) if s < 40.0 else 1.0
            elif eff[S.SLIPW_FORM] == 1.0:
                w = min(1.0, s)
            else:
                w = s / (1.0 + s)
            up *= 1.0 - eff[S.SLIPW_EPS] * w
            down *= 1.0 - eff[S.SLIPW_EPS] * w
        elastic = old[0, i]
        branch = old[1, i]
        life = old[3, i]
        if eff[S.RENEW_RATE] != 0.0:
            life -= abs(du)
            if life <= 0.0:
                elastic = 0.0
                branch = 0.0
        before = elastic + branch
        if eff[S.CREEP_V] != 0.0:
            cap = up if before >= 0.0 else down
            elastic -= k[i] * h * creep_rate(before / cap, eff)
        elastic += (1.0 - g) * k[i] * du
        if g != 0.0:
            branch = (branch + g * k[i] * du) * fade[i]
        trial = elastic + branch
        held = min(max(trial, -down), up)
        if held != trial:
            # the slider is in series with spring and branch: both lose the same strain
            soft = k[i] * (1.0 - g + g * fade[i])
            ds = (trial - held) / soft
            elastic -= (1.0 - g) * k[i] * ds
            branch -= g * k[i] * fade[i] * ds
            ds = abs(ds)
            slip += ds
            if g != 0.0 and eff[S.VISCO_RENEW] != 0.0:
                # a junction that slides is replaced by a fresh one, whose branch has not relaxed yet
                fresh = 1.0 - math.exp(-ds * k[i] / (eff[S.VISCO_RENEW] * abs(held) + 1e-30))
                shift = (g * held - branch) * fresh
                branch += shift
                elastic -= shift
        else:
            stuck += k[i]
        new[0, i] = elastic
        new[1, i] = branch
        new[2, i] = slip
        new[3, i] = life
        force += held
    return force, stuck


@jit
def stored(f, k, size, soft, eff):
    """Elastic energy in the springs, J."""
    total = 0.0
    g = eff[S.VISCO_G]
    for i in range(size):
        if k[i] > 0.0:
            total += 0.5 * f[0, i] * f[0, i] / (k[i] * soft * (1.0 - g))
            if g != 0.0:
                total += 0.5 * f[1, i] * f[1, i] / (k[i] * soft * g)
    return total
