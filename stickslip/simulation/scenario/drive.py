"""From ``[drive]`` to the load point's motion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...data.drive import Drive
from ...data.readers import read_columns
from ...errors import InputError
from ...system.units import factor_to_si
from .schema import DriveTable

_MOST_STOPS = 10_000


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Drive):
    """The load point's motion.

    Attributes:
        duration: length of the run (s), or None where it ends after so many events.
        stops: times at which the integrator lands (s).
    """

    duration: float | None = None
    stops: tuple[float, ...] = ()

    @property
    def first_velocity(self) -> float:
        """Velocity at the start (m/s)."""
        return float(self.velocities[0])

    @property
    def fastest(self) -> float:
        """The largest speed (m/s)."""
        return float(np.max(np.abs(self.velocities)))


def load_point(table: DriveTable, folder: Path = Path()) -> Motion:
    """The motion a scenario asks for, from time zero and position zero (a sampled drive keeps its own).

    Raises:
        InputError: a file of positions that cannot be used.
    """
    if table.velocity is not None:
        end = table.duration or 1.0
        return Motion(np.array([0.0, end]), np.array([0.0, table.velocity * end]), table.duration, ())
    if table.piece is not None:
        ends = np.cumsum([piece.duration for piece in table.piece])
        drive = Drive.from_pieces(ends, [piece.velocity for piece in table.piece])
    else:
        drive = _sampled(table, folder)
    stops = tuple(map(float, drive.breakpoints)) if drive.breakpoints.size <= _MOST_STOPS else ()
    end = float(drive.times[-1]) if table.duration is None else table.duration
    return Motion(drive.times, drive.positions, end, stops)


def _sampled(table: DriveTable, folder: Path) -> Drive:
    assert table.file is not None and table.position is not None
    path = folder / table.file
    columns = read_columns(path)
    time_name = columns.find(table.time.column, file=path, key="drive.time")
    name = columns.find(table.position.column, file=path, key="drive.position")
    units = [part.unit or columns.units.get(found) for part, found in ((table.time, time_name), (table.position, name))]
    if units[1] is None:
        raise InputError("the unit of the drive's position is not given", file=path, key="drive.position.unit")
    time = columns.data[time_name] * factor_to_si(units[0] or "s", "s", key="drive.time.unit")
    position = columns.data[name] * factor_to_si(units[1], "m", key="drive.position.unit")
    if time.size < 2 or not (np.all(np.isfinite(time)) and np.all(np.isfinite(position))):
        raise InputError("the drive needs two or more samples, all of them finite", file=path)
    if np.any(np.diff(time) <= 0):
        row = int(np.flatnonzero(np.diff(time) <= 0)[0]) + 2
        raise InputError("the times of the drive do not increase", file=path, key=f"row {row}")
    return Drive.from_samples(time - time[0], position - position[0], table.tolerance)
