"""From a campaign's entry to a `Trace`: units applied, faults mended and counted, the drive built."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...system.runstore import file_record
from ...system.units import factor_to_si
from ..channels import SIGNALS
from ..drive import Drive
from ..provenance import Provenance, Repair
from ..readers import Columns, read_columns, repair
from ..resolution import estimate_resolution, noise_level
from ..trace import Trace
from .load import Campaign, trace_file
from .models import CHANNELS, Channel, TimeColumn, TraceEntry
from .plausible import check_size, check_travel, doubtful_resolution

Array = NDArray[np.float64]


def load_traces(campaign: Campaign) -> list[Trace]:
    """Read the traces of a campaign, in its order.

    Raises:
        InputError: a file cannot be read, a column is not there, time does not increase, the block outruns the drive.
    """
    return [load_trace(campaign, entry) for entry in campaign.entries]


def load_trace(campaign: Campaign, entry: TraceEntry) -> Trace:
    """Read one trace (see `load_traces`)."""
    return _Assembly(campaign, entry).trace()


class _Assembly:
    def __init__(self, campaign: Campaign, entry: TraceEntry) -> None:
        self.campaign, self.entry = campaign, entry
        self.place = f"trace[{campaign.entries.index(entry) + 1}]"
        self.repairs: list[Repair] = []
        self.notes: list[str] = []
        self.warnings: list[str] = []
        self.used: dict[str, str] = {}

    def trace(self) -> Trace:
        try:
            return self._trace()
        except InputError as error:
            raise self._placed(error) from None

    def _placed(self, error: InputError) -> InputError:
        placed = error.at(file=self.campaign.path, key=f"{self.place} ('{self.entry.label}')")
        noticed = "check first what was noted while reading: " + "; ".join(self.warnings)
        return placed.with_hint(noticed) if self.warnings else placed

    def _trace(self) -> Trace:
        entry = self.entry
        path, beyond = trace_file(self.campaign.path, entry.file, outside=entry.outside, key=f"{self.place}.file")
        if beyond:
            self.notes.append("outside the campaign folder")
        columns = read_columns(path, entry.reader)
        reader = columns.reader
        self.notes += _noted(columns)
        channels = {name: getattr(entry, name) for name in CHANNELS if getattr(entry, name) is not None}
        time = self._time(columns, path)
        data = {name: self._values(columns, path, name, spec, time) for name, spec in channels.items()}
        first_line = columns.first_line
        del columns
        self._check_order(time, path, first_line)
        time, data = self._rows(time, data)
        check_size(time, data)
        resolution, noise = self._mend(time, data, channels)
        drive = self._drive(time, data, resolution, noise)
        leading = next(name for name in SIGNALS if name in data)
        rig = self.campaign.rig_of(entry.label)
        stiffness = rig.spring_stiffness if isinstance(rig.spring_stiffness, float) else None
        gaps, _ = repair.find_gaps(time)
        for array in (time, *data.values()):
            array.flags.writeable = False
        trace = Trace(
            entry.label,
            time,
            **data,  # type: ignore[arg-type]
            drive=drive,
            resolution=resolution[leading],
            noise=noise[leading],
            walk=entry.displacement.walk if entry.displacement is not None else 0.0,
            hum=entry.displacement.hum if entry.displacement is not None else 0.0,
            spring_stiffness=stiffness,
            virgin=entry.virgin,
            role=entry.role or "",
            minimum_slip=entry.minimum_slip,
            missing=tuple(float(moment) for moment in gaps),
            repairs=tuple(self.repairs),
            provenance=Provenance(entry.file, file_record(path)["sha256"], reader, self.used, tuple(self.notes)),
        )
        self.warnings += check_travel(trace, rig, getattr(entry, leading).unit, f"{self.place}.{leading}")
        return repair.from_load_point(trace).replace(warnings=tuple(self.warnings))

    def _time(self, columns: Columns, path: Path) -> Array:
        entry = self.entry
        if entry.time is None:
            assert entry.sampling_rate is not None  # one of the two, by the model's check
            size = self._size(columns)
            self.used["time"] = f"sampling rate {entry.sampling_rate:g} Hz"
            return np.arange(size) / entry.sampling_rate
        try:
            return self._scaled(columns, path, "time", entry.time)
        except InputError as error:
            if error.hint is None or "sampling_rate" not in error.hint:
                hint = f"{error.hint or ''}; or give 'sampling_rate' in place of 'time'".lstrip("; ")
                raise error.but(hint=hint) from None
            raise

    def _size(self, columns: Columns) -> int:
        """Samples of the first channel that is in this file; which other arrays are there does not matter."""
        for name in CHANNELS:
            spec = getattr(self.entry, name)
            if spec is not None and spec.file is None:
                with suppress(InputError):  # a column that is not there is met with its key later
                    return columns.data[columns.find(spec.column)].size
        return next(iter(columns.data.values())).size

    def _scaled(self, columns: Columns, path: Path, name: str, spec: TimeColumn | Channel) -> Array:
        """A column in SI."""
        key = f"{self.place}.{name}"
        try:
            column = columns.find(spec.column)
        except InputError as error:
            what = f"{error.what} in {path.name}"
            raise error.but(what=what, file=self.campaign.path, key=f"{key}.column") from None
        stated = columns.units.get(column)
        factor = spec.factor
        if factor is None:
            if stated is None:
                raise InputError(
                    f"the unit of column '{column}' is missing",
                    file=self.campaign.path,
                    key=f"{key}.unit",
                    allowed=f"a unit of {spec.si}",
                    hint=f'the header of {path.name} does not give it either: write  unit = "..."',
                )
            factor = factor_to_si(
                stated, spec.si, key=f"{key} (unit in the header of {path.name})", file=self.campaign.path
            )
        elif stated is not None:
            self._compare(name, column, spec, factor, stated)
        self.used[name] = f"'{column}' [{spec.unit or stated}]"
        values = columns.data[column]
        if factor == 1.0:
            return values
        with np.errstate(invalid="ignore", over="ignore"):  # what is no finite number is met later
            return values * factor

    def _compare(self, name: str, column: str, spec: TimeColumn | Channel, factor: float, stated: str) -> None:
        try:
            other = factor_to_si(stated, spec.si)
        except InputError:
            return
        if abs(other) != abs(factor):
            self.warnings.append(
                f"{name}: the file says column '{column}' is in {stated}, the campaign says {spec.unit}; "
                "the campaign was followed"
            )

    def _values(self, columns: Columns, path: Path, name: str, spec: Channel, time: Array) -> Array:
        if spec.file is None:
            values = self._scaled(columns, path, name, spec)
            if values.size != time.size:
                what = f"column '{spec.column}' has {values.size} samples, time has {time.size}"
                hint = "columns of one trace need one common time"
                raise InputError(what, file=self.campaign.path, key=f"{self.place}.{name}", hint=hint)
            return values
        other, beyond = trace_file(
            self.campaign.path, spec.file, outside=self.entry.outside, key=f"{self.place}.{name}.file"
        )
        if beyond:
            self.notes.append(f"{name}: outside the campaign folder")
        if spec.time is None and self.entry.time is None:
            raise InputError("a channel of another file needs its own 'time'", key=f"{self.place}.{name}.time")
        further = read_columns(other, spec.reader)
        self.notes += [f"{spec.file}: {note}" for note in _noted(further)]
        own = self._scaled(further, other, f"{name}.time", spec.time or self.entry.time)  # type: ignore[arg-type]
        values = self._scaled(further, other, name, spec)
        self.used[name] += f" of {spec.file} (sha256 {file_record(other)['sha256']})"
        return self._onto(time, own, values, name)

    def _onto(self, time: Array, own: Array, values: Array, name: str) -> Array:
        """Values of another file at this record's times; NaN where that file has none."""
        self._check_order(own, None, None, name)
        result = np.interp(time, own, values, left=np.nan, right=np.nan)
        if own.size != time.size or not np.array_equal(own, time):
            reason = "taken from another file with other times, interpolated linearly"
            self.repairs.append(Repair("resampled", time.size, name, reason))
        return result

    def _check_order(self, time: Array, path: Path | None, first_line: int | None, name: str = "time") -> None:
        back = time[1:] < time[:-1]
        if not back.any():
            return
        row = int(np.argmax(back)) + 1
        where = f"line {first_line + row} or near it" if first_line else f"sample {row}"
        raise InputError(
            f"time does not increase: {time[row - 1]:.9g} s is followed by {time[row]:.9g} s "
            f"({name}, {int(back.sum())} such places)",
            file=path or self.campaign.path,
            key=where,
            hint="cut the file there, name another time column, or give 'sampling_rate' in place of 'time'",
        )

    def _rows(self, time: Array, data: dict[str, Array]) -> tuple[Array, dict[str, Array]]:
        """Rows that can be used, in the part that is asked for."""
        entry = self.entry
        keep, lost = repair.drop_nan(time, data)
        self.repairs += lost
        twice = "; those left out because they are not a number are among them" if lost else ""
        if keep is not None:
            time, data = time[keep], {name: values[keep] for name, values in data.items()}
        if time.size < 2:
            raise self._empty(data, lost)
        time, clock = repair.correct_clock(time, entry.clock_error)
        self.repairs += clock
        keep, double = repair.drop_duplicates(time)
        self.repairs += double
        if keep is not None:
            time, data = time[keep], {name: values[keep] for name, values in data.items()}
        if entry.start is not None or entry.stop is not None:
            low = 0 if entry.start is None else int(np.searchsorted(time, entry.start))
            high = time.size if entry.stop is None else int(np.searchsorted(time, entry.stop, side="right"))
            if high - low < 2:
                raise InputError(
                    "no samples between 'start' and 'stop'", allowed=f"{time[0]:.6g} s to {time[-1]:.6g} s"
                )
            cut = time.size - (high - low)
            if cut:
                self.repairs.append(Repair("cut", cut, "all channels", "outside 'start' and 'stop', as asked for"))
            time, data = time[low:high].copy(), {name: values[low:high].copy() for name, values in data.items()}
        self.repairs += [replace(gap, reason=f"{gap.reason}{twice}") for gap in repair.find_gaps(time)[1]]
        return time, data

    def _empty(self, data: dict[str, Array], lost: list[Repair]) -> InputError:
        """What to say where no row has all its values."""
        blank = [name for name, values in data.items() if not np.isfinite(values).any()]
        named = ", ".join(f"{name} (column '{getattr(self.entry, name).column}')" for name in blank)
        what = f"{named} holds no number at all" if blank else "fewer than two samples can be used"
        seen = "; ".join(f"{r.count} of {r.where.split(',')[0]} are not a number" for r in lost)
        key = f"{self.place}.{blank[0]}" if blank else self.place
        hint = f"is it the right column? {seen}".strip()
        return InputError(f"{what} in {self.entry.file}", file=self.campaign.path, key=key, hint=hint)

    def _mend(
        self, time: Array, data: dict[str, Array], channels: dict[str, Channel]
    ) -> tuple[dict[str, float | None], dict[str, float]]:
        """Wraps, resets and spikes of every channel (in place in ``data``); resolution and noise of each."""
        resolution: dict[str, float | None] = {}
        noise: dict[str, float] = {}
        for name, spec in channels.items():
            values = data[name]
            count = spec.resolution if spec.resolution is not None else estimate_resolution(values)
            if spec.resolution is not None:
                seen, scatter = estimate_resolution(values), noise_level(values)
                if odd := doubtful_resolution(name, spec.si, spec.resolution, seen, scatter):
                    self.warnings.append(odd)
            if spec.wrap is not None:
                values, done = repair.unwrap(values, spec.wrap, name, count)
                self.repairs += done
                if not done:
                    self.notes.append(f"{name}: no jump of half of 'wrap', so nothing was unwrapped")
            level = noise_level(values, count)
            values, done = repair.join_resets(time, values, name, self._within(spec.resets), count, level)
            self.repairs += done
            if spec.resets is True and not done:
                self.notes.append(f"{name}: 'resets' is true, and the counter never jumps to zero")
            if self.entry.spikes:
                values, done = repair.despike(values, name, time, max(level, count or 0.0))
                self.repairs += done
            data[name], resolution[name], noise[name] = values, count, level
        return resolution, noise

    def _within(self, resets: Sequence[float] | bool) -> Sequence[float] | bool:
        """Those that are not cut off with the rest of the record."""
        if isinstance(resets, bool):
            return resets
        start, stop = self.entry.start, self.entry.stop
        return [t for t in resets if (start is None or t > start) and (stop is None or t <= stop)]

    def _drive(
        self, time: Array, data: dict[str, Array], resolution: dict[str, float | None], noise: dict[str, float]
    ) -> Drive | None:
        entry = self.entry
        if entry.drive_velocity is not None:
            return Drive.constant(entry.drive_velocity, float(time[0]), float(time[-1]))
        if entry.drive is not None:
            ends = np.array([piece.until for piece in entry.drive])
            speeds = np.array([piece.velocity for piece in entry.drive])
            if ends[-1] <= time[0]:
                what = f"the drive ends at {ends[-1]:g} s, before the record begins at {time[0]:g} s"
                raise InputError(what, hint="'until' is a time of the record, as in its time column")
            late = ends > time[0]
            return Drive.from_pieces(ends[late], speeds[late], float(time[0]))
        if "drive_position" in data:
            position = data["drive_position"]
            return Drive.sampled(time, position, resolution["drive_position"] or 0.0, noise["drive_position"])
        return None


def _noted(columns: Columns, most: int = 8) -> list[str]:
    """What the reader guessed or mended, and the columns it left out."""
    left = [f"column '{name}' is left out: {why}" for name, why in columns.ignored.items()]
    return [*columns.notes, *left[:most], *([f"... and {len(left) - most} columns more"] if len(left) > most else [])]
