"""Where a fit begins: what the campaign file says, and what a glance at the motion tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import nnls

from ...data.campaign import Rig, Unmeasured
from ...data.segment import Segmentation
from ...data.trace import Trace
from ...errors import InputError
from ..fit.parameters import Free, vector
from .composition import BESIDE, PULL, SCALE, Composition
from .knots import Knots
from .point import OWN, Point
from .problem import Problem
from .scales import Scales

ELEMENTS = 64
REACH = (1 / 60.0, 30.0)  # yield displacements, over strength/stiffness of the whole contact
FALLBACK_STIFFNESS = 1000.0  # N/m
CALIBRATED = 0.02  # to which the scale of a force is known: as stated, or as the sticks set it right
LESS, MORE = 0.97, 1.1  # of that scale: creep in the sticks hides some of it, and nothing adds to it but noise


def known(value: Any, default: float, width: float) -> tuple[float, float, float | None, float | None, bool]:
    """Guess, width of its logarithm, bounds, and whether it was measured."""
    if isinstance(value, Unmeasured):
        spread = np.log(value.upper / value.lower) / 4.0
        return value.guess, float(max(spread, 0.02)), value.lower, value.upper, False
    if value is None:
        return default, width, None, None, False
    return float(value), 0.0, None, None, True


def log(name: str, unit: str, start: float, width: float, lower: float, upper: float, doc: str) -> Free:
    """A free parameter that is sought on a logarithmic scale, and begins within its bounds."""
    start = float(np.clip(start, lower * 1.001, upper * 0.999))
    return Free(name, unit, "log", start, start, width, lower, upper, doc)


def begin(
    rig: Rig, traces: Sequence[Trace], found: Sequence[Segmentation], runs: Sequence[Knots], times: Scales,
    elements: int = ELEMENTS,
) -> tuple[Problem, Point]:  # fmt: skip
    """The base model and where its fit begins.

    Raises:
        InputError: the mass is not given.
    """
    mass, mass_width, lightest, heaviest, weighed = known(rig.mass, np.nan, 0.0)
    if not np.isfinite(mass):
        raise InputError(
            "the dynamic model needs the mass of the block",
            key="rig.mass",
            hint='write mass = "0.0894 kg", or weigh it',
        )
    own = np.array([np.nan if k.stiffness is None else k.stiffness for k in runs])
    stated = own[np.isfinite(own)]
    usual = float(np.median(stated)) if stated.size else mass * (np.pi / times.slip) ** 2
    stiffness, width, low, high, measured = known(rig.spring_stiffness, usual, 0.8)
    each = np.where(np.isfinite(own), own, stiffness)
    events = [(k, e, c) for k, s, c in zip(runs, found, each, strict=True) for e in s.events]
    at_onset = [c * float(np.interp(e.t_onset, k.t, k.drive - k.x)) for k, e, c in events]
    virgin = np.array([k.virgin for k in runs])
    load, load_width, _, _, _ = known(rig.normal_force, np.nan, 0.0)
    friction, friction_width, _, _, _ = known(rig.friction_coefficient, np.nan, 0.15)
    nominal = load * friction * (rig.contacts or 1)
    width_nominal = max(float(np.hypot(load_width, friction_width)), 0.1)
    first_virgin = [f for f, (k, _, _) in zip(at_onset, events, strict=True) if k.virgin]
    if first_virgin:
        strength = float(np.median(np.abs(first_virgin)))
        nominal, width_nominal = strength, np.inf
    elif np.isfinite(nominal):
        strength = nominal
    else:
        strength = nominal = 3.0 * float(np.median([c * e.slip for _, e, c in events]))
        width_nominal = 1.0
    fall = float(np.median([c * e.slip for _, e, c in events]))
    drop = float(np.clip(0.55 * fall / strength, 0.02, 0.8))
    whole = mass * (2 * np.pi / times.ring) ** 2 if times.ring else 0.0
    reach = strength / max(whole - stiffness, 0.1 * whole) if whole else 0.3 * _creep(runs, found)
    critical = 2.0 * np.sqrt(stiffness * mass)

    free = [
        log("weakening.drop", "1", drop, 1.0, 0.003, 0.95, "1 - kinetic over static friction"),
        log("weakening.slip_distance", "m", 3.0 * reach, 1.5, 3e-3 * reach, 3e3 * reach,
            "slip over which strength is lost"),
        log("weakening.healing_time", "s", 0.5 * times.slip, 1.5, 1e-3 * times.slip, 1e3 * times.slip,
            "time over which strength returns"),
        log("rig.damping", "N s/m", 0.3 * critical, 1.5, 1e-4 * critical, 50.0 * critical, "viscous damping"),
    ]  # fmt: skip
    fixed = {"rig.spring_stiffness": stiffness}
    if not measured and not np.isfinite(own).all():
        fixed = {}
        free.append(
            log("rig.spring_stiffness", "N/m", stiffness, width, low or stiffness / 10, high or stiffness * 10,
                "stiffness of the driving spring")
        )  # fmt: skip
    if not weighed and measured:  # with neither known all forces have one free scale, and the guess of the mass stays
        free.append(
            log("rig.mass", "kg", mass, mass_width, lightest or mass / 10, heaviest or mass * 10, "mass of the block")
        )
    made = np.array([k.force_scale for k in runs if k.force_scale is not None])
    if made.size:
        scale = float(np.exp(np.mean(np.log(made))))
        free.append(
            log(SCALE, "1", scale, CALIBRATED, LESS * scale, MORE * scale, "measured over true force of the spring")
        )
    begun = np.zeros((0, len(runs)))
    if not virgin.all():
        unit = strength
        free.append(
            Free(PULL, "N", unit, 0.0, 0.0, np.inf, -1e3 * unit, 1e3 * unit, "force of the spring at the start")
        )
        onsets = [[f for f, (k, _, _) in zip(at_onset, events, strict=True) if k is run] for run in runs]
        begun = np.array([[0.0 if k.virgin else 1.0 - float(np.median(f)) / strength
                           for k, f in zip(runs, onsets, strict=True)]])  # fmt: skip
    yields = reach * np.geomspace(*REACH, elements)
    runs = [replace(k, stiffness=None) if k.stiffness == stiffness else k for k in runs]  # one spring for all of them
    if made.size:  # what one run was set right by more than another stays
        runs = [k if k.force_scale is None else replace(k, force_scale=scale) for k in runs]
    composition = Composition(mass, yields, tuple(free), fixed, (), (nominal, width_nominal))
    problem = Problem(composition, runs)
    flat = np.full(elements, strength / elements)
    point = Point(
        vector(composition.shared), begun, flat, np.zeros((problem.events, OWN)), np.zeros(problem.usual.size)
    )
    return problem, with_weights(problem, point, strength)


def _creep(runs: Sequence[Knots], found: Sequence[Segmentation]) -> float:
    crept = [e.x_onset - float(np.interp(p.t_arrest, k.t, k.x))
             for k, s in zip(runs, found, strict=True) for p, e in pairwise(s.events)]  # fmt: skip
    return max(float(np.median(np.abs(crept))) if crept else 1e-6, 1e-9)


def with_weights(problem: Problem, point: Point, strength: float) -> Point:
    """The point with weights by non-negative least squares, and a spring beside the contact where there is one."""
    slopes = problem.evaluate(point)
    k = point.weights.size
    c = point.common.size
    share = -slopes.shared[:, -k - c : -c]
    sigma = np.hypot(slopes.tangent * 3e-9, 0.01 * strength)
    measured = slopes.residual + slopes.held
    smooth = np.diff(np.eye(k), 2, axis=0) * 10.0 * k / strength / 3.0
    names = [f.name for f in problem.composition.shared]
    beside = [names.index(BESIDE)] if BESIDE in names else []
    # what a run begins with takes both signs
    pulls = -slopes.shared[:, len(names) : len(names) + point.phases.size * bool(beside)]
    rows = np.hstack([share, -slopes.shared[:, beside], pulls, -pulls]) / sigma[:, None]
    smooth = np.pad(smooth, ((0, 0), (0, rows.shape[1] - k)))
    found, _ = nnls(np.vstack([rows, smooth]), np.concatenate([measured / sigma, np.zeros(k - 2)]), maxiter=50 * k)
    if not beside:
        return replace(point, weights=found)
    z = point.z.copy()
    z[beside] = found[k]
    ahead, behind = np.split(found[k + 1 :], 2)
    return replace(point, z=z, phases=(ahead - behind).reshape(point.phases.shape), weights=found[:k])
