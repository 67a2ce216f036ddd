"""Where the windows of the creep and the samples of the fast motion lie in a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...data.segment import Event
from .scales import Scales

Array = NDArray[np.float64]
Index = NDArray[np.intp]
TOWARDS, EVEN = 36, 16  # windows of a stick: spaced as the logarithm of the time to the onset, and evenly
RINGS = 12.0  # periods after an arrest that are followed sample by sample
BEFORE = 8.0  # half-widths of the test function before an onset from where every sample is followed
SHARE = 0.25  # of a stick that the samples of either end may take
HASTE = 5.0  # noise levels that the block moves in a window of the nucleation


def fast_samples(
    events: tuple[Event, ...], e: int, times: Scales, rate: float, n: int, t: Array, h: int
) -> tuple[int, int]:
    """First and last sample around an event that are followed one by one."""
    event = events[e]
    before = event.t_onset - (events[e - 1].t_arrest if e else t[0])
    after = (events[e + 1].t_onset if e + 1 < len(events) else t[-1]) - event.t_arrest
    lead = min((BEFORE + 1.0) * times.half, SHARE * before + times.half)
    ring = RINGS * times.ring if times.ring else 4.0 * times.half
    tail = min(ring + times.half, SHARE * after + times.half, after)
    begin = np.searchsorted(t, event.t_onset - lead)
    end = np.searchsorted(t, event.t_arrest + tail)
    return max(int(begin), 0), min(int(end), n)


def start_of_motion(low: int, high: int, x: Array, count: float, h: int) -> int:
    """First sample from which the block passes a count of the sensor (m) within half a test function (samples).

    Before, what rounding adds goes with the position as slowly as what is sought.
    """
    if not count > 0.0 or high <= low:
        return low
    total = np.cumsum(np.insert(x[low - h : high + h], 0, 0.0))
    mean = (total[h:] - total[:-h]) / h
    slow = np.flatnonzero(np.abs(mean[h:] - mean[:-h]) < count)
    return low + int(slow[-1]) + 1 if slow.size else low


def window_edges(low: int, high: int, onset: int, breaks: Index) -> Index:
    """Edges of the windows between two samples, some evenly and some towards the onset, none shorter than two."""
    if high - low < 4:
        return np.array([low, high])
    left = max(onset - high, 2)
    towards = onset - np.geomspace(max(onset - low, left + 1), left, TOWARDS)
    edges = np.concatenate([towards, np.linspace(low, high, EVEN), breaks[(breaks > low) & (breaks < high)]])
    edges = np.unique(np.clip(np.round(edges), low, high).astype(int))
    keep = [int(edges[0])]
    for edge in edges[1:].tolist():
        if edge - keep[-1] >= 2:
            keep.append(edge)
    keep[-1] = high
    return np.array(keep)


def joined_windows(edges: Index, x: Array, step: float, breaks: Index) -> Index:
    """Windows joined until the block moves by ``step`` (m) from one to the next: less is the sensor's count.

    The mean over a reading that stands still says nothing of where within the count the block is. The drive's
    breakpoints remain.
    """
    if edges.size < 4:
        return edges
    total = np.cumsum(np.insert(x[edges[0] : edges[-1]], 0, 0.0))
    kept = [edges[0]]
    last: float | None = None
    for k in range(1, edges.size):
        a, b = kept[-1] - edges[0], edges[k] - edges[0]
        mean = (total[b] - total[a]) / (b - a)
        if last is None or abs(mean - last) >= step or edges[k] in breaks:
            kept.append(edges[k])
            last = mean
    if kept[-1] != edges[-1]:
        kept[-1] = edges[-1]
    return np.array(kept)


def nucleation_windows(low: int, high: int, speed: Array, noise: float, rate: float, h: int) -> Index:
    """Edges of the windows of the nucleation: so long that the block's way in one stands out of the noise of its mean.

    A reading that goes back by a nanometre of noise unloads every element, as no block in nucleation does.
    """
    edges = [high]
    while edges[-1] > low:
        at = edges[-1]
        slow = max(float(speed[max(at - 1, 0)]), 1e-12)
        length = max(0.08 * (high - at), (HASTE * noise * rate / slow) ** (2.0 / 3.0), 1.0)
        edges.append(max(int(at - min(round(length), h)), low))
    return np.array(edges[::-1])


def knot_samples(begin: int, end: int, event: Event, times: Scales, rate: float, h: int) -> Index:
    """Samples that become knots: all where it rings, some of the slip."""
    fine = max(1, round(times.ring * rate / 24.0)) if times.ring else 1
    coarse = max(fine, h // 6, 1)
    a, b = event.i_onset + 2 * h, event.i_arrest - 2 * h
    if b - a < 4 * coarse:
        return np.arange(begin, end, fine)
    return np.concatenate([np.arange(begin, a, fine), np.arange(a, b, coarse), np.arange(b, end, fine)])
