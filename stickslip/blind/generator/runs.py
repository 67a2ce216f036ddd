"""The runs of a campaign, as they are asked for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Run:
    """One run to be made: a steady ``velocity`` (m/s) until ``events`` slips, or ``pieces`` of (until s, m/s)."""

    name: str
    velocity: float
    events: int = 7
    pieces: tuple[tuple[float, float], ...] = ()


DEFAULT_RUNS = (
    Run("v050", 5e-5),
    Run("v100", 1e-4),
    Run("v200", 2e-4),
    Run("v400", 4e-4),
    Run("holds", 1e-4, pieces=((4.3, 1e-4), (5.3, 0.0), (7.6, 1e-4), (12.6, 0.0), (15.2, 1e-4))),
)
