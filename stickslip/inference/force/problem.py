"""Force that is measured less force that the model holds, at the points of all runs, and its derivatives.

The free parameters: those of the base, the weights of a free bank of Jenkins elements (which measures the backbone),
those of effects, a phase for each run where an effect has one, and for each event a factor on strength, one on the
yield displacements and the error of the position at the arrest before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from operator import attrgetter
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from ...physics.contact import Bank
from ...physics.effects.base import Effect, Sensor
from ...physics.model import Block, LoadPoint, Model, Weakening
from ...system.threads import side_by_side
from ...system.traced import Program, of_this_package
from ..fit.parameters import Free, to_si
from .along import Way, along, lead, undone
from .knots import PHASES, Knots

Array = NDArray[np.float64]
PHASE = "phase"
DAMPING = "rig.damping"
BESIDE = "rig.parallel_stiffness"  # of a spring beside the contact, which never slides (N/m)
PULL = "start.pull"  # of the spring at the start of a record, where the contact is not virgin (N)
PROGRAMS = 64  # compiled at a time: each takes some two hundred mappings of memory, of which a process has 65530
CREEPING = PHASES.index("creep")
LEAST_ROOM = 1024  # knots
LOADED = 1e-3  # of the load, which it must vary by to be told of
EMPTY = 1e-30  # N; an element that holds nothing still shows what it would do
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
)  # of what cycles share, in units of the place
LOCAL = ("strength", "stretch", "shape", "offset")  # of each event: two logarithms, a power, and a length (m)
OWN = len(LOCAL)


class Own(NamedTuple):
    """What differs from event to event, at the knots of a run, shape (n, 4) each, in the order of :data:`LOCAL`.

    Attributes:
        value: of the event that a knot belongs to, zero where it belongs to none.
        moves: 1 where it belongs to one, else 0.
    """

    value: Any
    moves: Any


class Start(NamedTuple):
    """The effects without their numbers, which decide about a compiled program."""

    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Composition:
    """The base with some effects, and what of it is free.

    Attributes:
        mass: of the block (kg).
        reach: yield displacements of the bank's elements (m), shape (k,), increasing.
        free: free parameters of base and effects, those called "phase" for every run.
        fixed: SI values of base parameters that are not free.
        effects: instances; their free fields are overwritten.
        nominal: what is known of the full strength beforehand (N), and the standard deviation of its logarithm.
    """

    mass: float
    reach: Array
    free: tuple[Free, ...]
    fixed: dict[str, float] = field(default_factory=dict)
    effects: tuple[Effect, ...] = ()
    nominal: tuple[float, float] = (1.0, np.inf)

    @property
    def shared(self) -> tuple[Free, ...]:
        """Free parameters with one value for all runs."""
        return tuple(f for f in self.free if not is_own(f.name))

    @property
    def phases(self) -> tuple[Free, ...]:
        """Free parameters with a value for every run."""
        return tuple(f for f in self.free if is_own(f.name))

    def with_effect(self, effect: Effect, free: Sequence[Free]) -> Composition:
        """The same with one effect more."""
        return replace(self, free=(*self.free, *free), effects=(*self.effects, effect))

    def without(self, tag: str) -> Composition:
        """The same without an effect."""
        return replace(
            self,
            free=tuple(f for f in self.free if not f.name.startswith(f"{tag}.")),
            effects=tuple(e for e in self.effects if e.tag != tag),
        )


def is_own(name: str) -> bool:
    """Whether a parameter has a value for every run."""
    return name == PULL or name.rpartition(".")[2] == PHASE


@dataclass(frozen=True)
class Point:
    """Where in the space of parameters.

    Attributes:
        z: shared parameters on the search scale, shape (a,).
        phases: shape (b, R).
        weights: strength of every element (N), not negative, shape (k,).
        events: :data:`LOCAL` of each event, shape (E, 4).
        common: error of the position that all cycles share, as a function of the place in the cycle (m), and what is
            left of the hum in each run, over what is expected of it, shape (c,).
    """

    z: Array
    phases: Array
    weights: Array
    events: Array
    common: Array


@dataclass(frozen=True)
class Forces:
    """Residual force at a point.

    What is measured is a motion, and the likelihood is that of the motion: a model that makes forces smaller makes what
    an error of the motion does to them smaller too, and must not gain by it. Residuals, derivatives and stiffnesses are
    therefore taken over what a reading counts for in the model, times what it counts for as the rig is stated: the
    mass that moves where the block is fast, the stiffness of the spring where it creeps (what the contact holds there
    grows as the spring's force does), and everywhere the displacement over what the sensor shows of it: less where the
    block is fast and the sensor late.

    Attributes:
        residual: measured force less the model's (N), shape (p,).
        local: derivatives in the event's own, shape (p, 4).
        spring: stiffness of the spring (N/m), shape (p,).
        tangent: stiffness of what sticks (N/m), shape (p,).
        sticking: the same at the knots of every run, shape (n,) each.
        slides: whether an element slides there, shape (n, k) each.
        sliding: force of those that slide (N), shape (n,) each.
        psi: state of the weakening, shape (n,) each.
        held: force that the model holds (N), shape (p,).
        share: what a reading counts for as the rig is stated, over what it counts for in the model, shape (p,).
    """

    residual: Array
    local: Array
    spring: Array
    tangent: Array
    sticking: tuple[Array, ...]
    slides: tuple[NDArray[np.bool_], ...]
    sliding: tuple[Array, ...]
    psi: tuple[Array, ...]
    held: Array
    share: Array

    @property
    def measured(self) -> Array:
        """Force that the motion says (N), shape (p,)."""
        return np.asarray(self.held + self.residual / self.share)


@dataclass(frozen=True)
class Slopes(Forces):
    """Residual force and all its derivatives.

    Attributes:
        shared: derivatives in z, phases of all runs, weights and errors of the position, shape (p, a + b R + k + c).
    """

    shared: Array

    @property
    def finite(self) -> bool:
        """Whether a search can go on from here."""
        return all(np.isfinite(a).all() for a in (self.residual, self.local, self.shared))


class Problem:
    """All runs of a campaign under one composition.

    Errors of the position that are found with the model are ``readings`` (m), shape (p, c), each about ``usual`` times.
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
        self.run = np.concatenate([np.full(k.at.size, r) for r, k in enumerate(runs)])
        self.event_run = np.concatenate([np.full(k.events, r) for r, k in enumerate(runs)])
        self.phase, self.place, self.at = (
            np.concatenate([getattr(k, name) for k in runs]) for name in ("phase", "place", "at")
        )
        self.elapsed = np.concatenate([k.elapsed for k in runs])
        self.lasting = np.concatenate([k.lasting[: k.events] for k in runs])
        self.begins = np.isin(np.arange(self.events), self.first)
        self._events = tuple(_events(k, room, int(f)) for k, f in zip(runs, first[:-1], strict=True))
        virgin = np.isin(self.of, [f for f, k in zip(first[:-1], runs, strict=True) if k.virgin])
        hats = _hats(self.place)
        # quantisation and filters leave about as much alike in all cycles as the noise of one sample is
        systematic = max(float(np.median([k.noise for k in runs])), 1e-12)
        alike = np.hstack([hats * ~virgin[:, None], hats * virgin[:, None]])
        self.hums = np.array([r for r, k in enumerate(runs) if k.hum.any()], int)
        at_points = np.concatenate([k.mean @ (k.reading.displacement @ k.hum) for k in runs])
        self.readings = np.hstack([alike, self._by_run(at_points)])
        self.usual = np.concatenate([np.full(alike.shape[1], systematic), np.ones(2 * self.hums.size)])
        self.carrier: Array | None = None

    def _by_run(self, both: Array) -> Array:
        """Sine and cosine, shape (p, 2), apart for every run with hum, shape (p, 2 h)."""
        own = self.run[:, None] == self.hums
        return np.asarray((own[:, :, None] * both[:, None, :]).reshape(self.run.size, -1))

    def with_composition(self, composition: Composition) -> Problem:
        """The same runs under another composition."""
        other = object.__new__(Problem)
        other.__dict__.update(self.__dict__)
        other.composition = composition
        return other

    def carried_by(self, carrier: Array) -> Problem:
        """The same with what carries errors of the position to a force held as it is.

        With that of the model as it moves, a spring that begins to slide would make the force jump.

        Args:
            carrier: stiffness for what cycles share (N/m), and what sine and cosine of the hum do (N), shape (p, 3).
        """
        other = self.with_composition(self.composition)
        other.carrier = carrier
        return other

    def recarried(self, slopes: Slopes, point: Point) -> Slopes:
        """What :meth:`evaluate` would say at the point where another carrier has."""
        columns = self._carried(slopes.tangent)
        c = columns.shape[1]
        shared = np.hstack([slopes.shared[:, :-c], columns])
        return replace(
            slopes, residual=slopes.residual + (columns - slopes.shared[:, -c:]) @ point.common, shared=shared
        )

    def _carried(self, tangent: Array) -> Array:
        if self.carrier is None:
            return np.asarray(tangent[:, None] * self.readings)
        alike = self.readings.shape[1] - 2 * self.hums.size
        return np.hstack([self.carrier[:, :1] * self.readings[:, :alike], self._by_run(self.carrier[:, 1:])])

    def values(self, point: Point) -> dict[str, float]:
        """Name -> SI value of what is shared."""
        c = self.composition
        return {**c.fixed, "rig.mass": c.mass, **to_si(c.shared, point.z)}

    def own(self, point: Point) -> list[Own]:
        """What differs from event to event, at the knots of every run."""
        events = np.concatenate([point.events, np.zeros((1, OWN))])
        columns = np.arange(OWN)
        return [Own(events[index, columns], (index >= 0).astype(float)) for index in self._events]

    def run_arguments(self, point: Point) -> list[tuple[Any, ...]]:
        """Of every run: its own spring (N/m), way, number of knots, band, and what differs from event to event."""
        springs = [np.float64(np.nan if k.stiffness is None else k.stiffness) for k in self.runs]
        knots = [np.int64(k.t.size) for k in self.runs]
        bands = [np.float64(k.band) for k in self.runs]
        return list(zip(springs, self.ways, knots, bands, self.own(point), strict=True))

    def evaluate(self, point: Point) -> Slopes:
        """Residuals and derivatives."""
        found, shared = self._evaluated(point, True)
        return Slopes(**vars(found), shared=shared)

    def forces(self, point: Point) -> Forces:
        """Residuals and derivatives in what is an event's own, in a third of the time of all derivatives."""
        return self._evaluated(point, False)[0]

    def _evaluated(self, point: Point, whole: bool) -> tuple[Forces, Array]:
        c = self.composition
        shared, phases = c.shared, c.phases
        # a damper and a spring beside the contact go with what is measured, and need no model along the motion
        straight = {f.name: i for i, f in enumerate(shared) if f.name in {DAMPING, BESIDE}}
        bent = [i for i in range(len(shared)) if i not in straight.values()]
        scales = np.array([0.0 if shared[i].scale == "log" else float(shared[i].scale) for i in bent])
        program = _program(
            tuple(shared[i].name for i in bent), tuple(f.name for f in phases), jax.tree.structure(c.effects), whole
        )
        phase_scale = np.array([float(f.scale) for f in phases])
        leaves = tuple(jax.tree.leaves(c.effects))
        values = self.values(point)
        damping, beside = values[DAMPING], values.get(BESIDE, 0.0)
        fixed = {n: np.float64(v) for n, v in {**c.fixed, "rig.mass": c.mass, DAMPING: damping}.items()}
        weights = np.maximum(point.weights, EMPTY)
        a, b, k, runs = len(shared), len(phases), point.weights.size, len(self.runs)
        size = self.at.size
        residual, springs, tangents, held = (np.zeros(size) for _ in range(4))
        starts = {**c.fixed, **{f.name: f.start for f in c.shared}}
        slow = self.phase == CREEPING
        share = np.ones(size)
        errors = self.readings.shape[1]
        slopes, local = np.zeros((size, a + b * runs + k + errors)), np.zeros((size, OWN))
        sensed = any(isinstance(e, Sensor) for e in c.effects)
        common = scales, phase_scale, fixed, leaves, weights, c.reach

        def of_run(numbered: tuple[int, tuple[Any, ...]]) -> list[Any]:
            r, arguments = numbered
            return [
                np.asarray(a) for a in program(point.z[bent], point.phases[:, r] * phase_scale, *common, *arguments)
            ]

        found = side_by_side(of_run, enumerate(self.run_arguments(point)), [k.t.size for k in self.runs])
        p, kept = 0, []
        for r, (run, parts) in enumerate(zip(self.runs, found, strict=True)):
            n, s = run.t.size, slice(p, p + run.at.size)
            q, shift, mass, slope, gain, late, *parts = parts
            dq, dshift, dmass, dslope, dgain, dlate, elements, tangent, *state = parts
            rate, acceleration = run.rate, run.acceleration
            mean, (first, second) = run.mean, run.smooth
            way = mean @ (run.x - run.x[0])
            if sensed:
                rate, acceleration = rate + first @ shift[:n], acceleration + second @ shift[:n]
                way = way + mean @ shift[:n]
            spring = starts["rig.spring_stiffness"] if run.stiffness is None else run.stiffness
            steep = mean @ slope[:n] / (mean @ np.ones(n))
            read = not run.prescribed  # else a reading is told by itself, and the likelihood is that of the force
            counts = gain * np.where(slow[s], steep / spring, late * mass / c.mass) if read else np.ones(run.at.size)
            share[s] = 1.0 / counts
            residual[s] = share[s] * (mean @ q[:n] - mass * acceleration - damping * rate - beside * way)
            moved = mean @ dq[:, :n].T - acceleration[:, None] * dmass
            if sensed:
                moved = moved - mass * (second @ dshift[:, :n].T) - damping * (first @ dshift[:, :n].T)
                moved = moved - beside * (mean @ dshift[:, :n].T)
            faster = dmass / mass + dlate / late
            grown = np.where(slow[s, None], (mean @ dslope[:, :n].T) / (mean @ slope[:n])[:, None], faster)
            moved = share[s, None] * moved - read * residual[s, None] * (grown + dgain / gain)
            local[s] = moved[:, -OWN:]
            if whole:
                slopes[s, bent] = moved[:, : len(bent)]
                for name, i in straight.items():
                    slopes[s, i] = -share[s] * (damping * rate if name == DAMPING else shared[i].slope(1.0) * way)
                for j in range(b):
                    slopes[s, a + j * runs + r] = moved[:, len(bent) + j]
            held_by = mean @ elements[:n]
            slopes[s, a + b * runs : a + b * runs + k] = -share[s, None] * held_by
            held[s] = held_by @ weights + beside * way
            springs[s] = share[s] * (mean @ slope[:n])
            tangents[s] = share[s] * (mean @ tangent[:n] + beside)
            shares = np.interp(run.t, run.at, share[s])
            slides, sliding, psi = (a[:n] for a in state)
            kept.append(((tangent[:n] + beside) * shares, slides, sliding * shares, psi))
            p += run.at.size
        slopes[:, a + b * runs + k :] = self._carried(tangents)
        residual += slopes[:, a + b * runs + k :] @ point.common
        sticking, sliding, forces, states = zip(*kept, strict=True)
        return Forces(residual, local, springs, tangents, sticking, sliding, forces, states, held, share), slopes


def _room(size: int) -> int:
    """Knots that a compiled program has room for: few different numbers, so that campaigns share programs."""
    return int(max(LEAST_ROOM, 2 ** int(np.ceil(np.log2(size)))))


def _padded(k: Knots, n: int, load: float | None) -> Way:
    def grown(a: Array, step: float = 0.0) -> Array:
        return np.concatenate([a, a[-1] + step * np.arange(1, n - a.size + 1)])

    # turning points are knots
    return Way(
        grown(k.t, 1e-3), grown(k.x), np.concatenate([k.v, np.zeros(n - k.v.size)]), grown(k.drive), np.zeros(n),
        np.ones(n), np.ones(n), np.zeros(n), np.ones(n) if load is None else grown(k.load / load),
        grown(k.force),
    )  # fmt: skip


def _hats(place: Array) -> Array:
    """Piecewise linear basis over the place in the cycle, shape (p, c)."""
    return np.stack([np.interp(place, NODES, row) for row in np.eye(len(NODES))], axis=1)


def _events(k: Knots, n: int, first: int) -> NDArray[np.intp]:
    """Of each knot the event of each of :data:`LOCAL`, shape (n, 4); the last one of all, -1, stands for none."""
    out = np.full((n, OWN), -1)
    for column, event in enumerate((k.event, k.event, k.event, k.arrest)):
        out[: k.t.size, column] = np.where((event >= 0) & (event < k.events), event + first, -1)
    return out


def model_of(values: dict[str, Any], effects: tuple[Effect, ...], bank: Bank, own: Any) -> Model:
    """The model with these numbers; ``own`` is the spring of the run (N/m), nan where it has none."""
    spring = jnp.where(jnp.isnan(own), values["rig.spring_stiffness"], own)
    block = Block(mass=values["rig.mass"], spring_stiffness=spring, damping=values[DAMPING])
    weakening = Weakening(
        ratio=1.0 - values["weakening.drop"],
        slip_distance=values["weakening.slip_distance"],
        healing_time=values["weakening.healing_time"],
    )
    still = LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, 0.0]))
    return Model(block, bank, weakening, still, tuple(_set(e, values) for e in effects))


def _set(effect: Effect, values: dict[str, Any]) -> Effect:
    for name, value in values.items():
        tag, _, own = name.partition(".")
        if tag == effect.tag:
            effect = eqx.tree_at(attrgetter(own), effect, value)
    return effect


@lru_cache(maxsize=PROGRAMS)
def _program(names: tuple[str, ...], phases: tuple[str, ...], structure: Any, whole: bool) -> Program:
    """The compiled forces at the knots of one run, shape (n,), with derivatives in shared, phases and locals.

    Those in locals alone where they are not wanted as a ``whole``.

    Runs and events are not in its shapes, so that all campaigns share it.
    """
    a, b = len(names), len(phases)

    def forces(
        z: Any, turn: Any, event: Any, scales: Any, fixed: Any, effects: Any, weights: Any, reach: Any, spring: Any,
        way: Way, knots: Any, band: Any,
    ) -> Any:  # fmt: skip
        si = {n: jnp.where(s == 0.0, jnp.exp(v), v * s) for n, v, s in zip(names, z, scales, strict=True)}
        values = {**fixed, **si, **dict(zip(phases, turn, strict=True))}
        if PULL in values:
            stiffness = jnp.where(jnp.isnan(spring), values["rig.spring_stiffness"], spring)
            way = way._replace(drive=way.drive + values[PULL] / stiffness)
        model = model_of(values, effects, Bank(weights / reach, weights), spring)
        seen, late = way, jnp.ones(())
        if any(isinstance(e, Sensor) for e in effects):
            # the measured force, near enough for a sensor that sees it
            force = model.block.spring_stiffness * (way.drive - way.x) + way.force

            def before(rate: Any) -> Way:
                return undone(model, way._replace(v=rate), force, knots)

            # what a reading that is late is taken ahead by is its rate's, and the faster the larger
            seen, ahead = jax.jvp(before, (way.v,), (jnp.ones_like(way.v),))
            late = jnp.sqrt(1.0 + (band * jnp.sum(ahead.x) / way.x.size) ** 2)
        shift = seen.x - way.x
        held = along(model, of_events(seen, event), knots)
        steep = jax.vmap(jax.grad(model.pull))(lead(model, way.t, way.drive) - seen.x)
        # how much the displacement changes where the reading does
        steps = jnp.diff(way.x)
        gain = 1.0 + jnp.sum(steps * jnp.diff(shift)) / jnp.sum(steps**2)
        return (
            (held.pull + way.force + held.body - held.contact, shift, model.mass(), steep, gain, late),
            (held.elements, held.tangent, held.slides, held.sliding, held.psi),
        )

    def derived(
        z: Any, turn: Any, scales: Any, turn_scale: Any, fixed: Any, leaves: Any, weights: Any, reach: Any, spring: Any,
        way: Way, knots: Any, band: Any, own: Own,
    ) -> Any:  # fmt: skip
        effects = jax.tree.unflatten(structure, leaves)

        def moved(row: Any) -> Any:
            def f(z: Any, turn: Any, event: Any) -> Any:
                return forces(z, turn, event, scales, fixed, effects, weights, reach, spring, way, knots, band)

            # all events are moved at once: each acts on its own points only
            step = own.moves * row[a + b :]
            return jax.jvp(f, (z, turn, own.value), (row[:a], row[a : a + b] * turn_scale, step), has_aux=True)

        out, slope, aux = jax.vmap(moved, out_axes=(None, 0, None))(jnp.eye(a + b + OWN)[0 if whole else a + b :])
        return *out, *slope, *aux

    name = f"{'along' if whole else 'forces along'} {names} {phases} {structure}"
    return Program(derived, name if of_this_package(structure) else None)


def of_events(way: Way, event: Any) -> Way:
    """The way with what differs from event to event, shape (n, 4)."""
    return way._replace(
        x=way.x + event[:, 3], strength=jnp.exp(event[:, 0]), stretch=jnp.exp(event[:, 1]), shape=event[:, 2]
    )
