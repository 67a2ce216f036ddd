"""What is drawn of a run however long it is: its signals, and as many samples of them as a screen shows."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from tsdownsample import MinMaxDownsampler, MinMaxLTTBDownsampler

from ..data.segment import Segmentation, block_motion
from ..data.trace import Trace

Array = NDArray[np.float64]
POINTS = 3000  # that are sent of a curve
AROUND = 0.5  # of the window that are sent to either side of it, so that a pan shows no gap before the answer comes
COARSER = 8  # by which each level of a long curve has fewer samples than the one before
FINER = 1.6  # by which the window may shrink before the curve is sent anew
DISPLACEMENT, FORCE, GAP = "displacement", "spring force", "load point - block"


class Levels:
    """A curve at several finenesses, each with all extremes of the one before, so that a long one is quick to reduce.

    Args:
        time: s, shape (n,), increasing.
        values: shape (n,).
    """

    def __init__(self, time: Array, values: Array) -> None:
        self.time, self.values = time, values
        self._levels = [(time, values)]
        while self._levels[-1][0].size > COARSER * COARSER * POINTS:
            t, y = self._levels[-1]
            kept = MinMaxDownsampler().downsample(y, n_out=y.size // COARSER // 2 * 2).astype(np.intp)
            kept = np.unique(np.concatenate([kept, [0, y.size - 1]]))
            self._levels.append((t[kept], y[kept]))

    def times(self, factor: float) -> Levels:
        """The same curve in another unit."""
        out = object.__new__(Levels)
        out._levels = [(t, factor * y) for t, y in self._levels]
        out.time, out.values = out._levels[0]
        return out

    def __call__(self, low: float, high: float, points: int = POINTS) -> tuple[Array, Array]:
        """At most about so many samples between two times (s); see :func:`reduced`."""
        for t, y in reversed(self._levels):
            own = cut(t, low, high)
            if own.stop - own.start >= COARSER * points:
                return reduced(t, y, low, high, points)
        return reduced(self.time, self.values, low, high, points)


@dataclass(frozen=True, eq=False)
class Record:
    """The signals of a run that are drawn.

    Attributes:
        time: s, shape (n,).
        curves: name -> curve and unit of its values.
        position: of the block, as events were found in it.
        unit: of ``position``.
    """

    time: Array
    curves: dict[str, tuple[Levels, str]]
    position: Array
    unit: str

    @property
    def span(self) -> tuple[float, float]:
        """Its begin and end (s)."""
        return float(self.time[0]), float(self.time[-1])


_records: WeakKeyDictionary[Trace, Record] = WeakKeyDictionary()


def record(trace: Trace, found: Segmentation) -> Record:
    """The signals of a run; made once.

    Args:
        trace: the run.
        found: its events.
    """
    if trace not in _records:
        _records[trace] = _record(trace, found)
    return _records[trace]


def _record(trace: Trace, found: Segmentation) -> Record:
    position, drive, _, unit = block_motion(trace, gain=found.settings.gain)
    position = np.ascontiguousarray(position, float)
    time = np.ascontiguousarray(trace.time)
    curves = {DISPLACEMENT: (Levels(time, position - position[0]), unit)}
    if trace.spring_force is not None:
        curves[FORCE] = (Levels(time, np.ascontiguousarray(trace.spring_force)), "N")
    if drive is not None and trace.drive is not None and unit == "m":
        gap = drive.position(trace.time) - position
        curves[GAP] = (Levels(time, np.ascontiguousarray(gap - gap[0])), "m")
    return Record(time, curves, position, unit)


def cut(time: Array, low: float, high: float) -> slice:
    """The samples between two times, and one more at either side."""
    first = max(int(np.searchsorted(time, low)) - 1, 0)
    return slice(first, min(int(np.searchsorted(time, high, side="right")) + 1, time.size))


def reduced(time: Array, values: Array, low: float, high: float, points: int = POINTS) -> tuple[Array, Array]:
    """At most about so many samples between two times, which look like all of them and have their extremes.

    Args:
        time: s, shape (n,), increasing.
        values: shape (n,).
        low, high: s.
        points: how many.
    """
    own = cut(time, low, high)
    t, y = time[own], values[own]
    if y.size <= points:
        return t, y
    kept = MinMaxLTTBDownsampler().downsample(y, n_out=points).astype(np.intp)
    kept = np.unique(np.concatenate([kept, [int(y.argmin()), int(y.argmax()), 0, y.size - 1]]))
    return t[kept], y[kept]


class Window:
    """The part of a record that a browser has been sent, and whether it still serves what is looked at.

    Args:
        whole: begin and end of the record (s).
    """

    def __init__(self, whole: tuple[float, float]) -> None:
        self._whole, self.sent = whole, (0.0, 0.0)

    def needed(self, low: float, high: float) -> tuple[float, float] | None:
        """What is to be sent now, or None where what was sent is fine enough.

        Args:
            low, high: ends of what is looked at (s).
        """
        width = high - low
        if not width > 0.0:
            return None
        begin, end = self._whole
        inside = self.sent[0] <= max(low, begin) and self.sent[1] >= min(high, end)
        full = min(end, high + AROUND * width) - max(begin, low - AROUND * width)
        if inside and self.sent[1] - self.sent[0] <= FINER * full:
            return None
        self.sent = (max(begin, low - AROUND * width), min(end, high + AROUND * width))
        return self.sent if self.sent[1] > self.sent[0] else None


def events_of(found: Segmentation, most: int) -> list[int]:
    """Numbers of at most so many events of a run, evenly through it."""
    count = len(found.events)
    if count <= most:
        return list(range(count))
    return sorted({int(i) for i in np.linspace(0, count - 1, most).round()})
