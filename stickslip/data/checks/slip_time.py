"""Whether the slips last as long as the mass and the spring want it: a mass in grams is found so."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...system.units import shown
from ..campaign import Campaign
from ..segment import Segmentation
from ..trace import Trace
from .finding import Finding

_FEW = 4  # slips from which their time is known
_WINDOWS = 5  # of the estimator (and samples) in a slip, from which its time is that of the block
_SHORTER, _LONGER = 4.0, 12.0  # factors on half a period; strong damping makes a slip last up to ten times as long


def slip_time(trace: Trace, found: Segmentation) -> float | None:
    """How long the slips of a record last (s, median), or None where it has too few or resolves them too poorly."""
    times = [event.duration for event in found.events]
    shortest = _WINDOWS * max(float(np.median(np.diff(trace.time))), found.settings.window)
    return float(np.median(times)) if len(times) >= _FEW and np.median(times) >= shortest else None


def at_odds(times: Sequence[float], mass: float, stiffness: float) -> str | None:
    """A sentence about slips that last far longer or shorter than half a period of the block on its spring, or None.

    Args:
        times: that slips last, of every record (s).
        mass: of the block (kg).
        stiffness: of the driving spring (N/m).
    """
    expected = float(np.pi * np.sqrt(mass / stiffness))
    seen = float(np.median(times))
    if 1 / _SHORTER < seen / expected < _LONGER:
        return None
    wanted = stiffness * (seen / np.pi) ** 2
    return (
        f"slips last {shown(seen, 's', 2)}, half a period of {shown(mass, 'kg', 3)} on {shown(stiffness, 'N/m', 3)} "
        f"is {shown(expected, 's', 2)}; on that spring a block of {shown(wanted, 'kg', 2)} would slip so"
    )


def mass_findings(campaign: Campaign, traces: Sequence[Trace], found: Sequence[Segmentation]) -> list[Finding]:
    """A finding for each mass and spring, where both are known, that do not go with how long slips on them last."""
    seen: dict[tuple[float, float], dict[str, float]] = {}
    for trace, events in zip(traces, found, strict=True):
        rig, lasts = campaign.rig_of(trace.name), slip_time(trace, events)
        if lasts is not None and isinstance(rig.mass, float) and isinstance(rig.spring_stiffness, float):
            seen.setdefault((rig.mass, rig.spring_stiffness), {})[trace.name] = lasts
    out = []
    for (mass, stiffness), slips in seen.items():
        times = list(slips.values())
        text = at_odds(times, mass, stiffness)
        if text:
            wanted = stiffness * (float(np.median(times)) / np.pi) ** 2
            sentence = f"{', '.join(slips)}: {text}: check mass and stiffness, and the units, also that of time."
            run = next(iter(slips)) if len(slips) == 1 and len(traces) > 1 else None
            # damping makes a slip last longer by a factor that nobody knows
            out.append(Finding("mass and spring", run, mass, wanted, wanted * np.log(_LONGER), "kg", sentence))
    return out
