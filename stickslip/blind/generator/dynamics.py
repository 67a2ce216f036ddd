"""Simulate the rig: block, drive spring and rough contacts, by brute force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.errors import InputError, SolveError

from . import array_layout as S
from .bank import Bank
from .kernel import run
from .lines import Array

MOST_EVENTS = 1000


@dataclass(frozen=True)
class Rig:
    """The block on its contacts (SI). ``loads`` holds the normal force of each contact."""

    mass: float = 0.0894
    spring_stiffness: float = 1000.0
    loads: tuple[float, ...] = (0.31, 0.31, 0.31, 0.31)
    mu_s: float = 0.21
    mu_k: float = 0.1785
    slip_length: float = 1e-6
    heal_time: float = 1e-2
    damping: float = 10.0

    @property
    def capacity(self) -> float:
        """Tangential force at which every spring slides at rest, N."""
        return self.mu_s * sum(self.loads)

    def vector(self) -> Array:
        out = np.zeros(S.RIG_SIZE)
        out[S.MASS], out[S.SPRING], out[S.DAMPING] = self.mass, self.spring_stiffness, self.damping
        out[S.MU_S], out[S.MU_K] = self.mu_s, self.mu_k
        out[S.SLIP_LENGTH], out[S.HEAL_TIME] = self.slip_length, self.heal_time
        return out


@dataclass(frozen=True)
class Drive:
    """A piecewise linear load point: ``positions`` at ``times``, s and m; the last piece goes on for ever."""

    times: tuple[float, ...]
    positions: tuple[float, ...]

    @classmethod
    def constant(cls, velocity: float) -> Drive:
        return cls((0.0, 1.0), (0.0, velocity))

    @classmethod
    def pieces(cls, pieces: list[tuple[float, float]]) -> Drive:
        """From (until, velocity) pairs, s and m/s."""
        times, positions = [0.0], [0.0]
        for until, velocity in pieces:
            positions.append(positions[-1] + velocity * (until - times[-1]))
            times.append(until)
        return cls(tuple(times), tuple(positions))

    def __post_init__(self) -> None:
        if len(self.times) != len(self.positions) or len(self.times) < 2 or np.any(np.diff(self.times) <= 0):
            raise InputError("a drive needs two or more rising times and a position for each", key="drive")

    @property
    def fastest(self) -> float:
        return float(np.abs(np.diff(self.positions) / np.diff(self.times)).max())


@dataclass(frozen=True)
class Result:
    """What happened, sampled at equal times (SI); ``events`` has a row per slip that came to rest.

    ``columns`` holds every recorded quantity by name (``slots.COLUMNS``); ``event_columns`` likewise.
    """

    time: Array
    columns: dict[str, Array]
    event_columns: dict[str, Array]
    steps: int
    quiet_steps: int

    def __getattr__(self, name: str) -> Array:
        columns = self.__dict__.get("columns", {})
        if name in columns:
            return columns[name]
        raise AttributeError(name)

    @property
    def dissipated(self) -> Array:
        """Energy lost in the contacts, J: work done on them less what their springs hold."""
        return self.columns["contact_work"] - self.columns["stored_contact"]

    @property
    def imbalance(self) -> Array:
        """Work put in less everything it became, J; zero but for the step."""
        c = self.columns
        became = c["kinetic"] + c["stored_spring"] + c["contact_work"] + c["viscous"]
        return c["drive_work"] + c["body_work"] - became


def simulate(
    rig: Rig,
    drive: Drive,
    bank: Bank,
    effects: Array | None = None,
    *,
    duration: float,
    dt: float = 1e-5,
    rate: float = 1e4,
    quiet: bool = True,
    new_lines: bool = False,
    relaxation: tuple[float, float] = (0.05, 0.0),
    seed: int = 0,
    stop: tuple[int, float] = (0, 0.0),
) -> Result:
    """Integrate the equation of motion from rest with force-free springs.

    Leapfrog of step ``dt``. With ``quiet``, creep (slower than 0.7 um/s for 8 ms, most springs sticking) is followed
    with implicit steps of 1 ms, which shifts the first event by up to 0.1 ms and the intervals after it by 25 us at
    most, 5 us as a rule (six drawn rigs at 50 and 200 um/s); in one of three further rigs, whose weakening all but
    lets creep run away, the first event at 50 um/s by 0.4 ms and the next interval by 0.2 ms. ``quiet=False`` keeps
    the small step throughout: the reference, whose events move by 2 us between dt = 2e-5 s and 2.5e-6 s.

    Args:
        rig: block, spring and friction.
        drive: of the load point.
        bank: the contact springs; row 0 at the start, the next row after every slip if ``new_lines``.
        effects: amplitudes and inner parameters, shape (slots.EFFECT_SIZE,); None or zeros for none.
        duration: of the motion, s.
        dt: small step, s.
        rate: samples per second of the result.
        quiet: whether creep is followed with long steps, as told above.
        new_lines: whether every slip brings the next row of ``bank``.
        seed: of the relaxing branches.
        stop: (n, share): end after n slips and that share of the last interval, if that comes before ``duration``.
        relaxation: (time, log-normal spread) of the relaxing branches of the springs, s.

    Raises:
        SolveError: the motion diverged (the step is too large for the stiffness).
    """
    eff = np.zeros(S.EFFECT_SIZE) if effects is None else np.asarray(effects, dtype=float)
    rng = np.random.default_rng(seed)
    tau = relaxation[0] * np.exp(relaxation[1] * rng.standard_normal(bank.normal.shape[1]))
    quiet_dt = 1e-3
    for amplitude, frequency in ((S.MOD_EPS, S.MOD_F), (S.VIB_A, S.VIB_F)):
        if eff[amplitude] != 0.0:
            quiet_dt = min(quiet_dt, 1 / (60 * eff[frequency]))
    samples = round(duration * rate) + 1
    record = np.zeros((samples, S.RECORD_SIZE))
    events = np.zeros((MOST_EVENTS, len(S.EVENT_COLUMNS)))
    onset = 2e-4 + 1.5 * drive.fastest
    count, steps, quiet_steps, samples = run(
        rig.vector(), eff, bank.normal, bank.stiffness, bank.count, bank.start, tau,
        np.asarray(drive.times, dtype=float), np.asarray(drive.positions, dtype=float), float(dt), 1 / rate,
        quiet, quiet_dt, new_lines, onset, rng, stop[0], float(stop[1]), record, events,
    )  # fmt: skip
    if count < 0:
        raise SolveError(f"the motion diverged with the step {dt:g} s; take a smaller one")
    count = min(count, MOST_EVENTS)
    columns = {name: record[:samples, i] for i, name in enumerate(S.COLUMNS)}
    event_columns = {name: events[:count, i] for i, name in enumerate(S.EVENT_COLUMNS)}
    return Result(np.arange(samples) / rate, columns, event_columns, steps, quiet_steps)
