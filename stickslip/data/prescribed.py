"""Runs whose motion is prescribed and whose force is measured: loops, ramps, steps of velocity."""

from __future__ import annotations

from .drive import Drive
from .segment import Segmentation
from .trace import Trace


def prescribed(trace: Trace, found: Segmentation) -> bool:
    """Whether a force was measured beside a motion that it says nothing of.

    With a drive and slips it is the spring's, and says where the block is.
    """
    if trace.spring_force is None:
        return False
    moved = trace.displacement is not None or trace.velocity is not None
    return moved if trace.drive is None else not found.events


def with_motion(trace: Trace) -> Trace:
    """The trace with its motion both as displacement and as drive."""
    x = trace.displacement
    if x is None:
        x = trace.drive_position
    if x is None:
        assert trace.drive is not None
        x = trace.drive.position(trace.time)
    drive = Drive.sampled(trace.time, x, trace.resolution or 0.0) if trace.drive is None else trace.drive
    return trace.replace(displacement=x, drive=drive)
