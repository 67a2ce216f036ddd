"""Real rough lines pressed to a load: one spring per point, nothing averaged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from stickslip.errors import InputError

Array = np.ndarray


@dataclass(frozen=True)
class Surface:
    """The statistics of the rough lines and the elastic constants (SI).

    The fields after ``points`` deform the plain self-affine elastic line; each does nothing at zero.

    Attributes:
        roll_off: number of the roll-off wave, L/lambda_r; 0 or 1 leaves every wave in.
        roll_off_form: ``"flat"`` (amplitudes constant below it) or ``"smooth"`` (a Lorentzian knee).
        curvature: 1/R of the block's macroscopic form, 1/m.
        curvature_form: ``"parabola"`` (gap x^2/R) or ``"quartic"`` (same sag at the line's end, flat in the middle).
        softening: share by which the hardest-pressed spring of the elastic line is held back, 0..1.
        softening_form: ``"cap"`` (a sharp hardness) or ``"soft"`` (a smooth approach to it).
        adhesion: total adhesive load over the normal load.
        adhesion_form: ``"contact"`` (the springs in contact share it) or ``"range"`` (near misses share it too).
    """

    hurst: float = 0.3
    h_rms: float = 2.46e-6
    length: float = 20e-6
    points: int = 4096
    youngs_modulus: float = 210e9
    poisson_ratio: float = 0.3
    roll_off: float = 0.0
    roll_off_form: str = "flat"
    curvature: float = 0.0
    curvature_form: str = "parabola"
    softening: float = 0.0
    softening_form: str = "cap"
    adhesion: float = 0.0
    adhesion_form: str = "contact"

    @property
    def normal_spring(self) -> float:
        """c_n = E* dx of two equal bodies (Grzemba 2014 eq. 1), N/m."""
        return self.youngs_modulus / (2 * (1 - self.poisson_ratio**2)) * self.length / self.points

    @property
    def tangential_spring(self) -> float:
        """c_t = G* dx of two equal bodies (Grzemba 2014 eq. 1), N/m."""
        shear = self.youngs_modulus / (2 * (1 + self.poisson_ratio))
        return 2 * shear / (2 - self.poisson_ratio) * self.length / self.points


def rough_line(surface: Surface, rng: np.random.Generator) -> Array:
    """Heights of one line, shape (points,), m: fixed amplitudes k^-(H+1/2), random phases, exact rms.

    The amplitudes are the rule C1D = pi q C2D of the method of dimensionality reduction (Geike and Popov 2007).
    """
    n = surface.points
    wave = np.arange(n // 2 + 1, dtype=float)
    amplitude = np.zeros_like(wave)
    amplitude[1:] = wave[1:] ** -(surface.hurst + 0.5)
    if surface.roll_off > 1:
        if surface.roll_off_form == "flat":
            amplitude = np.minimum(amplitude, surface.roll_off ** -(surface.hurst + 0.5))
            amplitude[0] = 0.0
        else:
            amplitude[1:] = (wave[1:] ** 2 + surface.roll_off**2) ** (-(surface.hurst + 0.5) / 2)
    phase = rng.uniform(0.0, 2 * np.pi, wave.size)
    z = np.fft.irfft(amplitude * np.exp(1j * phase), n)
    z -= z.mean()
    return z * (surface.h_rms / z.std())


def gaps(surface: Surface, heights: Array) -> Array:
    """Ascending gaps below the highest point, shape (points,), m, with the macroscopic form put in."""
    z = heights
    if surface.curvature != 0.0:
        x = (np.arange(z.size) + 0.5) / z.size * surface.length - surface.length / 2
        sag = x**2 if surface.curvature_form == "parabola" else x**4 / (surface.length / 2) ** 2
        z = z - sag * surface.curvature
    return np.sort(z.max() - z)


def indentation_depth(gap: Array, stiffness: float, load: float) -> float:
    """Depth at which elastic springs under ascending ``gap`` carry ``load``; exact (sorted cumulative sum)."""
    count = np.arange(1, gap.size + 1)
    held = stiffness * (count * gap - np.cumsum(gap))  # load at the moment each spring touches
    touching = int(np.searchsorted(held, load, side="right"))
    return (load / stiffness + gap[:touching].sum()) / touching


def press(surface: Surface, heights: Array, load: float) -> Array:
    """Normal force of every spring in contact under ``load``, ascending, N.

    Raises:
        InputError: more than 90 % of the line would touch (the line saturates and says nothing of roughness).
    """
    gap = gaps(surface, heights)
    c_n = surface.normal_spring
    depth = indentation_depth(gap, c_n, load)
    if surface.softening > 0:
        hardest, kept = c_n * depth, 1 - surface.softening
        limit = kept * hardest if surface.softening_form == "cap" else hardest / np.sqrt(kept**-2 - 1)
        depth = _soft_depth(gap, c_n, load, limit, surface.softening_form)
        force = _soft_force(c_n * np.maximum(depth - gap, 0.0), limit, surface.softening_form)
    else:
        force = c_n * np.maximum(depth - gap, 0.0)
    touching = int(np.searchsorted(gap, depth, side="left"))
    if touching > 0.9 * gap.size:
        hint = "raise h_rms or lower the load"
        raise InputError("the rough line saturates under its load", key="h_rms", value=surface.h_rms, hint=hint)
    if surface.adhesion > 0:
        reach = touching
        if surface.adhesion_form == "range":
            reach = min(gap.size, max(touching, int(np.searchsorted(gap, 1.1 * depth))))
        force = force[:reach] + surface.adhesion * load / reach
    else:
        force = force[:touching]
    return np.sort(force)


def _soft_force(elastic: Array, limit: float, form: str) -> Array:
    if form == "cap":
        return np.minimum(elastic, limit)
    return elastic / np.sqrt(1 + (elastic / limit) ** 2)


def _soft_depth(gap: Array, c_n: float, load: float, limit: float, form: str) -> float:
    def miss(depth: float) -> float:
        return float(_soft_force(c_n * np.maximum(depth - gap, 0.0), limit, form).sum() - load)

    low = indentation_depth(gap, c_n, load)
    high = gap[-1] + low
    if miss(high) < 0:
        raise InputError("the hardness is too low to carry the load", key="softening", allowed="a smaller softening")
    return float(brentq(miss, 0.5 * low, high, xtol=1e-18, rtol=1e-14))


def group(normal: Array, spring: float, groups: int) -> tuple[Array, Array]:
    """Join neighbouring thresholds of equal springs into at most ``groups`` elements.

    Half of the edges hold equal counts, half equal thresholds, so that the last springs to slide stay single. Sum of
    stiffness and sum of caps are kept exactly; the curve is off only between the thresholds of one group.

    Args:
        normal: ascending normal forces of one contact, N.
        spring: tangential stiffness of one spring, N/m.
        groups: elements at most.

    Returns:
        Normal force and stiffness of each element, ascending in threshold.
    """
    n = normal.size
    by_count = np.linspace(0, n, groups // 2 + 1).round().astype(int)
    levels = np.linspace(normal[0], normal[-1], groups - groups // 2 + 1)[1:-1]
    edges = np.unique(np.concatenate([by_count, np.searchsorted(normal, levels)]))
    edges = np.unique(np.clip(edges, 0, n))
    return np.add.reduceat(normal, edges[:-1]), np.diff(edges) * spring
