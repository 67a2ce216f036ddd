"""The solver beside the brute-force simulation: what the tests assert and docs/verification draws."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stickslip.physics.contact import (
    Bank,
    Indentation,
    RoughLines,
    bank_from_contact,
    equal_bodies,
    from_heights,
    indentation,
    static_contact,
)
from stickslip.simulation.solve import Tolerance

from . import brute_force
from .rig import MASS, Slips, rig, slips
from .slip_events import Run, run

LENGTH, FRICTION, LOAD = 20e-6, 0.21, 0.31  # m, 1, N on each of four contacts


class Pair(NamedTuple):
    """The same rig by both; ``reference`` are the slips of the path by brute force."""

    path: brute_force.Path
    reference: Slips
    made: Run


def rough_contact(lines: int, n_springs: int, hurst: float, h_rms: float, bins: int, seed: int = 3) -> tuple:
    """Springs (stiffness, cap) of all lines one by one, and the model's bank of ``bins`` elements on the same heights.

    The total load is always that of four contacts.
    """
    heights = np.asarray(RoughLines(hurst, h_rms, lines=lines, n_springs=n_springs, seed=seed).heights)
    moduli = equal_bodies()
    load = 4.0 * LOAD / lines
    each = [
        brute_force.springs(
            h.max() - h, LENGTH / n_springs, load, FRICTION, float(moduli.normal), float(moduli.tangential)
        )
        for h in heights
    ]
    table: Indentation = indentation(from_heights(heights, LENGTH / n_springs))
    binned = bank_from_contact(static_contact(table, load, FRICTION), bins)
    return np.concatenate([k for k, _ in each]), np.concatenate([c for _, c in each]), binned


def pair(
    stiffness: np.ndarray, cap: np.ndarray, bank: Bank, duration: float, tolerance: Tolerance, dt: float = 1e-6
) -> Pair:
    """Both at the default drive, from a virgin contact at rest."""
    path = brute_force.simulate(
        stiffness, cap, duration=duration, mass=MASS, spring_stiffness=1000.0, damping=10.0, ratio=0.85,
        slip_distance=1e-6, healing_time=0.02, times=[0.0, 1.0], positions=[0.0, 5e-5], dt=dt,
    )  # fmt: skip
    return Pair(path, slips(*path), run(rig(springs=bank), duration, tolerance))


def creep_gaps(pair: Pair, speed: float = 1e-6) -> list[tuple[np.ndarray, np.ndarray]]:
    """For every stick phase: time since its start (s), and by how much the creep curves differ (m).

    A later phase begins at its arrest, and its curves are laid on each other where the block has come to rest. A phase
    ends where creep is last as slow as ``speed`` (m/s): what follows is the slip's beginning, measured by its time.
    """
    path, trajectory = pair.path, pair.made.trajectory
    gaps = []
    for i, onset in enumerate(pair.reference.onset):
        start = pair.reference.arrest[i - 1] if i else 0.0
        own = pair.made.events.arrest[i - 1] if i else 0.0
        slow = path.t[(path.t < onset) & (path.v < speed)][-1]
        t = np.linspace(0.0, slow - start, 4000)
        gap = trajectory.at(own + t).x - np.interp(start + t, path.t, path.x)
        settled = (t > 0.2 * t[-1]) & (t < 0.4 * t[-1])
        gaps.append((t, gap - (gap[settled].mean() if i else 0.0)))
    return gaps
