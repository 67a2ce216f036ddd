"""Experiments that were not made: what a fitted model would do in them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..contact import Bank
from ..features.measurement import Measurement
from ..fit.composition import Composition
from ..fit.parameters import to_si
from ..model import Model, State
from ..solve import Tolerance, Trajectory, integrate
from ..solve.trajectory import Steps

TOLERANCE = (2e-3, 5e-12, 5e-8)
LEAST_DROP = 0.01  # of the full friction force; ringing drops the spring by a thousandth of it
LEAST_PEAK = 2.0  # times the drive's speed
PATIENCE = 6.0  # recurrences waited for a slip before the block is said to slide
HELD_AT = 0.8  # of the stick: where a hold begins
BACK = 0.8  # of full friction, to which a reversed start pulls the other way
_PREFIXES = {-9: "n", -6: "u", -3: "m", 0: "", 3: "k"}
FEATURES = ("recurrence", "size", "peak", "creep", "frequency", "hold")


@dataclass(frozen=True)
class Experiment:
    """One entry of the menu, relative to what was measured.

    Attributes:
        name: in one or two words.
        of: which of the measured velocities it takes: "slowest", "middle" or "fastest".
        speed: factor on that velocity.
        hold: of the drive in the middle of a stick (s); 0 for none.
        load: factor on the normal load.
        mass: factor on the mass, with the load on the contacts kept.
        reversed: whether the contact is first pulled the other way, short of slipping.
    """

    name: str
    of: str = "middle"
    speed: float = 1.0
    hold: float = 0.0
    load: float = 1.0
    mass: float = 1.0
    reversed: bool = False

    def words(self, conditions: Conditions) -> str:
        """What to do, for a person."""
        if self.hold:
            return f"hold the drive for {self.hold:g} s in the middle of a stick"
        if self.load != 1.0:
            return f"multiply the normal load by {self.load:g}"
        if self.mass != 1.0:
            return f"add {100 * (self.mass - 1):.0f} % of mass without loading the contacts more"
        if self.reversed:
            return f"start in reverse: pull the other way to {100 * BACK:.0f} % of the slip force, then forward"
        return f"drive at {quantity(conditions.velocity(self), 'm/s')}"


MENU = (
    Experiment("slow drive", "slowest", 0.25),
    Experiment("fast drive", "fastest", 4.0),
    Experiment("hold 10 s", hold=10.0),
    Experiment("hold 100 s", hold=100.0),
    Experiment("double load", load=2.0),
    Experiment("added mass", mass=1.5),
    Experiment("reversed start", reversed=True),
)


class Conditions(NamedTuple):
    """What was measured, as far as an experiment refers to it.

    Attributes:
        velocities: of the drive (m/s).
        period: of the contact resonance (s).
        stiffness: of the spring where the runs have another than the rig (N/m), else nan.
        noise: standard deviation of a level that the sensor reads (m).
        clock: of a time (s).
    """

    velocities: tuple[float, ...]
    period: float
    stiffness: float = math.nan
    noise: float = 0.0
    clock: float = 0.0

    @classmethod
    def of(cls, m: Measurement) -> Conditions:
        """Those of a measurement."""
        s, used = m.layout.slices(), np.asarray(m.cycles.used)
        own = np.asarray(m.cycles.stiffness, float)
        return cls(
            tuple(sorted({float(f"{v:.6g}") for v in m.velocities})),
            float(np.asarray(m.anchors.ring_period).flat[0]),
            float(own[0]) if np.isfinite(own).all() else math.nan,
            float(np.median(m.sensor[used][:, s["size"]])),
            float(np.median(m.sensor[used][:, s["recurrence"]])),
        )

    def velocity(self, experiment: Experiment) -> float:
        """Of the drive in an experiment (m/s)."""
        known = sorted(self.velocities)
        at = {"slowest": known[0], "middle": known[len(known) // 2], "fastest": known[-1]}[experiment.of]
        return experiment.speed * at


class Outcome(NamedTuple):
    """What the last slip of an experiment is like, SI.

    Attributes:
        recurrence: time from the half of the slip before, or from the start, to its half (s).
        size: of the slip (m).
        peak: largest velocity of the reading (m/s).
        creep: from the slip before, or the start, until shortly before the slip (m).
        frequency: of the ringing after it (Hz).
        hold: creep while the drive is held (m).
        duration: of the slip (s).
        approach: velocity of the creep at its end (m/s).
    """

    recurrence: float
    size: float
    peak: float
    creep: float
    frequency: float
    hold: float
    duration: float
    approach: float


class Slip(NamedTuple):
    """When the spring's force begins and ceases to fall (s)."""

    onset: float
    arrest: float


def prepared(composition: Composition, z: np.ndarray, conditions: Conditions, experiment: Experiment) -> Model:
    """The model of the rig as an experiment changes it, its drive still to be set.

    With the load F the caps grow as F and u_max as F^(1/p) (contact stiffness as F^(1 - 1/p), which is F^(1/(1+H)) for
    a self-affine line; Pohrt, Popov and Filippov 2012).
    """
    nodes = _nodes([(1.0, 0.0)])
    model = composition.model(jnp.asarray(z), jnp.zeros(2), nodes, jnp.asarray(conditions.stiffness))
    if experiment.load != 1.0:
        p = {**composition.fixed, **to_si(composition.free, z)}["contact.p"]
        stiffer = experiment.load ** (1.0 - 1.0 / p)
        bank = Bank(model.bank.stiffness * stiffer, model.bank.strength * experiment.load)
        model = eqx.tree_at(lambda m: m.bank, model, bank)
    if experiment.mass != 1.0:
        model = eqx.tree_at(lambda m: m.block.mass, model, model.block.mass * experiment.mass)
    return model


def _nodes(pieces: list[tuple[float, float]]) -> tuple[jnp.ndarray, jnp.ndarray]:
    """Nodes of the load point from durations (s) and velocities (m/s); always four, so that one program serves all."""
    padded = [*pieces, *[(1.0, pieces[-1][1])] * (3 - len(pieces))]
    t = np.concatenate([[0.0], np.cumsum([dt for dt, _ in padded])])
    x = np.concatenate([[0.0], np.cumsum([dt * v for dt, v in padded])])
    return jnp.asarray(t), jnp.asarray(x)


def driven(model: Model, pieces: list[tuple[float, float]]) -> Model:
    """The model with a drive of pieces: duration (s), velocity (m/s); it goes on at the last velocity."""
    return eqx.tree_at(lambda m: (m.load_point.times, m.load_point.positions), model, _nodes(pieces))


class Run:
    """An integration that goes on until enough has been seen."""

    def __init__(self, model: Model, pieces: list[tuple[float, float]]) -> None:
        self.model = driven(model, pieces)
        ends = np.cumsum([dt for dt, _ in pieces])[:-1]
        self.stops = tuple(float(t) for t in ends)
        self.speeds = [abs(v) for _, v in pieces]
        self.strength = float(jnp.sum(model.bank.strength))
        self._state: State | None = None
        self._parts: list[Trajectory] = []
        self.now = 0.0

    def to(self, end: float) -> None:
        """Integrate on to a time (s)."""
        tolerance = Tolerance(*(jnp.asarray(a) for a in TOLERANCE))
        part, self._state = integrate(
            self.model, end, t0=self.now, state=self._state, tolerance=tolerance, stops=self.stops, largest_step=0.1
        )
        self._parts.append(part)
        self.now = end

    @property
    def trajectory(self) -> Trajectory:
        """All of it."""
        first, *rest = (part.steps for part in self._parts)
        whole = [np.concatenate([a, *(s[1:] for s in more)]) for a, *more in zip(first, *rest, strict=True)]
        return Trajectory(Steps(*whole), self._parts[-1].stats)

    def slips(self) -> list[Slip]:
        """Slips that are complete: the block outruns the load point while the pull on it falls by a good part."""
        s = self.trajectory.steps
        speed = np.asarray(self.speeds)[np.searchsorted(self.stops, s.t, side="right")]
        lead = s.v - speed
        ahead = np.concatenate([[False], lead > 0.0, [False]])
        edges = np.flatnonzero(ahead[1:] != ahead[:-1]).reshape(-1, 2)
        found = []
        for first, after in edges[(edges[:, 0] > 0) & (edges[:, 1] < s.t.size)]:
            drop = s.spring_force[first - 1] - s.spring_force[after]
            if drop > LEAST_DROP * self.strength and s.v[first:after].max() > LEAST_PEAK * max(self.speeds):
                found.append(Slip(float(s.t[first]), float(s.t[after])))
        return found


def estimates(model: Model, speed: float) -> tuple[float, float]:
    """Time to the first slip and from slip to slip (s), roughly."""
    k, strength = float(model.block.spring_stiffness), float(jnp.sum(model.bank.strength))
    caps, springs = np.asarray(model.bank.strength), np.asarray(model.bank.stiffness)
    u_max = float(np.max(caps[springs > 0.0] / springs[springs > 0.0]))
    fall = (1.0 - float(model.weakening.ratio)) * strength
    return (strength / k + u_max) / speed, 2.0 * fall / (k * speed) + math.pi * math.sqrt(float(model.block.mass) / k)


def until_slips(model: Model, pieces: list[tuple[float, float]], wanted: int) -> tuple[Run, list[Slip]]:
    """Integrate until so many slips are complete and have rung down, or none comes any more."""
    run = Run(model, pieces)
    moving = abs(pieces[-1][1])
    first, period = estimates(model, moving)
    idle = run.stops[-1] if run.stops else 0.0
    run.to(idle + 1.1 * first if wanted == 1 else max(idle, first) + 1.2 * (wanted - 1) * period)
    seen, last = run.slips(), run.now
    while len(seen) < wanted and run.now < last + PATIENCE * period:
        run.to(run.now + 0.5 * period)
        if len(run.slips()) > len(seen):
            last = run.now
        seen = run.slips()
    if len(seen) >= wanted:
        end = seen[wanted - 1].arrest + 3.5 * (seen[wanted - 1].arrest - seen[wanted - 1].onset)
        if run.now < end:
            run.to(end)  # until it has rung down
    return run, seen


def outcome(run: Run, slips: list[Slip], number: int, period: float, hold: tuple[float, float] | None) -> Outcome:
    """What the slip with this number (from 0) is like.

    Args:
        run: the integration.
        slips: all of them.
        number: of the slip.
        period: of the contact resonance (s).
        hold: when the drive was held (s, s).
    """
    whole, slip = run.trajectory, slips[number]
    before = slips[number - 1] if number > 0 else None
    duration = slip.arrest - slip.onset
    shortest = max(0.13 * duration, 2.0 * period)
    stick = slip.onset - (before.arrest if before is not None else 0.0)

    def read(times: np.ndarray) -> np.ndarray:
        return np.asarray(whole.at(times).reading)

    def level(after: Slip) -> float:
        """Of the reading after a slip (m), the ringing averaged out."""
        begin, length = min(2.5 * duration, 0.25 * stick), min(0.7 * duration, 0.15 * stick)
        return float(np.mean(read(after.arrest + np.linspace(begin, begin + length, 400))))

    def half(of: Slip) -> float:
        t = np.linspace(of.onset, of.arrest, 800)
        x = np.maximum.accumulate(read(t))
        return float(np.interp(0.5 * (x[0] + x[-1]), x, t))

    end = slip.onset - shortest
    last, earlier = read(np.array([end, end - 0.25 * shortest]))
    rest = float(read(np.array([run.stops[0] if run.stops else 0.0]))[0]) if before is None else level(before)
    t = np.linspace(slip.onset, slip.arrest, 800)
    x = read(t)
    crept = math.nan
    if hold is not None and slip.onset > hold[1]:
        first, second = read(np.array(hold))
        crept = float(second - first)
    return Outcome(
        half(slip) - (0.0 if before is None else half(before)),
        level(slip) - float(x[0]),
        float(np.max(np.gradient(x, t))),
        float(last - rest) if stick > 2.0 * shortest else math.nan,
        _frequency(whole, slip.arrest, period),
        crept,
        duration,
        float(last - earlier) / (0.25 * shortest),
    )


def _frequency(whole: Trajectory, arrest: float, period: float) -> float:
    """Of the ringing after an arrest (Hz), from the zeros of the block's velocity; nan where it hardly rings."""
    t = np.linspace(arrest, arrest + 9.0 * period, 1200)
    v = np.asarray(whole.at(t).v)
    v = v - np.mean(v)
    up = np.flatnonzero((v[:-1] < 0.0) & (v[1:] >= 0.0))
    if up.size < 3:
        return math.nan
    zeros = t[up] - v[up] * (t[up + 1] - t[up]) / (v[up + 1] - v[up])
    return float((zeros.size - 1) / (zeros[-1] - zeros[0]))


def quantity(value: float, unit: str) -> str:
    """``0.0123, "s"`` as ``12 ms``."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g} {unit}"
    power = max(-9, min(3, 3 * math.floor(math.log10(value * 1.005) / 3)))
    return f"{value / 10.0**power:.3g} {_PREFIXES[power]}{unit}"
