"""The model that a diagnosis ends with as a record to be simulated: the contact by the law fitted to its backbone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...data.trace import Trace
from ..fit.composition import Composition
from ..fit.parameters import Free
from ..fit.serialised import MOST_PIECES, Driven, Fitted
from ..force.backbone import BINS, PowerLaw
from ..force.composition import PHASE, PULL
from ..force.fit import Fit


def fitted_model(found: Fit, law: PowerLaw, traces: Sequence[Trace], contacts: int, rig: Any = None) -> Fitted:
    """The fitted model with the power law in place of the free bank.

    Args:
        found: along the measured motion.
        law: of its backbone.
        traces: the runs, in the order of the problem.
        contacts: number of them.
        rig: ``[rig]`` of the campaign, for the load on a contact.
    """
    composition = found.problem.composition
    free: list[Free] = []
    z: list[float] = []
    weights = slice(len(composition.shared) + found.point.phases.size, None)
    k = found.point.weights.size
    part = found.covariance[weights, weights][:k, :k]
    relative = float(np.sqrt(max(part.sum(), 0.0))) / found.strength
    contact = (
        ("contact.strength", "N", found.strength, "friction force of all contacts at full strength"),
        ("contact.u_max", "m", law.u_max, "displacement at which the last element slides"),
        ("contact.p", "1", law.p, "exponent of the backbone"),
        ("contact.spread", "1", law.spread, "rms of ln(u_max) over the contacts"),
    )
    for name, unit, value, doc in contact:
        free.append(Free(name, unit, "log", value, value, math.inf, value / 1e3, value * 1e3, doc))
        z.append(math.log(value))
    first = len(free)
    for f, value in zip(composition.shared, found.point.z, strict=True):
        free.append(f)
        z.append(float(value))
    shared = len(composition.shared)
    for j, f in enumerate(composition.phases):
        if f.name == PULL:
            continue
        turn = 2.0 * math.pi / float(f.scale)
        for r in range(len(found.problem.runs)):
            angle = math.remainder(float(found.point.phases[j, r]), turn)
            free.append(_renamed(f, f"{f.name}.{r}"))
            z.append(angle)
    covariance = np.zeros((len(free), len(free)))
    covariance[0, 0] = relative**2
    exponent = np.array([1.0, (law.p - 1.0) / law.p, 1.0])  # d ln(p) by d ln(p - 1)
    covariance[1:first, 1:first] = law.covariance * np.outer(exponent, exponent)
    covariance[first : first + shared, first : first + shared] = found.covariance[:shared, :shared]
    made = Composition(composition.mass, contacts, BINS, tuple(free), dict(composition.fixed), composition.effects)
    force, friction = (_guess(getattr(rig, key, None)) for key in ("normal_force", "friction_coefficient"))
    return Fitted(made, np.array(z), covariance, tuple(_driven(t) for t in traces), force, friction)


def _renamed(f: Free, name: str) -> Free:
    assert f.name.endswith(PHASE)
    return Free(name, f.unit, f.scale, f.start, f.prior, f.width, f.lower, f.upper, f.doc, f.amplitude, f.usual)


def _guess(value: Any) -> float | None:
    found = getattr(value, "guess", value)
    return None if found is None else float(found)


def _driven(trace: Trace) -> Driven:
    drive = trace.drive
    assert drive is not None
    begin, end = float(trace.time[0]), float(trace.time[-1])
    slopes = np.diff(drive.positions) / np.diff(drive.times)
    edges = np.concatenate([[-np.inf], drive.times[1:-1], [np.inf]])
    pieces: list[tuple[float, float]] = []
    for slope, a, b in zip(slopes, edges[:-1], edges[1:], strict=True):
        length = float(min(b, end) - max(a, begin))
        if length <= 0.0:
            continue
        if pieces and math.isclose(slope, pieces[-1][0], rel_tol=1e-6, abs_tol=1e-15):
            pieces[-1] = (pieces[-1][0], pieces[-1][1] + length)
        else:
            pieces.append((float(f"{slope:.12g}"), length))
    return Driven(
        trace.name, float(f"{drive.speed:.12g}"), tuple(pieces) if len(pieces) <= MOST_PIECES else (),
        trace.spring_stiffness, trace.virgin,
    )  # fmt: skip
