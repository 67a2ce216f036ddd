"""A fitted model in an experiment that was not made: the rig as it is changed, its drive, its slips."""

from __future__ import annotations

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..contact import Bank
from ..fit.composition import Composition
from ..fit.parameters import to_si
from ..model import Model, State
from ..solve import Tolerance, Trajectory, integrate
from ..solve.trajectory import Steps
from .menu import Conditions, Experiment

TOLERANCE = (2e-3, 5e-12, 5e-8)
LEAST_DROP = 0.01  # of the full friction force; ringing drops the spring by a thousandth of it
LEAST_PEAK = 2.0  # times the drive's speed
PATIENCE = 6.0  # recurrences waited for a slip before the block is said to slide


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
    model = composition.model(np.asarray(z), jnp.zeros(2), nodes, jnp.asarray(conditions.stiffness))
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
