"""The measured motion of a run, thinned to knots: windows where the block creeps, samples where it is fast.

Beside the knots stands what turns forces at the knots into the numbers that are compared: at a window the force
itself, where the block is fast its mean under a smooth test function. The acceleration under the same test function is
the test function's second derivative applied to the displacement (the weak form), so nothing is differentiated and the
kinks of onset and arrest are no trouble.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import isotonic_regression
from scipy.signal import savgol_filter
from scipy.sparse import coo_array, csr_array

from ..segment import Event, Segmentation
from ..trace import Trace
from .along import turning

Array = NDArray[np.float64]
Index = NDArray[np.intp]

CREEP, NUCLEATION, SLIP, RING = range(4)
PHASES = ("creep", "nucleation", "slip", "ring-down")
POINTS = ("at", "phase", "of", "rate", "acceleration", "place", "elapsed")
TOWARDS, EVEN = 36, 16  # windows of a stick: spaced as the logarithm of the time to the onset, and evenly
RINGS = 12.0  # periods after an arrest that are followed sample by sample
BEFORE = 8.0  # half-widths of the test function before an onset from where every sample is followed
SHARE = 0.25  # of a stick that the samples of either end may take
UNSTEADY = 4.0  # levels of slow noise by which two windows must differ
BACK = 5.0  # noise levels of one sample within which a step back is noise
HASTE = 5.0  # noise levels that the block moves in a window of the nucleation
HALF = 3.0  # samples, the least half-width of the test function
COARSE = 0.15  # of a slip, the largest half-width that still resolves its inertia
HUM = 50.0  # Hz, the mains


@dataclass(frozen=True)
class Scales:
    """Times that decide how a run is thinned, of the data themselves.

    Attributes:
        half: half-width of the test function (s).
        ring: period of the ringing after an arrest (s); 0 where none is heard.
        slip: usual duration of a slip (s).
    """

    half: float
    ring: float
    slip: float


@dataclass(frozen=True)
class Knots:
    """One run at its knots, shape (n,), and the points that are compared, shape (p,).

    Attributes:
        name: of the run.
        t, x, v: time (s), reading (m) and its rate (m/s) at the knots.
        drive: load point (m).
        turn: from the knot before to a turning point in between (m), where every sample counts.
        event: number of the event whose stick and onset a knot belongs to; it changes in the middle of a slip, where
            all elements slide and nothing is remembered.
        arrest: number of the event that a knot's stick leads to, counted from the arrest before; -1 in the later half
            of a slip and before the first arrest.
        mean: (p, n) from forces at the knots to forces at the points.
        smooth: (p, n) the same for the test function's first and second derivative: rate and acceleration of what is
            given at the knots; empty rows at windows.
        at: time of the points (s).
        phase: of the points, an index of PHASES.
        of: event of the points.
        rate, acceleration: of the reading at the points, under the test function (m/s, m/s2).
        reading: (n, N) from the samples of the reading to the displacement at the knots.
        moving: (p, N) from the samples to rate and acceleration at the points.
        place: coordinate along which misfits are alike, one unit apart little (1).
        elapsed: time since the arrest before, or the start (s).
        noise: standard deviation of one sample (m).
        stiffness: of the driving spring, where this run has its own (N/m).
        virgin: whether the contact is force-free at the start.
    """

    name: str
    t: Array
    x: Array
    v: Array
    drive: Array
    turn: Array
    event: Index
    arrest: Index
    mean: csr_array
    smooth: tuple[csr_array, csr_array]
    at: Array
    phase: Index
    of: Index
    rate: Array
    acceleration: Array
    reading: csr_array
    moving: tuple[csr_array, csr_array]
    place: Array
    elapsed: Array
    noise: float
    stiffness: float | None
    virgin: bool

    @property
    def events(self) -> int:
        """Number of events."""
        return int(self.of.max(initial=-1)) + 1


def scales(segmentations: list[Segmentation], ring: float | None, rate: float) -> Scales:
    """The times of a campaign: medians over its slips, and the period of the ringing (s) where one is heard."""
    slip = float(np.median([e.duration for s in segmentations for e in s.events]))
    half = min(ring, slip / 8.0) if ring else slip / 12.0
    return Scales(max(half, HALF / rate), ring or 0.0, slip)


def too_coarse(times: Scales, rate: float) -> str | None:
    """A sentence where samples lie too far apart for the inertia of a slip (sampling rate in Hz), else None."""
    if times.half <= COARSE * times.slip:
        return None
    return (
        f"sampling at {rate:.4g} Hz is too coarse for inertia: the acceleration is a mean over {2e3 * times.half:.3g} "
        f"ms of a slip of {1e3 * times.slip:.3g} ms, so mass, damping and what acts within a slip are told badly; "
        f"{HALF / (COARSE * times.slip):.3g} Hz would do"
    )


def kernels(half: float, rate: float) -> tuple[Array, Array, Array]:
    """The test function (1 - u^2)^5 and its derivatives as weights of samples, shape (2 h + 1,).

    What the second gives of a polynomial up to the fourth power is what the first gives of its slope, and so for the
    third and its second derivative (1/s, 1/s2): sampled at a few points, the derivatives themselves do not.
    """
    h = max(round(half * rate), 3)
    u = np.arange(-h, h + 1) / (h + 1.0)
    phi = (1.0 - u * u) ** 5
    phi /= phi.sum()
    first = _matched(u * (1.0 - u * u) ** 4, phi, u, 1)
    second = _matched((1.0 - u * u) ** 3 * (9.0 * u * u - 1.0), phi, u, 2)
    scale = (h + 1.0) / rate  # s in one unit of u
    return phi, first / scale, second / scale**2


def _matched(shape: Array, phi: Array, u: Array, order: int) -> Array:
    """A derivative of ``phi`` by its shape, with polynomials times ``phi`` added that make its moments those of it."""
    powers = [k for k in range(5) if k % 2 == order % 2]
    moments = [np.prod(np.arange(k - order + 1, k + 1)) * (phi * u ** max(k - order, 0)).sum() for k in powers]
    basis = np.stack([shape / np.abs(shape).sum(), *(phi * u**k for k in powers)])
    found, *_ = np.linalg.lstsq(np.stack([u**k for k in powers]) @ basis.T, np.array(moments), rcond=None)
    return np.asarray(found @ basis)


def knots(trace: Trace, found: Segmentation, times: Scales, extra: Array | None = None) -> Knots:
    """Thin a run.

    Args:
        trace: with displacement and drive.
        found: its events, at least one.
        times: of the campaign.
        extra: added to every sample once it is decided where the knots are (m).
    """
    assert trace.displacement is not None and trace.drive is not None
    t, x = _even(trace.time, trace.displacement)
    rate = 1.0 / (t[1] - t[0])
    noise = max(float(trace.noise or 0.0), 1e-13)
    d = np.asarray(trace.drive.position(t))
    x = x - _hum(t, x, found.events, rate, times)
    smoothed, speed, smoother = _smooth(x, noise, rate, times)
    breaks = np.searchsorted(t, trace.drive.breakpoints)
    steady, raw = speed, x
    step = max(trace.resolution or 0.0, 2.0 * noise, UNSTEADY * _unsteady(x, t, found.events, rate))
    if extra is not None:
        x = x + extra[: x.size]
        smoothed, speed, smoother = _smooth(x, noise, rate, times)
    phi, first, second = kernels(times.half, rate)
    h = phi.size // 2
    pieces = _Pieces(step)
    pieces.start(t, x, d)
    edge = 1
    n = t.size
    events = found.events
    for e, event in enumerate(events):
        begin, end = _fast(events, e, times, rate, n, t, h)
        begin = max(begin, edge + 1)
        pieces.windows(_apart(_edges(edge, begin, event.i_onset, breaks), raw, step, breaks), e, t, x, d)
        if end <= begin:
            continue
        onset = min(max(event.i_onset, begin), end)
        pieces.windows(_hasty(begin, onset, steady, noise, rate, h), e, t, x, d, compared=False)
        pieces.samples(_thin(onset, end, event, times, rate, h), t, smoothed, speed, d, events, e)
        pieces.compare(begin + h, end - h, h, t, x, event, e, times, (phi, first, second), noise)
        edge = end
    if n - edge > 4 * h:
        last = len(events)
        pieces.windows(_apart(_edges(edge, n, n, breaks), raw, step, breaks), last, t, x, d, compared=False)
    return pieces.made(trace, t, (phi, first, second), events, noise, times, smoother)


def _even(t: Array, x: Array) -> tuple[Array, Array]:
    """Equal steps of time; lost samples are filled in linearly."""
    step = np.median(np.diff(t))
    if np.ptp(np.diff(t)) < 1e-3 * step:
        return np.asarray(t), np.asarray(x)
    even = np.arange(t[0], t[-1], step)
    return even, np.interp(even, t, x)


def _hum(t: Array, x: Array, events: tuple[Event, ...], rate: float, times: Scales) -> Array:
    """The sine at the mains frequency in the sticks, which is the sensor's (m)."""
    width = round(rate / HUM)
    if width < 8:
        return np.zeros_like(x)
    still = np.ones(x.size, bool)
    for event in events:
        a = np.searchsorted(t, event.t_onset - 2.0 * times.slip)
        b = np.searchsorted(t, event.t_arrest + 3.0 * times.slip)
        still[max(a, 0) : b] = False
    still[: 2 * width] = still[-2 * width :] = False
    if still.sum() < 20 * width:
        return np.zeros_like(x)
    total = np.cumsum(np.insert(x, 0, 0.0))
    mean = np.zeros_like(x)
    half = width // 2
    i = np.arange(half, x.size - width + half)
    mean[i] = (total[i - half + width] - total[i - half]) / width
    basis = np.stack([np.sin(2 * np.pi * HUM * t), np.cos(2 * np.pi * HUM * t)], axis=1)
    rest = (x - mean)[still]
    rest = rest - np.median(rest)
    keep = np.abs(rest) < 6.0 * max(np.median(np.abs(rest)) * 1.48, 1e-15)
    found, *_ = np.linalg.lstsq(basis[still][keep], rest[keep], rcond=None)
    spread = float(np.std(rest[keep])) * np.sqrt(2.0 / keep.sum()) * np.sqrt(width)
    return basis @ found if np.hypot(*found) > 4.0 * spread else np.zeros_like(x)


def _unsteady(x: Array, t: Array, events: tuple[Event, ...], rate: float) -> float:
    """Slow noise of the reading (m): how far means over a hundredth of a stick stray from a line through two others."""
    found = []
    for before, event in pairwise(events):
        a = int(np.searchsorted(t, before.t_arrest + 0.4 * (event.t_onset - before.t_arrest)))
        b = int(np.searchsorted(t, before.t_arrest + 0.8 * (event.t_onset - before.t_arrest)))
        width = (b - a) // 40
        if width < 2:
            continue
        mean = x[a : a + 40 * width].reshape(40, width).mean(axis=1)
        found.append(np.median(np.abs(np.diff(mean, 2))) / 0.6745 / np.sqrt(6.0))
    return float(np.median(found)) if found else 0.0


@dataclass(frozen=True)
class Smoother:
    """Weights of the samples around one in its smoothed displacement.

    Attributes:
        slow, fast: of slow motion and of what is added to it, shape (2 h + 1,) both.
        gain: how much of that is added at every sample, shape (N,).
    """

    slow: Array
    fast: Array
    gain: Array

    def matrix(self, index: Index) -> csr_array:
        """From all samples to the smoothed displacement at some of them."""
        h, n = self.slow.size // 2, self.gain.size
        around = np.clip(index[:, None] + np.arange(-h, h + 1), 0, n - 1)
        weights = self.slow + self.gain[index][:, None] * self.fast
        rows = np.repeat(np.arange(index.size), 2 * h + 1)
        return coo_array((weights.ravel(), (rows, around.ravel())), shape=(index.size, n)).tocsr()


def _smooth(x: Array, noise: float, rate: float, times: Scales) -> tuple[Array, Array, Smoother]:
    """Displacement and velocity where every sample counts, and how the former is made of the samples.

    Slow motion by a parabola over a ringing period, on top of it what a parabola over a third of it adds, shrunk by as
    much as noise adds to it in squares: the noise of one sample, taken for motion, would be a path that weakens the
    contact and makes it young.
    """
    period = times.ring or times.half
    wide, narrow = (max(round(width * rate) // 2 * 2 + 1, 3) for width in (period, period / 3.0))
    if wide < 5:
        return x, np.gradient(x) * rate, Smoother(np.ones(1), np.zeros(1), np.zeros(x.size))

    def parabola(y: Array, length: int, derivative: int = 0) -> Array:
        if length < 5:
            return y if derivative == 0 else np.gradient(y) * rate
        return savgol_filter(y, length, 2, deriv=derivative, delta=1.0 / rate)

    slow = parabola(x, wide)
    fast = parabola(x, narrow) - slow
    pulse = np.zeros(2 * wide + 1)
    pulse[wide] = 1.0
    still = parabola(pulse, wide)
    more = parabola(pulse, narrow) - still
    level = noise**2 * float((more**2).sum())
    seen = np.maximum(uniform_filter1d(fast**2, wide), 1e-300)
    gain = np.sqrt(np.maximum(1.0 - level / seen, 0.0))
    own = slice(wide - wide // 2, wide + wide // 2 + 1)
    smoother = Smoother(still[own], more[own], gain)
    return slow + gain * fast, parabola(x, wide, 1) + gain * (parabola(x, narrow, 1) - parabola(x, wide, 1)), smoother


def _fast(events: tuple[Event, ...], e: int, times: Scales, rate: float, n: int, t: Array, h: int) -> tuple[int, int]:
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


def _edges(low: int, high: int, onset: int, breaks: Index) -> Index:
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


def _apart(edges: Index, x: Array, step: float, breaks: Index) -> Index:
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


def _hasty(low: int, high: int, speed: Array, noise: float, rate: float, h: int) -> Index:
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


def _thin(begin: int, end: int, event: Event, times: Scales, rate: float, h: int) -> Index:
    """Samples that become knots: all where it rings, some of the slip."""
    fine = max(1, round(times.ring * rate / 24.0)) if times.ring else 1
    coarse = max(fine, h // 6, 1)
    a, b = event.i_onset + 2 * h, event.i_arrest - 2 * h
    if b - a < 4 * coarse:
        return np.arange(begin, end, fine)
    return np.concatenate([np.arange(begin, a, fine), np.arange(a, b, coarse), np.arange(b, end, fine)])


class _Pieces:
    """Knots and points as they are made."""

    def __init__(self, step: float) -> None:
        self.step = step
        self.t: list[Array] = []
        self.x: list[Array] = []
        self.v: list[Array] = []
        self.d: list[Array] = []
        self.weight: list[Array] = []
        self.event: list[Index] = []
        self.slow: list[NDArray[np.bool_]] = []
        self.sample: list[tuple[int, Index]] = []
        self.window: list[tuple[Index, Index]] = []
        self.size = 0
        self.points: list[dict[str, Array]] = []

    def _add(self, t: Array, x: Array, v: Array, d: Array, event: Index, slow: bool, weight: Array) -> Index:
        for into, what in ((self.t, t), (self.x, x), (self.v, v), (self.d, d), (self.weight, weight)):
            into.append(what)
        self.event.append(event)
        self.slow.append(np.full(t.size, slow))
        index = np.arange(self.size, self.size + t.size)
        self.size += t.size
        return index

    def start(self, t: Array, x: Array, d: Array) -> None:
        """Where the record begins."""
        self._add(t[:1], x[:1], np.zeros(1), d[:1], np.zeros(1, int), True, np.ones(1))

    def windows(self, edges: Index, e: int, t: Array, x: Array, d: Array, compared: bool = True) -> None:
        """Means over the windows between ``edges``."""
        count = np.diff(edges)
        if count.size == 0 or edges[-1] <= edges[0]:
            return
        mean = [np.add.reduceat(y[: edges[-1]], edges[:-1]) / count for y in (t, x, d)]
        index = self._add(
            mean[0], mean[1], np.full(count.size, np.nan), mean[2], np.full(count.size, e), True, count.astype(float)
        )
        self.window.append((index, edges))
        if compared:
            self.points.append(
                {
                    "knot": index.astype(float), "at": mean[0], "count": count.astype(float),
                    "of": np.full(count.size, float(e)), "phase": np.full(count.size, float(CREEP)),
                }
            )  # fmt: skip

    def samples(self, index: Index, t: Array, x: Array, v: Array, d: Array, events: tuple[Event, ...], e: int) -> None:
        """Samples as they are."""
        self.sample.append((self.size, index))
        middle = 0.5 * (events[e].t_onset + events[e].t_arrest)
        self._add(
            t[index], x[index], v[index], d[index], np.where(t[index] < middle, e, e + 1), False, np.ones(index.size)
        )

    def compare(
        self, low: int, high: int, h: int, t: Array, x: Array, event: Event, e: int, times: Scales,
        weights: tuple[Array, Array, Array], noise: float,
    ) -> None:  # fmt: skip
        """Points under the test function between two samples."""
        step = max(1, round(0.4 * h))
        centre = np.arange(low, high, step)
        centre = centre[(centre >= h) & (centre < t.size - h)]
        if centre.size == 0:
            return
        around = centre[:, None] + np.arange(-h, h + 1)
        seen = x[around] - x[centre][:, None]
        at = t[centre]
        lag = 0.5 * times.half
        phase = np.where(at < event.t_onset, NUCLEATION, np.where(at < event.t_arrest + 0.5 * lag, SLIP, RING))
        middle = 0.5 * (event.t_onset + event.t_arrest)
        self.points.append(
            {
                "centre": centre.astype(float), "at": at, "of": np.where(at < middle, e, e + 1.0),
                "phase": phase.astype(float), "rate": seen @ weights[1], "acceleration": seen @ weights[2],
            }
        )  # fmt: skip

    def made(
        self, trace: Trace, t: Array, weights: tuple[Array, Array, Array], events: tuple[Event, ...], noise: float,
        times: Scales, smoother: Smoother,
    ) -> Knots:  # fmt: skip
        knot_t = np.concatenate(self.t)
        d = np.concatenate(self.d)
        x = _onward(np.concatenate(self.x), np.concatenate(self.weight), np.concatenate(self.slow),
                    np.concatenate(self.event), max(noise, 0.3 * self.step))  # fmt: skip
        v, slow = np.concatenate(self.v), np.concatenate(self.slow)
        slopes = np.gradient(x, knot_t)
        # between windows the velocity is a mean, which tells no turning point
        turn = np.where(slow | np.insert(slow[:-1], 0, True), 0.0, turning(knot_t, np.where(slow, 0.0, v)))
        v = np.where(slow, slopes, v)
        inner = np.arange(2, v.size - 2)
        bends = np.zeros(v.size)
        bends[inner] = (v[inner + 2] - v[inner - 2]) / (knot_t[inner + 2] - knot_t[inner - 2])
        rate = 1.0 / (t[1] - t[0])
        phi, first, second = weights
        h = phi.size // 2
        rows: list[list[Index]] = [[], []]
        values: list[list[Array]] = [[], [], []]
        fast_rows: list[Index] = []
        shaken: tuple[list[Any], ...] = ([], [], [], [])  # rows, samples, and weights under the kernels' derivatives
        out: dict[str, list[Array]] = {k: [] for k in ("at", "of", "phase", "rate", "acceleration")}
        p = 0
        columns_window: list[Index] = []
        rows_window: list[Index] = []
        for piece in self.points:
            size = piece["at"].size
            index = np.arange(p, p + size)
            if "knot" in piece:
                rows_window.append(index)
                columns_window.append(piece["knot"].astype(int))
                knot = piece["knot"].astype(int)
                piece["rate"], piece["acceleration"] = v[knot], bends[knot]
            else:
                centre = piece["centre"].astype(int)
                offsets = np.arange(-h, h + 1)
                moments = t[centre][:, None] + offsets / rate
                right = np.clip(np.searchsorted(knot_t, moments), 1, knot_t.size - 1)
                share = (moments - knot_t[right - 1]) / (knot_t[right] - knot_t[right - 1])
                share = np.clip(share, 0.0, 1.0)
                row = np.repeat(index, offsets.size)
                for column, part in ((right - 1, 1.0 - share), (right, share)):
                    rows[0].append(row)
                    rows[1].append(column.ravel())
                    for into, kernel in zip(values, (phi, first, second), strict=True):
                        into.append((part * kernel).ravel())
                fast_rows.append(index)
                shaken[0].append(row)
                shaken[1].append((centre[:, None] + offsets).ravel())
                for into, kernel in zip(shaken[2:], (first, second), strict=True):
                    into.append(np.tile(kernel, size))
            for key, into in out.items():
                into.append(piece[key])
            p += size
        shape = (p, knot_t.size)
        r = np.concatenate([*rows[0], *rows_window])
        c = np.concatenate([*rows[1], *columns_window])
        ones = [np.ones(w.size) for w in rows_window]
        mean = coo_array((np.concatenate([*values[0], *ones]), (r, c)), shape=shape).tocsr()
        smooth = tuple(_sparse(k, rows[0], rows[1], shape) for k in values[1:])
        moving = tuple(_sparse(k, shaken[0], shaken[1], (p, t.size)) for k in shaken[2:])
        made = {k: np.concatenate(w) for k, w in out.items()}
        event = np.concatenate(self.event)
        of, phase = made["of"].astype(int), made["phase"].astype(int)
        # of a contact that was loaded before the record begins nothing is known until all of it slides
        keep = (of < len(events)) & ((of > 0) | trace.virgin)
        knots_made = Knots(
            trace.name, knot_t, x, v, d, turn, event, _arrests(knot_t, events, times), mean, (smooth[0], smooth[1]),
            made["at"], phase, of, made["rate"], made["acceleration"],
            self._reading(smoother, (knot_t.size, t.size)), (moving[0], moving[1]),
            _places(made["at"], phase, of, events, times), _elapsed(made["at"], of, events, float(t[0])),
            noise, trace.spring_stiffness, trace.virgin,
        )  # fmt: skip
        return selected(knots_made, keep)

    def _reading(self, smoother: Smoother, shape: tuple[int, int]) -> csr_array:
        """From samples to knots: means over windows, and smoothed samples."""
        rows, columns, values = [np.zeros(1, int)], [np.zeros(1, int)], [np.ones(1)]  # the start
        for knot, edges in self.window:
            count = np.diff(edges)
            rows.append(np.repeat(knot, count))
            columns.append(np.arange(edges[0], edges[-1]))
            values.append(np.repeat(1.0 / count, count))
        for first, index in self.sample:
            part = smoother.matrix(index).tocoo()
            rows.append(first + part.coords[0])
            columns.append(part.coords[1])
            values.append(part.data)
        return _sparse(values, rows, columns, shape)


def _onward(x: Array, weight: Array, slow: NDArray[np.bool_], event: Index, noise: float) -> Array:
    """The windows of every stick without steps back that are the noise's: the block creeps one way.

    A step back by a nanometre would unload every element, and the next one forward would not load them again at once:
    noise would make the model weaker than the contact. Where the block does go back by more than noise, nothing is
    changed.
    """
    out = x.copy()
    edges = np.flatnonzero(np.diff(slow.astype(int)) | (np.diff(event) != 0)) + 1
    for piece in np.split(np.arange(x.size), edges):
        if piece.size < 3 or not slow[piece[0]]:
            continue
        rising = bool(x[piece[-1]] >= x[piece[0]])
        found = isotonic_regression(x[piece], weights=weight[piece], increasing=rising).x
        if np.abs(found - x[piece]).max() < BACK * noise:
            out[piece] = found
    return out


def _sparse(values: list[Array], rows: list[Index], columns: list[Index], shape: tuple[int, int]) -> csr_array:
    return coo_array((np.concatenate(values or [np.zeros(0)]), (_joined(rows), _joined(columns))), shape=shape).tocsr()


def _joined(pieces: list[Index]) -> Index:
    return np.concatenate([p.ravel() for p in pieces]) if pieces else np.zeros(0, int)


def selected(k: Knots, keep: NDArray[np.bool_]) -> Knots:
    """Some of the points."""
    index = np.flatnonzero(keep)
    return replace(
        k, mean=k.mean[index], smooth=(k.smooth[0][index], k.smooth[1][index]),
        moving=(k.moving[0][index], k.moving[1][index]),
        **{n: getattr(k, n)[index] for n in POINTS},
    )  # fmt: skip


def _arrests(t: Array, events: tuple[Event, ...], times: Scales) -> Index:
    # at the arrest itself all elements are at their caps and take no step onwards
    later = 0.25 * times.ring or 0.5 * times.half
    out = np.full(t.size, -1)
    out[1:][t[1:] < 0.5 * (events[0].t_onset + events[0].t_arrest)] = 0
    for e in range(1, len(events) + 1):
        stop = np.inf if e == len(events) else 0.5 * (events[e].t_onset + events[e].t_arrest)
        out[(t >= events[e - 1].t_arrest + later) & (t < stop)] = e
    return out


def _elapsed(at: Array, of: Index, events: tuple[Event, ...], start: float) -> Array:
    begun = np.array([start, *(e.t_arrest for e in events)])
    return np.maximum(at - begun[np.minimum(of, len(events))], 0.0)


def _places(at: Array, phase: Index, of: Index, events: tuple[Event, ...], times: Scales) -> Array:
    """A coordinate that grows with time: in the stick the logarithms of the times from the arrest and to the onset."""
    out = np.zeros(at.size)
    for e in np.unique(of):
        own = of == e
        onset = events[e].t_onset if e < len(events) else at[own].max() + 1.0
        start = events[e - 1].t_arrest if e else at[own].min() - times.half
        begun = np.arcsinh((at[own] - start) / times.half)
        left = np.arcsinh((onset - at[own]) / times.half)
        out[own] = begun - left
    return out
