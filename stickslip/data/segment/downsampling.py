"""Shortening a long record: creep and holds log-spaced and averaged, slips and ring-downs at full rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..provenance import Repair
from ..trace import Trace
from .records import Segmentation

Array = NDArray[np.float64]
_FULL = ("nucleation", "slip", "ring-down")


def reduce_trace(trace: Trace, segmentation: Segmentation, *, points: int = 400, margin: float = 0.05) -> Trace:
    """A shorter trace that says the same.

    Slips, nucleation and ring-downs keep every sample, with ``margin`` seconds on both sides. Every other stretch
    becomes at most ``points`` means over windows whose length grows as the logarithm of the time from its ends, so
    that counts are averaged where little happens. Means of time go with means of values. The reduction is entered
    among the trace's repairs.

    Args:
        points: for each stretch of creep.
        margin: s.
    """
    time = trace.time
    full = np.zeros(time.size + 1, np.int8)
    for phase in segmentation.phases:
        if phase.kind in _FULL:
            full[np.searchsorted(time, phase.start - margin)] += 1
            full[np.searchsorted(time, phase.stop + margin, side="right")] -= 1
    keep = np.cumsum(full[:-1]) > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], keep.astype(np.int8), [0]])))
    starts = []
    at = 0
    for a, b in edges.reshape(-1, 2):
        starts += [_log_starts(at, int(a), points), np.arange(a, b)]
        at = int(b)
    starts.append(_log_starts(at, time.size, points))
    first = np.concatenate(starts)
    sizes = np.diff(np.append(first, time.size))

    def mean(values: Array) -> Array:
        return np.add.reduceat(values - values[0], first) / sizes + values[0]

    changed = {name: mean(values) for name, values in trace.channels.items()}
    reason = "stretches without events are means over log-spaced windows"
    note = Repair("reduced", time.size - first.size, f"{time.size} samples to {first.size}", reason)
    return trace.replace(time=mean(time), **changed, repairs=(*trace.repairs, note))


def _log_starts(start: int, stop: int, points: int) -> NDArray[np.intp]:
    """First samples of windows that are short at both ends of a stretch and long in its middle."""
    size = stop - start
    if size <= points:
        return np.arange(start, stop)
    half = size // 2
    steps = np.unique(np.round(np.geomspace(1, half, points // 2)).astype(int))
    left = start + np.concatenate([[0], steps[:-1]])
    right = stop - steps[::-1]
    return np.unique(np.concatenate([left, right]))


def thin(t: Array, y: Array, points: int = 4000) -> tuple[Array, Array]:
    """At most about ``points`` samples that keep every bucket's extremes."""
    if t.size <= points:
        return t, y
    bucket = -(-t.size * 2 // points)
    n = t.size // bucket * bucket
    blocks = y[:n].reshape(-1, bucket)
    start = np.arange(0, n, bucket)
    keep = np.sort(np.concatenate([start + blocks.argmin(1), start + blocks.argmax(1), [0, t.size - 1]]))
    return t[keep], y[keep]
