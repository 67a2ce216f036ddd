"""Force that is measured less force that the model holds, at the points of all runs, and its derivatives.

The free parameters: those of the base, the weights of a free bank of Jenkins elements (which measures the backbone),
those of effects, a phase for each run where an effect has one, and for each event a factor on strength, one on the
yield displacements and the error of the position at the arrest before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

from ...physics.effects.base import Sensor
from ...system.threads import side_by_side
from ..fit.parameters import to_si
from .compiled_force import EMPTY, SHAPE, VALUES, CommonInput, Own, RunInput, compiled
from .composition import BESIDE, DAMPING, Composition
from .force_along_motion import Way
from .knots import PHASES, Knots
from .linked_events import Chain
from .point import OWN, Forces, Point, Slopes
from .scatter import Blocks, Follows, caps

Array = NDArray[np.float64]
CREEPING = PHASES.index("creep")
LEAST_ROOM = 1024  # knots
LEAST_EVENTS = 32
JUMP = 5e-8  # m, usual size of a jump of the reading: some speckle, less than a fringe
LEVEL = 1e-4  # e-folds of strength by which runs may differ whatever the law, and below which nothing is claimed
ALONG = ("time", "slip path", "place")  # what a level may follow
SHORT = 0.5  # of the range of places, above which an event has no place of its own
LOADED = 1e-3  # of the load, which it must vary by to be told of
NODES = (
    -8.0,
    -6.0,
    -4.5,
    -3.0,
    -2.0,
    -1.0,
    0.0,
    1.0,
    2.0,
    3.0,
    4.5,
    6.0,
)  # in units of the place, of what cycles share


class Problem:
    """All runs of a campaign under one composition.

    What is found with the model besides its parameters, each about as large as ``usual``, shape (c,): errors of the
    position that are systematic, the same in all cycles (coefficients of ``systematics`` hats along the cycle), a level
    for each run, by which the logarithm of its strength is another, what is left of the hum, and jumps of the reading
    before some events (:meth:`with_jumps`). Those that were found before and taken off the motion are ``errors`` (m),
    shape (n,) of every run; what they do to the residuals is added again as ``offset`` (N), shape (p,), so that no
    evidence is lost (:meth:`adjusted`). Another spring or mass leaves it as it is: residuals grow as errors of the
    reading do, not as forces. What a level of the caps does within events ``beyond`` first order (N), shape (p,), is
    added as well (:mod:`.level_within_events`).

    ``blocks`` puts what is known at points side by side by event.
    """

    def __init__(self, composition: Composition, runs: Sequence[Knots]) -> None:
        self.composition, self.runs = composition, tuple(runs)
        first = np.cumsum([0, *(k.events for k in runs)])
        self.first, self.events = first[:-1], int(first[-1])
        room = _room(max(k.t.size for k in runs))
        loads = np.concatenate([k.load for k in runs])
        median = float(np.median(loads)) if np.isfinite(loads).all() else None
        self.loaded = median is not None and float(np.std(loads)) > LOADED * abs(median)
        self.ways = tuple(_padded(k, room, median) for k in runs)
        self.of = np.concatenate([k.of + f for k, f in zip(runs, first[:-1], strict=True)])
        self.blocks = Blocks.of(self.of, self.events)
        self.run = np.concatenate([np.full(k.at.size, r) for r, k in enumerate(runs)])
        self.event_run = np.concatenate([np.full(k.events, r) for r, k in enumerate(runs)])
        self.phase, self.place, self.at = (
            np.concatenate([getattr(k, name) for k in runs]) for name in ("phase", "place", "at")
        )
        self.elapsed = np.concatenate([k.elapsed for k in runs])
        self.lasting = np.concatenate([k.lasting[: k.events] for k in runs])
        self.begins = np.isin(np.arange(self.events), self.first)
        most = _room(max(k.events for k in runs) + 1, LEAST_EVENTS)
        self._own = tuple(_own(k, room, most) for k in runs)
        virgin = np.isin(self.of, [f for f, k in zip(first[:-1], runs, strict=True) if k.virgin])
        hats = _hats(self.place)
        # quantisation and filters leave a systematic error about as large as the noise of one sample
        systematic = max(float(np.median([k.noise for k in runs])), 1e-12)
        self._hats = np.hstack([hats * ~virgin[:, None], hats * virgin[:, None]])
        self.runs_with_hum = np.array([r for r, k in enumerate(runs) if k.hum.any()], int)
        at_points = np.concatenate([k.mean @ (k.reading.displacement @ k.hum) for k in runs])
        self.systematics, self._hums = self._hats.shape[1], self._by_run(at_points)
        self.usual = np.concatenate(
            [np.full(self.systematics, systematic), np.full(len(runs), LEVEL), np.ones(2 * self.runs_with_hum.size)]
        )
        walks = np.array([k.walk for k in runs])
        self.walk = float(np.exp(np.log(walks).mean())) if (walks > 0.0).all() else 0.0  # as stated, m/s^0.5
        self.carrier: Array | None = None
        self.jumps: tuple[int, ...] = ()
        self.bands = np.full(len(PHASES), float(np.mean([k.band for k in runs])))
        self.errors = tuple(np.zeros(k.t.size) for k in runs)
        self.offset, self.beyond = np.zeros(self.at.size), np.zeros(self.at.size)
        self.coordinates = _coordinates(runs)

    @property
    def along(self) -> tuple[str, ...]:
        """What the level of the strength may follow: the place only where the block goes back over it.

        An event of a prescribed motion is a whole stroke. Along it friction varies as it does from stroke to stroke,
        and a level that goes on from event to event says nothing.
        """
        if any(run.prescribed for run in self.runs):
            return ()
        begin, end, *_ = self.coordinates[ALONG.index("place")]
        x, back = np.concatenate([_mean(k, k.x) for k in self.runs]), False
        for r in range(len(self.runs)):
            own = np.flatnonzero(self.event_run == r)
            within = [np.ptp(x[self.of == e]) for e in own if (self.of == e).any()]
            steps = (end - begin)[own]
            there, returned = steps[steps > 0.0].sum(), -steps[steps < 0.0].sum()
            short = np.median(within) < SHORT * np.ptp(end[own])
            back |= bool(short and min(there, returned) > 2.0 * np.median(np.abs(steps)))
        usable = [name for name in ALONG if self.distance(name) > 0.0]
        return tuple(name for name in usable if back or name != "place")

    def distance(self, coordinate: str) -> float:
        """Usual distance of neighbouring events along a coordinate (s or m)."""
        begin, end, *_ = self.coordinates[ALONG.index(coordinate)]
        return float(np.median(np.abs(end - begin)))

    def chain(self, follows: Follows | None, forces: Forces) -> Chain | None:
        """How levels go on from event to event; runs by themselves."""
        if follows is None:
            return None
        begin, end, share, held = self.coordinates[ALONG.index(follows.coordinate)]
        slide = np.concatenate([_mean(k, s) for k, s in zip(self.runs, forces.sliding, strict=True)])
        whole = -caps(forces.local)
        slides = np.clip(slide / np.where(whole == 0.0, np.inf, whole), 0.0, 1.0)
        now, then = np.ones(slides.size), np.ones(held.size)
        if follows.of != "both":
            shares = [part_of(follows.of, rested) for rested in forces.rested]
            now = np.concatenate([_mean(k, part) for k, part in zip(self.runs, shares, strict=True)])
            then = np.concatenate(
                [np.interp(_arrests(k), k.t, part) for k, part in zip(self.runs, shares, strict=True)]
            )
        rests, blocks = (1.0 - slides) * then[self.of], self.blocks
        return Chain(begin, end, self.event_run, follows.unit, blocks(share), blocks(slides * now), held, blocks(rests))

    def _by_run(self, both: Array) -> Array:
        """Sine and cosine, shape (p, 2), apart for every run with hum, shape (p, 2 h)."""
        own = self.run[:, None] == self.runs_with_hum
        return np.asarray((own[:, :, None] * both[:, None, :]).reshape(self.run.size, -1))

    def with_composition(self, composition: Composition) -> Problem:
        """The same runs under another composition."""
        other = object.__new__(Problem)
        other.__dict__.update(self.__dict__)
        other.composition = composition
        return other

    def with_jumps(self, events: Sequence[int]) -> Problem:
        """The same with a reading that jumps before some events and stays there; the sizes come last in ``common``."""
        other = self.with_composition(self.composition)
        rest = self.usual[: self.usual.size - len(self.jumps)]
        other.jumps, other.usual = tuple(events), np.append(rest, np.full(len(events), JUMP))
        return other

    def jumped(self, event: int) -> Array:
        """What a reading that is too high by 1 m from an event on takes from the residual (N), shape (p,)."""
        run = int(self.event_run[event])
        named = {f.name: f.start for f in self.composition.shared} | dict(self.composition.fixed)
        own = self.runs[run].stiffness
        spring = named["rig.spring_stiffness"] if own is None else own
        return np.where((self.run == run) & (self.of >= event), spring, 0.0)

    def in_bands(self, bands: Array) -> Problem:
        """The same with other frequencies of the noise, by phase (rad/s), shape (4,)."""
        other = self.with_composition(self.composition)
        other.bands = bands
        return other

    def carried_by(self, carrier: Array) -> Problem:
        """The same with what carries errors of the position and levels of runs to a force held as it is.

        With that of the model as it moves, a spring that begins to slide would make the force jump.

        Args:
            carrier: stiffness for what cycles share (N/m), what sine and cosine of the hum do (N), and what one e-fold
                of strength does (N), shape (p, 4).
        """
        other = self.with_composition(self.composition)
        other.carrier = carrier
        return other

    def adjusted(self, errors: Sequence[Array], point: Point) -> Problem:
        """The same with errors of the displacement taken off the motion that drives the model.

        Derivatives along a motion with noise go with its errors, and so do the residuals: parameters found from both
        are biased however long the record. What the errors do to the residuals stays in them, but for the part that
        is even in the errors: in the mean noise makes a path longer and a contact weaker, whatever its sign.

        Args:
            errors: at the knots of every run (m), shape (n,) each.
            point: of a fit.
        """
        zero = np.zeros(self.at.size)
        before, beyond = (self.moved([k * e for e in errors], zero).forces(point) for k in (0.0, 2.0))
        return self.moved(errors, 0.5 * (before.residual - beyond.residual))

    def moved(self, errors: Sequence[Array], offset: Array) -> Problem:
        """The same with given ``errors`` and ``offset``."""
        other = self.with_composition(self.composition)
        other.errors, other.offset = tuple(errors), offset
        steps = [old - new for old, new in zip(self.errors, errors, strict=True)]
        other.runs = tuple(replace(k, x=k.x + step) for k, step in zip(self.runs, steps, strict=True))
        rooms = (np.pad(step, (0, way.x.size - step.size), "edge") for step, way in zip(steps, self.ways, strict=True))
        other.ways = tuple(way._replace(x=way.x + room) for way, room in zip(self.ways, rooms, strict=True))
        return other

    def with_beyond(self, beyond: Array) -> Problem:
        """The same with other forces ``beyond`` first order (N), shape (p,)."""
        other = self.with_composition(self.composition)
        other.beyond = beyond
        return other

    def with_courses(self, courses: Sequence[Array]) -> Problem:
        """The same where the caps (e-folds) have a given course at the knots of every run, shape (n,) each."""
        other = self.with_beyond(np.zeros(self.at.size))
        rooms = (np.pad(course, (0, way.x.size - course.size)) for course, way in zip(courses, self.ways, strict=True))
        both = [(way, np.exp(room)) for room, way in zip(rooms, self.ways, strict=True)]
        other.ways = tuple(way._replace(strength=caps, stretch=caps) for way, caps in both)
        return other

    def recarried(self, slopes: Slopes, point: Point) -> Slopes:
        """What :meth:`evaluate` would say at the point where another carrier has."""
        columns = self._carried(slopes.tangent, slopes.local)
        c = columns.shape[1]
        shared = np.hstack([slopes.shared[:, :-c], columns])
        return replace(
            slopes, residual=slopes.residual + (columns - slopes.shared[:, -c:]) @ point.common, shared=shared
        )

    def _carried(self, tangent: Array, local: Array) -> Array:
        own = self.run[:, None] == np.arange(len(self.runs))
        jumps = np.stack([self.jumped(e) for e in self.jumps], axis=1) if self.jumps else np.zeros((own.shape[0], 0))
        if self.carrier is None:
            return np.hstack([tangent[:, None] * self._hats, local[:, :1] * own, tangent[:, None] * self._hums, jumps])
        shared, sine, cosine, level = self.carrier.T
        both = self._by_run(np.column_stack([sine, cosine]))
        return np.hstack([shared[:, None] * self._hats, level[:, None] * own, both, jumps])

    def values(self, point: Point) -> dict[str, float]:
        """Name -> SI value of what is shared."""
        c = self.composition
        return {**c.fixed, "rig.mass": c.mass, **to_si(c.shared, point.z)}

    def own(self, point: Point) -> list[Own]:
        """What differs from event to event in every run."""
        out = []
        for first, run, (own, of) in zip(self.first, self.runs, self._own, strict=True):
            value = np.zeros((own.shape.size, OWN))
            value[: run.events] = point.events[first : first + run.events]
            out.append(own._replace(value=value[of, VALUES], shape=value[:, SHAPE]))
        return out

    def common_input(self, point: Point) -> CommonInput:
        """What the forces of all runs are computed from."""
        c = self.composition
        return CommonInput(tuple(jax.tree.leaves(c.effects)), np.maximum(point.weights, EMPTY), c.reach)

    def run_inputs(self, point: Point) -> list[RunInput]:
        """What the forces of each run are computed from besides."""
        springs = [np.float64(np.nan if k.stiffness is None else k.stiffness) for k in self.runs]
        knots = [np.int64(k.t.size) for k in self.runs]
        return [RunInput(*own) for own in zip(springs, self.ways, knots, self.own(point), strict=True)]

    def evaluate(self, point: Point) -> Slopes:
        """Residuals and derivatives."""
        found, shared = self._evaluated(point, True)
        return Slopes(**vars(found), shared=shared)

    def forces(self, point: Point) -> Forces:
        """Residuals and derivatives in what is an event's own, in less time than all derivatives."""
        return self._evaluated(point, False)[0]

    @np.errstate(invalid="ignore", over="ignore")  # where the force is not finite a search turns back
    def _evaluated(self, point: Point, whole: bool) -> tuple[Forces, Array]:
        c = self.composition
        shared, phases = c.shared, c.phases
        # a damper and a spring beside the contact go with what is measured, and need no model along the motion
        straight = {f.name: i for i, f in enumerate(shared) if f.name in {DAMPING, BESIDE}}
        bent = [i for i in range(len(shared)) if i not in straight.values()]
        scales = np.array([0.0 if shared[i].scale == "log" else float(shared[i].scale) for i in bent])
        program = compiled(
            tuple(shared[i].name for i in bent), tuple(f.name for f in phases), jax.tree.structure(c.effects), whole
        )
        phase_scale = np.array([float(f.scale) for f in phases])
        values = self.values(point)
        damping, beside = values[DAMPING], values.get(BESIDE, 0.0)
        fixed = {n: np.float64(v) for n, v in {**c.fixed, "rig.mass": c.mass, DAMPING: damping}.items()}
        a, b, k, runs = len(shared), len(phases), point.weights.size, len(self.runs)
        size = self.at.size
        residual, springs, tangents, held = (np.zeros(size) for _ in range(4))
        starts = {**c.fixed, **{f.name: f.start for f in c.shared}}
        slow = self.phase == CREEPING
        share = np.ones(size)
        errors = self.usual.size
        slopes, local = np.zeros((size, a + b * runs + k + errors)), np.zeros((size, OWN))
        shown = any(isinstance(e, Sensor) for e in c.effects)
        common = self.common_input(point)

        def of_run(numbered: tuple[int, RunInput]) -> list[Any]:
            r, own = numbered
            phase = point.phases[:, r] * phase_scale
            return [np.asarray(a) for a in program(point.z[bent], phase, scales, phase_scale, fixed, common, own)]

        found = side_by_side(of_run, enumerate(self.run_inputs(point)), [k.t.size for k in self.runs])
        p, kept = 0, []
        for r, (run, parts) in enumerate(zip(self.runs, found, strict=True)):
            n, s = run.t.size, slice(p, p + run.at.size)
            q, shift, mass, slope, creeps, moves, delay, *parts = parts
            dq, dshift, dmass, _, dcreeps, dmoves, ddelay, elements, tangent, *state = parts
            rate, acceleration = run.rate, run.acceleration
            mean, (first, second) = run.mean, run.smooth
            way = mean @ (run.x - run.x[0])
            sensed = shown or run.force_scale is not None
            if sensed:
                rate, acceleration = rate + first @ shift[:n], acceleration + second @ shift[:n]
                way = way + mean @ shift[:n]
            spring = starts["rig.spring_stiffness"] if run.stiffness is None else run.stiffness
            weight = mean @ np.ones(n)
            # the noise of a reading that is late is taken ahead as well, the faster it is the larger it becomes
            band = self.bands[run.phase]
            late, later = np.sqrt(1.0 + (band * delay) ** 2), band**2 * delay * ddelay[:, None]
            read = not run.prescribed  # else a reading is told by itself, and the likelihood is that of the force
            by_spring, by_mass = mean @ creeps[:n], mean @ moves[:n]
            counts = np.where(slow[s], by_spring / spring, late * mass / c.mass * by_mass) / weight
            counts = counts if read else np.ones(run.at.size)
            share[s] = 1.0 / counts
            force = mean @ q[:n] - mass * acceleration - damping * rate - beside * way
            residual[s] = share[s] * force
            moved = mean @ dq[:, :n].T - acceleration[:, None] * dmass
            if sensed:
                moved = moved - mass * (second @ dshift[:, :n].T) - damping * (first @ dshift[:, :n].T)
                moved = moved - beside * (mean @ dshift[:, :n].T)
            slower, faster = (mean @ d[:, :n].T / v[:, None] for d, v in ((dcreeps, by_spring), (dmoves, by_mass)))
            faster = faster + dmass / mass + later.T / late[:, None] ** 2
            moved = share[s, None] * moved - read * residual[s, None] * np.where(slow[s, None], slower, faster)
            local[s] = moved[:, -OWN:]
            if whole:
                slopes[s, bent] = moved[:, : len(bent)]
                for name, i in straight.items():
                    slopes[s, i] = -share[s] * (damping * rate if name == DAMPING else shared[i].slope(1.0) * way)
                for j in range(b):
                    slopes[s, a + j * runs + r] = moved[:, len(bent) + j]
            held_by = mean @ elements[:n]
            slopes[s, a + b * runs : a + b * runs + k] = -share[s, None] * held_by
            held[s] = held_by @ common.weights + beside * way
            springs[s] = share[s] * (mean @ slope[:n])
            tangents[s] = share[s] * (mean @ tangent[:n] + beside)
            shares = np.interp(run.t, run.at, share[s])
            slides, sliding, psi = (a[:n] for a in state)
            kept.append(((tangent[:n] + beside) * shares, slides, sliding * shares, psi))
            p += run.at.size
        slopes[:, a + b * runs + k :] = self._carried(tangents, local)
        residual += self.offset + self.beyond + slopes[:, a + b * runs + k :] @ point.common
        sticking, sliding, forces, states = zip(*kept, strict=True)
        ratio = 1.0 - values["weakening.drop"]
        rested = tuple(psi / (ratio + (1.0 - ratio) * psi) for psi in states)
        return Forces(
            residual, local, springs, tangents, sticking, sliding, forces, states, rested, held, share
        ), slopes


def part_of(of: str, rested: Array) -> Array:
    """Share of the caps that is static or sliding friction's, or both, where that of static friction is ``rested``."""
    return np.ones_like(rested) if of == "both" else rested if of == "static" else 1.0 - rested


def coordinate(k: Knots, name: str) -> Array:
    """What a level may follow (one of :data:`ALONG`), at the knots of a run (s or m), shape (n,)."""
    return {"time": k.t, "slip path": np.append(0.0, np.cumsum(np.abs(np.diff(k.x)))), "place": k.x}[name]


def _coordinates(runs: Sequence[Knots]) -> list[tuple[Array, Array, Array, Array]]:
    """In the order of :data:`ALONG`: where every event begins and ends (E,), and shares between, (p,) and (E,).

    Events end in the middle of a slip. The shares are of the way of an event that is over at a point and at the arrest.
    """
    out = []
    for name in ALONG:
        parts = []
        for k in runs:
            way = coordinate(k, name)
            limits, values = np.interp(_limits(k), k.t, way), k.at if name == "time" else _mean(k, way)
            far = np.diff(limits)[k.of]
            share = (values - limits[k.of]) / np.where(far == 0.0, 1.0, far)
            held = np.interp(_arrests(k), k.t, way) - limits[:-1]
            held /= np.where(np.diff(limits) == 0.0, 1.0, np.diff(limits))
            parts.append((limits[:-1], limits[1:], np.clip(share, 0.0, 1.0), np.clip(held, 0.0, 1.0)))
        begin, end, share, held = (np.concatenate(v) for v in zip(*parts, strict=True))
        out.append((begin, end, share, held))
    return out


def _arrests(k: Knots) -> Array:
    """Times from which what sticks in every event has stuck, shape (E,)."""
    out = np.full(k.events, k.t[0])
    np.maximum.at(out, k.of, k.at - k.elapsed)
    return out


def _limits(k: Knots) -> Array:
    """Times at which the events of a run begin, and at which the last one ends, shape (E + 1,)."""
    out = np.full(k.events + 1, np.nan)
    out[0], out[-1] = k.t[0], k.t[-1]
    seen = np.unique(k.of)  # an event may have no point, and lies between its neighbours
    for before, after in pairwise(seen.tolist()):
        out[after] = 0.5 * (k.at[k.of == before].max() + k.at[k.of == after].min())
    known = np.isfinite(out)
    return np.interp(np.arange(out.size), np.flatnonzero(known), out[known])


def _mean(k: Knots, values: Array) -> Array:
    """Of what is given at the knots, at the points."""
    return np.asarray(k.mean @ values / (k.mean @ np.ones(values.size)))


def _room(size: int, least: int = LEAST_ROOM) -> int:
    """Knots that a compiled program has room for: few different numbers, so that campaigns share programs."""
    return int(max(least, 2 ** int(np.ceil(np.log2(size)))))


def _padded(k: Knots, n: int, load: float | None) -> Way:
    def grown(a: Array, step: float = 0.0) -> Array:
        return np.concatenate([a, a[-1] + step * np.arange(1, n - a.size + 1)])

    return Way(
        grown(k.t, 1e-3), grown(k.x), np.concatenate([k.v, np.zeros(n - k.v.size)]), grown(k.drive),
        np.ones(n), np.ones(n), np.zeros(1), np.zeros(n, int), np.ones(n) if load is None else grown(k.load / load),
        grown(k.force), force_scale=None if k.force_scale is None else np.float64(k.force_scale),
    )  # fmt: skip


def _hats(place: Array) -> Array:
    """Piecewise linear basis over the place in the cycle, shape (p, c)."""
    return np.stack([np.interp(place, NODES, row) for row in np.eye(len(NODES))], axis=1)


def _own(k: Knots, n: int, most: int) -> tuple[Own, NDArray[np.intp]]:
    """What may differ from event to event, all of it zero, and of each knot the event of each of :data:`VALUES`.

    The last event of all stands for none.
    """
    of = np.full((n, OWN), most - 1)
    for column, event in enumerate((k.event, k.event, k.event, k.arrest)):
        of[: k.t.size, column] = np.where((event >= 0) & (event < k.events), event, most - 1)
    shapes, at = (np.arange(most) < k.events).astype(float), of[:, VALUES]
    return Own(np.zeros(at.shape), shapes[at], np.zeros(most), shapes, of[:, SHAPE]), at
