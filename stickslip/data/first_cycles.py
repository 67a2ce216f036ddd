"""Long records by their first cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .segment import Segmentation
from .trace import Trace


def first_cycles(trace: Trace, found: Segmentation, most: int) -> tuple[Trace, Segmentation]:
    """A run up to the middle of the stick after its first ``most`` slips; as it is where it has no more."""
    events = found.events
    if len(events) <= most:
        return trace, found
    middle = 0.5 * (events[most - 1].t_arrest + events[most].t_onset)
    return trace.between(stop=middle), replace(found, events=events[:most])


def shares(counts: Sequence[int], most: int) -> list[int]:
    """How many of ``most`` each gets who asks for ``counts``: what the modest leave is shared by the others."""
    out, left = [0] * len(counts), most
    for done, i in enumerate(sorted(range(len(counts)), key=lambda i: counts[i])):
        out[i] = min(counts[i], left // (len(counts) - done))
        left -= out[i]
    return out
