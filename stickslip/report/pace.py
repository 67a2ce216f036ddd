"""Whether block and drive keep up with each other from slip to slip, as a spring wants it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..segment import Segmentation
from ..trace import Trace
from ..units import shown

_PACED = 4  # slips from which the mean velocity of the block is that of its drive
_WAY = 1000  # points at which a drive is looked at for turning round
_OFF = 1.4  # factor between them beyond which one is wrong
_IMPOSSIBLE = 30.0  # factor beyond which nothing can be made of the two together


@dataclass(frozen=True)
class Pace:
    """Mean velocities from the first slip to the last.

    Attributes:
        block, drive: m/s.
    """

    block: float
    drive: float

    @property
    def off(self) -> bool:
        """Whether no spring allows both."""
        return not 1 / _OFF < self.block / self.drive < _OFF

    @property
    def impossible(self) -> bool:
        """Whether they are so far apart that a unit must be wrong."""
        return not 1 / _IMPOSSIBLE < self.block / self.drive < _IMPOSSIBLE

    def __str__(self) -> str:
        block, drive = shown(self.block, "m/s", 3), shown(self.drive, "m/s", 3)
        return f"from slip to slip the block moves {block}, the drive {drive}; no spring can be stretched for ever"


def pace(trace: Trace, found: Segmentation) -> Pace | None:
    """Velocities of block and drive, or None where there are too few slips, or no displacement, or the drive turns."""
    if trace.drive is None or trace.displacement is None or len(found.events) < _PACED:
        return None
    ends = np.array([found.events[0].t_onset, found.events[-1].t_onset])
    block = float(np.diff(np.interp(ends, trace.time, trace.displacement))[0]) / float(np.ptp(ends))
    way = trace.drive.position(np.linspace(float(ends[0]), float(ends[1]), _WAY))
    drive = float(way[-1] - way[0]) / float(np.ptp(ends))
    turns = np.abs(way[-1] - way[0]) < 0.99 * np.sum(np.abs(np.diff(way)))
    return None if drive == 0 or turns else Pace(block, drive)
