"""The measured motion of a run, thinned to knots: windows where the block creeps, samples where it is fast.

Beside the knots stands what turns forces at the knots into the numbers that are compared: at a window the force
itself, where the block is fast its mean under a smooth test function. The acceleration under the same test function is
the test function's second derivative applied to the displacement (the weak form), so nothing is differentiated and the
kinks of onset and arrest are no trouble.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from ...data.resolution import rounding_of_mean
from ...data.segment import Event, Segmentation
from ...data.trace import Trace
from .counts import counted, rounding
from .inserted_knots import Inserted
from .kernels import band, kernels
from .later_ringing import Turns, later_turns
from .mains import hum
from .reading import Reading
from .sampling import even
from .scales import Scales
from .smoothing import Smoother, crept, onward, smoothed, unsteady
from .windows import fast_samples, joined_windows, knot_samples, nucleation_windows, start_of_motion, window_edges

Array = NDArray[np.float64]
Index = NDArray[np.intp]

CREEP, NUCLEATION, SLIP, RING = range(4)
PHASES = ("creep", "nucleation", "slip", "ring-down")
POINTS = ("at", "phase", "of", "rate", "acceleration", "place", "elapsed", "force_noise")
PASSES = 2  # of what rounding adds, each from where the last one leads
UNSTEADY = 4.0  # levels of slow noise by which two windows must differ


@dataclass(frozen=True)
class Knots:
    """One run at its knots, shape (n,), and the points that are compared, shape (p,).

    Attributes:
        name: of the run.
        t, x, v: time (s), reading (m) and its rate (m/s) at the knots.
        drive: load point (m).
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
        reading: samples, and what an error of theirs does at knots and points.
        place: coordinate along which misfits are correlated, over a length of the order of one (1).
        elapsed: time since the arrest before, or the start (s).
        lasting: time of every event from the arrest before, or the start, to its own (s), shape (E,).
        noise: standard deviation of one sample (m).
        stiffness: of the driving spring, where this run has its own (N/m).
        virgin: whether the contact is force-free at the start.
        force: measured force at the knots where the motion is prescribed, else zero (N).
        load: measured normal load at the knots (N), NaN where there is none.
        force_noise: variance of the force at the points where that is measured by itself, else zero (N^2).
        band: angular frequency of what the test function's second derivative leaves of white noise (rad/s).
        hum: what sine and cosine of the sensor's hum, each as large as is expected, add to the samples of each group
            (m), shape (g, 2).
        walk: random walk of the reading where it is stated (m/s^0.5), else zero.
        step: between samples (s).
        force_scale: measured over true force of the spring with which a displacement was made that was
            not measured (1).
    """

    name: str
    t: Array
    x: Array
    v: Array
    drive: Array
    event: Index
    arrest: Index
    mean: csr_array
    smooth: tuple[csr_array, csr_array]
    at: Array
    phase: Index
    of: Index
    rate: Array
    acceleration: Array
    reading: Reading
    place: Array
    elapsed: Array
    lasting: Array
    noise: float
    stiffness: float | None
    virgin: bool
    force: Array
    load: Array
    force_noise: Array
    band: float
    hum: Array
    walk: float = 0.0
    step: float = 0.0
    force_scale: float | None = None

    @property
    def prescribed(self) -> bool:
        """Whether the force is measured beside a prescribed motion."""
        return bool(self.force_noise.any())

    @property
    def events(self) -> int:
        """Number of events."""
        return int(self.of.max(initial=-1)) + 1


def knots(trace: Trace, found: Segmentation, times: Scales, extra: Array | None = None) -> Knots:
    """Thin a run.

    Args:
        trace: with displacement and drive.
        found: its events, at least one.
        times: of the campaign.
        extra: added to every sample once it is decided where the knots are (m).
    """
    assert trace.displacement is not None and trace.drive is not None
    t, x = even(trace.time, trace.displacement)
    rate = 1.0 / (t[1] - t[0])
    noise = max(float(trace.noise or 0.0), 1e-13)
    d = np.asarray(trace.drive.position(t))
    breaks = np.searchsorted(t, trace.drive.breakpoints)
    arrests = (np.array([e.t_arrest for e in found.events]) - t[0]) * rate
    hums = hum(t, x, trace, found, times.slip, times.hum)
    count = trace.resolution if trace.resolution and counted(x, trace.resolution) else 0.0
    x = unrounded(x, hums, count, noise, rate, times, arrests)
    followed, speed, smoother = smoothed(x, noise, rate, times, arrests)
    steady, raw = speed, x
    step = max(trace.resolution or 0.0, 2.0 * noise, UNSTEADY * unsteady(x, t, found.events, rate))
    if extra is not None:
        x = x + extra[: x.size]
        followed, speed, smoother = smoothed(x, noise, rate, times, arrests)
    phi, first, second = kernels(times.half, rate)
    h = phi.size // 2
    builder = _KnotBuilder(step)
    builder.start(t, x, d)
    edge = 1
    stretches: list[tuple[int, int]] = []  # from the last sample that is followed to the first that is again
    n = t.size
    events = found.events
    for e, event in enumerate(events):
        begin, end = fast_samples(events, e, times, rate, n, t, h)
        begin = max(start_of_motion(begin, event.i_onset - 2 * h, raw, count, h), edge + 1)
        builder.windows(joined_windows(window_edges(edge, begin, event.i_onset, breaks), raw, step, breaks), e, t, x, d)
        if end <= begin:
            continue
        onset = min(max(event.i_onset, begin), end)
        builder.windows(nucleation_windows(begin, onset, steady, noise, rate, h), e, t, x, d, speed)
        builder.samples(knot_samples(onset, end, event, times, rate, h), t, followed, speed, d, events, e)
        builder.compare(begin + h, end - h, h, t, x, event, e, times, (phi, first, second), noise)
        if edge > 1:
            stretches.append((edge - 1, begin))
        edge = end
    if n - edge > 4 * h:
        last = len(events)
        builder.windows(joined_windows(window_edges(edge, n, n, breaks), raw, step, breaks), last, t, x, d, speed)
    if edge > 1:
        stretches.append((edge - 1, n))
    later = later_turns(t, x, stretches, times.ring, noise)
    return builder.build(trace, t, x, (phi, first, second), events, noise, times, smoother, count, later)


def unrounded(
    readings: Array, hums: Array, count: float, noise: float, rate: float, times: Scales, arrests: Array
) -> Array:
    """Readings (m) without the hum and, if they are counts (m), what rounding adds in the mean where the motion is."""
    x = readings - hums
    if not counted(readings, count):
        return x
    before = noise**2 - count**2 / 12.0
    out = x
    for _ in range(PASSES):
        followed, _, smoother = smoothed(out, noise, rate, times, arrests)
        spread = np.sqrt(max(before, 0.0) + noise**2 * smoother.squares)
        out = x - rounding(followed + hums - readings[0], count, spread)
    return out


class _KnotBuilder:
    """Collects knots and points, event by event."""

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

    def windows(self, edges: Index, e: int, t: Array, x: Array, d: Array, speed: Array | None = None) -> None:
        """Means over the windows between ``edges``; with the ``speed`` of every sample those that are not compared.

        The ``speed`` is that of the smoothed record, which is kept where the windows do not tell it better.
        """
        count = np.diff(edges)
        if count.size == 0 or edges[-1] <= edges[0]:
            return
        mean = [np.add.reduceat(y[: edges[-1]], edges[:-1]) / count for y in (t, x, d)]
        v = np.full(count.size, np.nan)
        if speed is not None:
            v = np.add.reduceat(speed[: edges[-1]], edges[:-1]) / count
        index = self._add(mean[0], mean[1], v, mean[2], np.full(count.size, e), True, count.astype(float))
        self.window.append((index, edges))
        if speed is None:
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

    def build(
        self, trace: Trace, t: Array, samples: Array, weights: tuple[Array, Array, Array], events: tuple[Event, ...],
        noise: float, times: Scales, smoother: Smoother, count: float, later: Turns,
    ) -> Knots:  # fmt: skip
        assert trace.drive is not None
        knot_t, seen = np.concatenate(self.t), np.concatenate(self.x)
        d = np.concatenate(self.d)
        one_way = onward(seen, np.concatenate(self.weight), np.concatenate(self.slow), np.concatenate(self.event),
                         max(noise, 0.3 * self.step))  # fmt: skip
        width = np.where(np.concatenate(self.slow), np.concatenate(self.weight), 0.0) * (t[1] - t[0])
        bowed = bow(knot_t, width, np.asarray(trace.drive.breakpoints))
        made_of = csr_array(one_way - one_way @ bowed)  # values in the middles from means
        x = made_of @ seen
        v, slow = np.concatenate(self.v), np.concatenate(self.slow)
        v = slope = self._velocity(knot_t, x, v, np.asarray(trace.drive.breakpoints), events, times)
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
                nodes, shares = _between(knot_t, moments)
                row = np.repeat(index, offsets.size)
                for column, part in zip(nodes, shares, strict=True):
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
        # between windows the velocity is a mean, which tells no turning point
        arrests = np.array([e.t_arrest for e in events])
        still = np.where(slow, 0.0, v)
        inserted = Inserted.of(knot_t, x, still, slow, arrests, times.ring or times.slip, later)
        shape = (p, inserted.size)
        flat = bowed[_joined(columns_window)].tocoo()
        r = np.concatenate([*rows[0], *rows_window, _joined(rows_window)[flat.coords[0]]])
        c = inserted.place[np.concatenate([*rows[1], *columns_window, flat.coords[1]])]
        ones = [np.ones(w.size) for w in rows_window]
        mean = coo_array((np.concatenate([*values[0], *ones, flat.data]), (r, c)), shape=shape).tocsr()
        smooth = tuple(_sparse(k, rows[0], [inserted.place[i] for i in rows[1]], shape) for k in values[1:])
        moving = tuple(_sparse(k, shaken[0], shaken[1], (p, t.size)) for k in shaken[2:])
        made = {k: np.concatenate(w) for k, w in out.items()}
        event = np.concatenate(self.event)
        of, phase = made["of"].astype(int), made["phase"].astype(int)
        # of a contact that was loaded before the record begins nothing is known until all of it slides
        keep = (of < len(events)) & ((of > 0) | trace.virgin)
        reading = csr_array(made_of @ self._reading(smoother, (knot_t.size, t.size)))
        begun = np.array([float(t[0]), *(e.t_arrest for e in events)])
        d, x, v = (inserted.joined(y, own) for y, own in ((d, inserted.between(d)), (x, inserted.x), (v, inserted.v)))
        knot_t = inserted.joined(knot_t, inserted.between(knot_t))
        event = event[inserted.source]
        inflation = self._inflation(t.size, slope, noise, count, 1.0 / rate)
        told = Reading.of(samples, inserted.rows(reading), moving[0], moving[1], inflation)
        knots_made = Knots(
            trace.name, knot_t, x, v, d, event, _arrests(knot_t, events, times), mean, (smooth[0], smooth[1]),
            made["at"], phase, of, made["rate"], made["acceleration"], told,
            _places(made["at"], phase, of, events, times), _elapsed(made["at"], of, begun), np.diff(begun),
            noise, trace.spring_stiffness, trace.virgin, np.zeros(knot_t.size), load_at(trace, knot_t),
            np.zeros(of.size), band(second, rate), told.sums(times.hum.at(t)), trace.walk, 1.0 / rate,
            trace.force_scale,
        )  # fmt: skip
        return selected(knots_made, keep)

    def _inflation(self, size: int, v: Array, noise: float, count: float, step: float) -> Array:
        """Factor on the variance of every sample by rounding, an error common to its window, shape (N,)."""
        out = np.ones(size)
        if not count > 0.0:
            return out
        spread = np.sqrt(max(noise**2 - count**2 / 12.0, 0.0))
        for knot, edges in self.window:
            length = np.diff(edges)
            added = rounding_of_mean(v[knot] * length * step, count, spread)
            out[edges[0] : edges[-1]] += np.repeat(added * length / noise**2, length)
        return out

    def _velocity(self, t: Array, x: Array, v: Array, breaks: Array, events: tuple[Event, ...], times: Scales) -> Array:
        """At the knots (m/s), where the means over the windows tell it and where the smoothed record does."""
        slow = np.concatenate(self.slow)
        turns = np.diff(slow.astype(int), prepend=0) != 0
        parts = np.diff(np.searchsorted(breaks, t), prepend=0) != 0
        stretch = np.where(slow, np.cumsum(turns | parts), -1)
        stretch[0] = -1  # where the record begins
        onsets = np.array([*(e.t_onset for e in events), np.nan])[np.concatenate(self.event)]
        return crept(t, x, np.concatenate(self.weight), stretch, onsets, self.step, v, times.ring or times.half)

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


def load_at(trace: Trace, t: Array) -> Array:
    """Measured normal load at some times (N), NaN where none was measured; shape as ``t``."""
    return np.full(t.size, np.nan) if trace.normal_load is None else np.interp(t, trace.time, trace.normal_load)


def bow(t: Array, width: Array, breaks: Array) -> csr_array:
    """By how much the mean over a window differs from the value in its middle, of values in the middles, shape (n, n).

    A twelfth of half the second derivative of the parabola through it and the windows beside it, times its width
    squared; none where the drive breaks between them, or no window lies at both sides.

    Args:
        t: middles (s), shape (n,).
        width: of the windows (s), zero where there is none, shape (n,).
        breaks: times at which the drive changes (s).
    """
    i = np.arange(1, t.size - 1)
    before, after = np.diff(t)[:-1], np.diff(t)[1:]
    beside = width[:-1] + width[1:]
    close = (np.minimum(width[:-1], width[1:]) > 0.0) & (np.abs(2.0 * np.diff(t) - beside) < 1e-6 * beside)
    steady = np.searchsorted(breaks, t[:-2]) == np.searchsorted(breaks, t[2:])
    bent = np.where(close[:-1] & close[1:] & steady, width[1:-1] ** 2 / 12.0, 0.0)
    left, right = bent / (before * (before + after)), bent / (after * (before + after))
    rows = np.concatenate([i, i, i])
    columns = np.concatenate([i - 1, i, i + 1])
    return coo_array((np.concatenate([left, -left - right, right]), (rows, columns)), shape=(t.size,) * 2).tocsr()


def _between(t: Array, moments: Array) -> tuple[Index, Array]:
    """Indices of the four knots around some moments, and their weights in the cubic through them, shape (4, ...) both.

    A chord would be off by a twelfth of the second difference, always the same way where friction is lost with slip.
    """
    moments = np.clip(moments, t[0], t[-1])
    nodes = np.clip(np.searchsorted(t, moments) - 2, 0, t.size - 4) + np.arange(4).reshape(4, *[1] * moments.ndim)
    at = t[nodes]
    weights = np.ones(nodes.shape)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[i] *= (moments - at[j]) / (at[i] - at[j])
    return nodes, weights


def _sparse(values: list[Array], rows: list[Index], columns: list[Index], shape: tuple[int, int]) -> csr_array:
    return coo_array((np.concatenate(values or [np.zeros(0)]), (_joined(rows), _joined(columns))), shape=shape).tocsr()


def _joined(pieces: list[Index]) -> Index:
    return np.concatenate([p.ravel() for p in pieces]) if pieces else np.zeros(0, int)


def selected(k: Knots, keep: NDArray[np.bool_]) -> Knots:
    """Some of the points."""
    index = np.flatnonzero(keep)
    return replace(
        k, mean=k.mean[index], smooth=(k.smooth[0][index], k.smooth[1][index]),
        reading=k.reading.points(index), **{n: getattr(k, n)[index] for n in POINTS},
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


def _elapsed(at: Array, of: Index, begun: Array) -> Array:
    return np.maximum(at - begun[of.clip(max=begun.size - 1)], 0.0)


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
