"""One event in three parts, each laid so that those of a run can be compared: creep, slip, ring-down."""

from __future__ import annotations

from ..data.segment import Segmentation
from .overview import Array, Record, reduced

CREEP, SLIP, RING = "creep", "slip", "ring-down"
PARTS = (CREEP, SLIP, RING)
POINTS = 600  # of a part
AFTER = 1.5  # durations of a slip that its ring-down is shown
MARGIN = 0.3  # durations of a slip that are shown before and after it
Curve = tuple[Array, Array]


def part(record: Record, found: Segmentation, number: int, which: str) -> Curve | None:
    """Time (s) and displacement (the record's unit) of a part of an event.

    Creep and slip are laid on the onset, the ring-down on the arrest; displacements are along the slip.

    Args:
        record, found: of the run.
        number: of the event in it, from 0.
        which: one of :data:`PARTS`.

    Returns:
        None where the record does not hold it.
    """
    event = found.events[number]
    first, last = float(record.time[0]), float(record.time[-1])
    before = found.events[number - 1] if number else None
    after = found.events[number + 1].t_onset if number + 1 < len(found.events) else last
    if which == CREEP:
        begin = first if before is None else min(before.t_arrest + AFTER * before.duration, event.t_onset)
        span, at = (begin, event.t_onset), (event.t_onset, event.x_onset)
    elif which == SLIP:
        margin = MARGIN * event.duration
        span, at = (max(event.t_onset - margin, first), event.t_arrest + margin), (event.t_onset, event.x_onset)
    else:
        span, at = (
            (event.t_arrest, min(event.t_arrest + AFTER * event.duration, after)),
            (event.t_arrest, event.x_arrest),
        )
    t, x = reduced(record.time, record.position, *span, points=POINTS)
    if t.size < 2:
        return None
    return t - at[0], (x - at[1]) * (event.direction or 1)
