"""The generator beside the package's model on the very same springs; run as a program it writes the differences.

Each is judged by its own error as well: the generator by half its step, the model by ten times its tolerance.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.blind.generator import Bank as Springs
from stickslip.blind.generator import Drive, Rig, draw_setup, make_bank, simulate
from stickslip.physics.contact import Bank
from stickslip.physics.model import Block, LoadPoint, Model, Weakening
from stickslip.simulation.solve import Tolerance, integrate
from tests.kept_results import keep_table

STEP = 2e-5  # s, the generator's as in campaigns
TIGHT = 1e5  # the model's default tolerance over the one used; its first onset converges with the root of it
SLIPS = 4
SLOW = 1e-6  # m/s: creep is compared up to here, what follows is the slip's beginning and measured by its time


class Motion(NamedTuple):
    """One run by either: slips (s, m), and the creep of every stick phase (m, a row each) at times after its start (s).

    The creep of a later phase is laid on its own beginning, a third over, when the ringing has died out.
    """

    onset: np.ndarray
    duration: np.ndarray
    size: np.ndarray
    creep: np.ndarray
    times: np.ndarray


class Gap(NamedTuple):
    """Largest differences of two runs (s, m)."""

    onset: float
    recurrence: float
    duration: float
    size: float
    creep: float


def gap(a: Motion, b: Motion) -> Gap:
    """How far two runs are apart."""
    recurrence = np.diff(a.onset) - np.diff(b.onset)
    rows = (a.onset - b.onset, recurrence, a.duration - b.duration, a.size - b.size, a.creep - b.creep)
    return Gap(*(float(np.abs(row).max()) for row in rows))


def springs(seed: int) -> tuple[Rig, Springs]:
    """A rig and its gathered springs as campaigns have them."""
    setup = draw_setup(np.random.default_rng(seed))
    return setup.rig, make_bank(setup.surface, np.asarray(setup.rig.loads), seed, groups=setup.groups)


def model(rig: Rig, bank: Springs, velocity: float) -> Model:
    """The package's model on the springs of ``bank``, element by element."""
    used = bank.normal[0] > 0
    return Model(
        Block(rig.mass, rig.spring_stiffness, rig.damping),
        Bank(jnp.asarray(bank.stiffness[0][used]), jnp.asarray(rig.mu_s * bank.normal[0][used])),
        Weakening(rig.mu_k / rig.mu_s, rig.slip_length, rig.heal_time),
        LoadPoint(jnp.array([0.0, 1.0]), jnp.array([0.0, velocity])),
    )


def generated(
    rig: Rig, bank: Springs, velocity: float, dt: float = STEP, *, quiet: bool = False, like: Motion | None = None
) -> Motion:
    """The run by the generator until after its last slip; creep at the times of ``like``."""
    drive = Drive.constant(velocity)
    made = simulate(rig, drive, bank, duration=20.0, dt=dt, rate=4e4, quiet=quiet, stop=(SLIPS, 0.1))
    e = made.event_columns
    onset, arrest, starts = e["onset"], e["arrest"], [0.0, *e["arrest"][:-1]]
    if like is None:
        ends = [made.time[(made.time < stop) & (made.velocity < SLOW)][-1] for stop in onset]
        times = np.array([np.linspace((b - a) / 3, b - a, 2000) for a, b in zip(starts, ends, strict=True)])
    else:
        times = like.times
    at = [np.interp(start + row, made.time, made.displacement) for start, row in zip(starts, times, strict=True)]
    return Motion(onset, arrest - onset, e["arrest_position"] - e["onset_position"], _laid(at), times)


def solved(rig: Rig, bank: Springs, velocity: float, like: Motion, tighter: float = TIGHT) -> Motion:
    """The run by the model and the solver of the package, as long as ``like``."""
    end = float(like.onset[-1] + like.duration[-1]) + 0.02
    default = Tolerance()
    tolerance = Tolerance(*(float(x) / tighter for x in (default.relative, default.displacement, default.velocity)))
    trajectory, _ = integrate(model(rig, bank, velocity), end, tolerance=tolerance)
    t, x, v = (np.asarray(a) for a in (trajectory.steps.t, trajectory.steps.x, trajectory.steps.v))
    found, threshold, i = [], 2e-4 + 1.5 * velocity, 0  # the generator's own threshold
    while (v[i:] > threshold).any():
        i += int(np.argmax(v[i:] > threshold))
        j = i + int(np.argmax(v[i:] <= 0.0))
        found.append((_crossing(t, v, i, threshold), _crossing(t, v, j, 0.0)))
        i = j
    onset, arrest = np.array(found).T
    at = [np.asarray(trajectory.at(start + row).x) for start, row in zip([0.0, *arrest[:-1]], like.times, strict=True)]
    return Motion(onset, arrest - onset, np.interp(arrest, t, x) - np.interp(onset, t, x), _laid(at), like.times)


def _crossing(t: np.ndarray, v: np.ndarray, i: int, level: float) -> float:
    return float(t[i - 1] + (t[i] - t[i - 1]) * (level - v[i - 1]) / (v[i] - v[i - 1]))


def _laid(creep: list[np.ndarray]) -> np.ndarray:
    return np.array([creep[0], *(row - row[: row.size // 4].mean() for row in creep[1:])])


class Compared(NamedTuple):
    """The generator against the model, what halving its step and ten times the tolerance change, and its long steps."""

    made: Motion
    apart: Gap
    halved: Gap
    tenfold: Gap
    quiet: Gap


def compare(seed: int, velocity: float) -> Compared:
    """Both on the springs of ``seed``."""
    rig, bank = springs(seed)
    made = generated(rig, bank, velocity)
    exact = solved(rig, bank, velocity, made)
    return Compared(
        made,
        gap(made, exact),
        gap(made, generated(rig, bank, velocity, STEP / 2, like=made)),
        gap(exact, solved(rig, bank, velocity, made, TIGHT / 10)),
        gap(made, generated(rig, bank, velocity, quiet=True, like=made)),
    )


def main() -> None:
    """The largest differences over the slips of three rigs at two velocities each, for the page on the challenge."""
    rows = []
    for seed in (3, 4, 5):
        for velocity in (5e-5, 4e-4):
            both = compare(seed, velocity)
            for text, g in (
                ("generator and package", both.apart),
                ("generator, step halved", both.halved),
                ("package, ten times the tolerance", both.tenfold),
                ("generator, long steps in creep", both.quiet),
            ):
                sizes = g.onset * 1e6, g.recurrence * 1e6, g.duration * 1e6, g.size * 1e9, g.creep * 1e9
                cells = ("< 0.001" if size < 1e-3 else f"{float(f'{size:.2g}'):g}" for size in sizes)
                rows.append([f"{seed}, {velocity * 1e6:g} µm/s", text, *cells])
    columns = [
        "rig, velocity", "difference between", "onset, µs", "recurrence, µs", "slip's duration, µs", "slip, nm",
        "creep, nm",
    ]  # fmt: skip
    keep_table("figures", "python -m tests.challenge.same_springs", "same springs", columns, rows)


if __name__ == "__main__":
    main()
