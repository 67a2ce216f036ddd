"""Runs whose motion is prescribed and whose force is measured, with no driving spring between.

The force on the contact is a channel of the record, so nothing is slow or fast and every point is a window. Elasticity
between where the motion is read and the contact is in series with it, and part of the backbone. The driving spring of
the model has no elongation, so that no law of the spring's force can take the measured force for its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, eye_array

from ...data.campaign import Rig
from ...data.drive import Drive
from ...data.resolution import estimate_resolution, noise_level
from ...data.trace import Trace
from ...physics.effects import catalogue
from ..fit.parameters import Free, vector
from .composition import BESIDE, PULL, Composition
from .knots import CREEP, Knots, bow, load_at
from .point import OWN, Point
from .problem import Problem
from .reading import Reading
from .smoothing import onward
from .starting_values import ELEMENTS, REACH, known, log, with_weights

Array = NDArray[np.float64]
Index = NDArray[np.intp]
AFTER, EVEN = 24, 24  # windows of a stretch: spaced as the logarithm of the time from its start, and evenly
FASTER = 1.5  # times the speed: another stretch, where the motion has few speeds
KNOWN = 10.0  # times the error of a position, over which the velocity is taken
STILL = 0.05  # of the usual speed: the motion rests
SETTLED = 0.75  # of a stretch's way, after which all elements are taken to slide and the next event begins
BOTH = 0.1  # of the force one way, which it takes the other way at least
SOFT = 1e-6  # stiffness of a spring that does nothing, over that of the contact
PLACED_APART = 3.0  # of two stretches of an event in the coordinate along which misfits are correlated
ROLES = {"Drive", "Spring", "Inertia"}  # of effects that need a driving spring
GAIN = "sensor-gain"  # a motion that is longer than it seems is a contact that yields later
SAID = (
    "the motion is prescribed and the force measured, with no driving spring between: effects on spring, drive or "
    "mass are not tried, and there is no free simulation"
)


def applies(tag: str) -> bool:
    """Whether an effect means something where no spring drives the block."""
    effect = catalogue.get(tag)
    return not ROLES & set(catalogue.roles(effect)) and effect.family != "drive" and tag != GAIN


@dataclass(frozen=True)
class Stretch:
    """Samples between two changes of the motion: ``first`` to before ``last``; ``way`` is its displacement (m)."""

    first: int
    last: int
    way: float
    moving: bool


def stretches(t: Array, x: Array, noise: float, count: float | None) -> list[Stretch]:
    """Where a motion goes one way, rests, or goes on at another speed."""
    pieces = Drive.sampled(t, x, count or 0.0, noise)
    speeds = np.diff(pieces.positions) / np.diff(pieces.times)
    usual = pieces.speed
    few = pieces.speeds(FASTER)
    kinds = np.sign(speeds) * (np.abs(speeds) > STILL * usual)
    if len(few) > 1:
        kinds = kinds * (1 + np.argmin(np.abs(np.log(np.maximum(np.abs(speeds), 1e-300)[:, None] / few)), axis=1))
    changes = np.flatnonzero(np.diff(kinds)) + 1
    edges = np.concatenate([[0], np.searchsorted(t, pieces.times[changes]), [t.size]])
    own = kinds[np.concatenate([[0], changes])]
    return [
        Stretch(int(a), int(b), float(x[b - 1] - x[a]), bool(k))
        for a, b, k in zip(edges[:-1], edges[1:], own, strict=True)
        if b > a
    ]


def edges_within(stretch: Stretch) -> Index:
    """Edges of the windows of a stretch, some as the logarithm of the time from its start and some evenly."""
    a, b = stretch.first, stretch.last
    size = b - a
    if size < 4:
        return np.array([a, b])
    after = np.geomspace(1, size, AFTER)
    return a + np.unique(np.round(np.concatenate([[0.0], after, np.linspace(0, size, EVEN)])).astype(int))


def thinned(trace: Trace) -> Knots:
    """Thin a run of prescribed motion (its displacement) and measured force."""
    assert trace.spring_force is not None and trace.displacement is not None
    t, x, force = trace.time, trace.displacement, trace.spring_force
    count = estimate_resolution(x)
    noise, forced = noise_level(x, count), noise_level(force, estimate_resolution(force))
    parts = stretches(t, x, noise, count)
    edges = [edges_within(s) for s in parts]
    edges[0] = np.unique(np.maximum(edges[0], 1))  # the first sample is a knot by itself
    starts = np.concatenate([[0], *(e[:-1] for e in edges)])
    sizes = np.concatenate([[1], *(np.diff(e) for e in edges)])
    piece = np.concatenate([[0], *(np.full(e.size - 1, i) for i, e in enumerate(edges))])
    means = _means(starts, sizes, t.size)
    at = means @ t
    width = np.where(np.arange(at.size) == 0, 0.0, sizes / sizes.sum() * (t[-1] - t[0]))
    breaks = t[[s.first for s in parts[1:]]]
    back = onward(means @ x, sizes.astype(float), np.ones(at.size, bool), piece, max(noise, count or 0.0))
    bowed = bow(at, width, breaks)
    eye = eye_array(at.size, format="csr")
    made_of = csr_array(back - back @ bowed)
    knots_x = made_of @ (means @ x)
    knots_force = (eye - bowed) @ (means @ force)
    begins = _begins(parts, t, x, trace.virgin)
    event = np.searchsorted(begins[1:], at, side="right")
    unread = max(noise, count or 0.0)
    moving = np.array([s.moving for s in parts])[piece]
    rate, bend = _rates(at, knots_x, piece, moving, noise / np.sqrt(sizes))
    stiffest = steepest(knots_x, knots_force, piece, unread)
    compared = np.arange(1, at.size)
    compared = compared[(event[compared] > 0) | trace.virgin]
    if not trace.virgin:
        event = event - 1  # of a contact that was loaded before the record begins nothing is known until it slides
        begins = begins[1:]
    of = event[compared]
    empty = csr_array((compared.size, at.size))
    unmoved = csr_array((compared.size, t.size))
    reading = Reading.of(x, csr_array(made_of @ means), unmoved, unmoved)
    firsts = np.array([s.first for s in parts])[piece[compared]]
    since = at[compared] - t[firsts]
    # a reading that stands still after a turn does not say how far the stiffest of the contact has been unloaded
    turned = np.abs(knots_x[compared] - x[firsts]) < unread
    force_noise = forced**2 / sizes[compared] + turned * (unread * stiffest) ** 2 / 12.0
    least = np.median(np.diff(t))
    return Knots(
        trace.name, at, knots_x, rate, knots_x, event, np.full(at.size, -1),
        csr_array((eye + bowed)[compared]), (empty, empty), at[compared], np.full(compared.size, CREEP), of,
        rate[compared], bend[compared], reading,
        np.log1p(since / least) / np.log(4.0) + PLACED_APART * piece[compared], at[compared] - begins[of],
        np.diff(np.append(begins, t[-1])), noise, SOFT * stiffest, trace.virgin, knots_force,
        load_at(trace, at) if trace.normal_load is None else means @ trace.normal_load, force_noise, 0.0,
        np.zeros((reading.count.size, 2)),
    )  # fmt: skip


def _means(starts: Index, sizes: Index, samples: int) -> csr_array:
    """From samples to means over windows."""
    columns = np.concatenate([np.arange(a, a + n) for a, n in zip(starts, sizes, strict=True)])
    rows = np.repeat(np.arange(sizes.size), sizes)
    return coo_array((np.repeat(1.0 / sizes, sizes), (rows, columns)), shape=(sizes.size, samples)).tocsr()


def _begins(parts: Sequence[Stretch], t: Array, x: Array, virgin: bool) -> Array:
    """Times (s) at which events begin: the start, and wherever most of a stretch lies behind that others follow.

    Where the motion turns back and the contact is not virgin the first of these ends a stretch of the usual length:
    what a part of a stroke has not made slide is still loaded by the motion before the record.
    """
    ways = np.array([s.way for s in parts if s.moving])
    far = 0.1 * np.abs(ways).max(initial=0.0)
    strokes = ways[np.abs(ways) > far]
    back = not virgin and bool((strokes > 0.0).any() and (strokes < 0.0).any())
    whole = SETTLED * float(np.median(np.abs(strokes))) if back else 0.0
    out = [float(t[0])]
    for s in parts[:-1]:
        first = len(out) == 1
        if s.moving and abs(s.way) > far and (abs(s.way) >= whole or not first):
            done = np.abs(x[s.first : s.last] - x[s.first]) >= SETTLED * abs(s.way)
            out.append(float(t[s.last if first and back else s.first + int(np.argmax(done))]))
    return np.array(out)


def _rates(t: Array, x: Array, piece: Index, moving: NDArray[np.bool_], error: Array) -> tuple[Array, Array]:
    """Velocity and acceleration at the knots, of every stretch by itself.

    The velocity is the slope over as many knots on both sides as it takes to know it to a tenth, from positions that
    are known to ``error`` (m). A stretch of one knot rests, or has that between its neighbours.
    """
    rate, bend = np.gradient(x, t) * moving, np.zeros(t.size)
    for own in np.split(np.arange(t.size), np.flatnonzero(np.diff(piece)) + 1):
        if own.size > 2:
            rate[own] = _slopes(t[own], x[own], error[own])
            bend[own] = np.gradient(rate[own], t[own])
        elif own.size == 2:
            rate[own] = np.diff(x[own]) / np.diff(t[own])
    return rate, bend


def _slopes(t: Array, x: Array, error: Array) -> Array:
    slope = np.gradient(x, t)
    for i in range(t.size):
        for k in range(1, t.size):
            a, b = max(i - k, 0), min(i + k + 1, t.size)
            if abs(x[b - 1] - x[a]) >= KNOWN * np.hypot(error[a], error[b - 1]):
                break
        if k > 1:
            weight = error[a:b] ** -2.0
            since = t[a:b] - np.average(t[a:b], weights=weight)
            slope[i] = (weight * since) @ x[a:b] / ((weight * since) @ since)
    return slope


def steepest(x: Array, force: Array, piece: Index, noise: float) -> float:
    """Largest slope of force over displacement from the start of a stretch (N/m), beyond what is too near to tell."""
    near = max(1e-3 * float(np.ptp(x)), 2.0 * noise)
    slopes = [0.0]
    for own in np.split(np.arange(x.size), np.flatnonzero(np.diff(piece)) + 1):
        way = np.abs(x[own] - x[own[0]])
        slopes += (np.abs(force[own] - force[own[0]]) / (way + near)).tolist()
    return max(max(slopes), 1e-300)


def both_ways(forces: Array) -> bool:
    """Whether a force takes both signs, each beyond a tenth of the other."""
    low, high = float(forces.min()), float(forces.max())
    return min(high, -low) > BOTH * max(high, -low)


def begin(rig: Rig, runs: Sequence[Knots], elements: int = ELEMENTS) -> tuple[Problem, Point]:
    """The base model of runs of prescribed motion, and where its fit begins.

    Where the force takes both signs a spring stands beside the bank: the part of a contact that never slides (K_inf of
    Iwan's model as Segalman, J. Appl. Mech. 72 (2005) 752, has it), with what it holds where a run begins. The bank
    then ends with what a stroke makes slide: the rest is not told from that spring. One way an element that has not
    slid yet says as much.
    """
    forces = np.concatenate([k.force for k in runs])
    strength = float(np.quantile(np.abs(forces), 0.95))
    softest = min(k.stiffness for k in runs if k.stiffness is not None)
    reach = strength / (softest / SOFT)
    moving = np.concatenate([np.abs(k.v) for k in runs])
    speed = float(np.median(moving[moving > STILL * moving.max()]))
    mass = known(rig.mass, 1e-9 * strength, 0.0)[0]
    critical = strength / speed

    free = [
        log("weakening.drop", "1", 0.03, 1.5, 1e-4, 0.95, "1 - kinetic over static friction"),
        log("weakening.slip_distance", "m", reach, 1.5, 3e-3 * reach, 3e3 * reach,
            "slip over which strength is lost"),
        log("weakening.healing_time", "s", reach / speed, 1.5, 1e-3 * reach / speed, 1e3 * reach / speed,
            "time over which strength returns"),
        log("rig.damping", "N s/m", 1e-3 * critical, 1.5, 1e-7 * critical, 10.0 * critical, "viscous damping"),
    ]  # fmt: skip
    (low, high), expected = REACH, 0.1
    if both_ways(forces):
        way, expected = max(float(np.ptp(k.x)) for k in runs), np.inf  # how much of the force slides is not known
        high = max(min(high, 0.5 * way / reach), 2.0 * low)
        free += [
            Free(BESIDE, "N/m", strength / way, 0.0, 0.0, np.inf, 0.0, 1e3 * strength / way,
                 "stiffness beside the contact, which never slides"),
            Free(PULL, "N", strength, 0.0, 0.0, np.inf, -1e3 * strength, 1e3 * strength,
                 "force at the start of what does not slide"),
        ]  # fmt: skip
    composition = Composition(
        mass, reach * np.geomspace(low, high, elements), tuple(free), {"rig.spring_stiffness": softest}, (),
        (strength, expected),
    )  # fmt: skip
    problem = Problem(composition, runs)
    point = Point(
        vector(composition.shared),
        np.zeros((len(composition.phases), len(runs))),
        np.full(elements, strength / elements),
        np.zeros((problem.events, OWN)),
        np.zeros(problem.usual.size),
    )
    return problem, with_weights(problem, point, strength)


def placeholders(problem: Problem, rig: Rig) -> tuple[str, ...]:
    """Parameters that are numbers only, where the motion is prescribed: the spring's, and a mass that is not stated."""
    if not all(run.prescribed for run in problem.runs):
        return ()
    return ("rig.spring_stiffness", *(("rig.mass",) if rig.mass is None else ()))
