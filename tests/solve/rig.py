"""The rig of the proofs, and how its traces are measured."""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from stickslip.physics.contact import Bank, bank_from_backbone, power_law_backbone, power_law_bank
from stickslip.physics.model import Block, LoadPoint, Model, State, Weakening
from stickslip.simulation.solve import Tolerance

STRENGTH = 0.2604  # N
U_MAX = 0.95e-6  # m
P = 3.2
MASS = 0.0894  # kg
FAR = 1e6  # s; nodes of the load point out of reach, so that all drives have the same shape and compile once
NODES = 5

DEFAULT = Tolerance()


def tighter(factor: float) -> Tolerance:
    """The default tolerance, divided."""
    return Tolerance(1e-4 / factor, 3e-12 / factor, 3e-8 / factor)


def drive(*pieces: tuple[float, float]) -> LoadPoint:
    """The load point through pieces (duration in s, velocity in m/s); the last velocity goes on."""
    times, positions = [0.0], [0.0]
    for duration, velocity in pieces:
        times.append(times[-1] + duration)
        positions.append(positions[-1] + duration * velocity)
    while len(times) < NODES:
        times.append(times[-1] + FAR)
        positions.append(positions[-1] + FAR * pieces[-1][1])
    return LoadPoint(jnp.asarray(times), jnp.asarray(positions))


def bank(n: int = 128, u_max: float = U_MAX, p: float = P, strength: float = STRENGTH) -> Bank:
    return power_law_bank(strength, u_max, p, n=n)


def fine_start_bank(n: int = 128, power: float = 2.0, p: float = P, u_max: float = U_MAX) -> Bank:
    """A bank whose elements crowd at small thresholds, for motions that are small against u_max."""
    return bank_from_backbone(
        lambda u: power_law_backbone(u, u_max, STRENGTH, p), u_max, (np.arange(1, n + 1) / n) ** power
    )


def rig(
    velocity: float = 5e-5,
    *,
    springs: Bank | None = None,
    load_point: LoadPoint | None = None,
    mass: Any = MASS,
    spring_stiffness: Any = 1000.0,
    damping: Any = 10.0,
    ratio: Any = 0.85,
    slip_distance: Any = 1e-6,
    healing_time: Any = 0.02,
    effects: tuple = (),
) -> Model:
    """The block on a power-law contact; ``ratio=1`` is constant friction."""
    return Model(
        Block(mass, spring_stiffness, damping),
        bank() if springs is None else springs,
        Weakening(ratio, slip_distance, healing_time),
        drive((FAR, velocity)) if load_point is None else load_point,
        effects,
    )


def already_creeping(model: Model, velocity: float) -> State:
    """Virgin contact at the start, at the velocity of quasi-static creep, so that nothing rings."""
    c_s = float(model.block.spring_stiffness)
    return model.rest(v=c_s * velocity / (float(model.bank.total_stiffness) + c_s))


def sliding(model: Model, velocity: float, push: float = 0.0) -> State:
    """Steady sliding at ``velocity`` (m/s), the block faster by the share ``push``; the load point is at zero then."""
    psi = model.weakening.steady(jnp.asarray(velocity))
    caps = model.bank.strength * model.weakening.strength(psi)
    pull = jnp.sum(caps) + model.block.damping * velocity
    state = model.rest(x=-pull / model.block.spring_stiffness, v=velocity * (1.0 + push))
    return eqx.tree_at(lambda s: (s.force, s.cap, s.psi), state, (caps, caps, psi))


class Slips(NamedTuple):
    """Complete slips: velocity rises through the threshold (onset, s), falls to zero (arrest, s); m, m/s."""

    onset: np.ndarray
    arrest: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    peak: np.ndarray

    @property
    def size(self) -> np.ndarray:
        return self.end - self.begin

    @property
    def recurrence(self) -> np.ndarray:
        return np.diff(self.onset)


def slips(t: np.ndarray, x: np.ndarray, v: np.ndarray, threshold: float = 5e-4) -> Slips:
    """Slips of a trace. The threshold (m/s) lies above any ringing and below a fifth of the slip's peak velocity."""
    found = []
    i = 0
    while True:
        over = np.flatnonzero(v[i:] > threshold)
        if not over.size or i + over[0] == 0:
            break
        a = i + over[0]
        under = np.flatnonzero(v[a:] <= 0.0)
        if not under.size:
            break
        b = a + under[0]
        onset, arrest = _cross(t, v, a, threshold), _cross(t, v, b, 0.0)
        begin, end = np.interp([onset, arrest], t, x)
        found.append((onset, arrest, begin, end, v[a:b].max()))
        i = b
    return Slips(*(np.array(f) for f in zip(*found, strict=True))) if found else Slips(*(np.zeros(0),) * 5)


def _cross(t: np.ndarray, v: np.ndarray, i: int, level: float) -> float:
    return float(t[i - 1] + (t[i] - t[i - 1]) * (level - v[i - 1]) / (v[i] - v[i - 1]))


def order(step: np.ndarray, error: np.ndarray) -> float:
    """Slope of log error against log step."""
    return float(np.polyfit(np.log(step), np.log(error), 1)[0])
