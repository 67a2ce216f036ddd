"""A campaign turned into numbers: the cycles of every run, their features, and the sensor's share of the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from ...data.segment import Segmentation
from ...data.trace import Trace
from ...errors import InputError
from ...simulation.shooting import MOST_STEPS, Cycles, longest
from .curve import SampledCurve
from .evaluate import Anchors, features
from .layout import CREEP_POINTS, HOLD, LEVELS, SETTLE, Layout

SLIP_SAMPLES, LEAST_SAMPLES = 50.0, 8.0  # of a slip, below which samples are put between, if there are so many
RING_COUNTS = 1.0  # rms of the ringing, in counts, below which nothing is said of it
MAINS = 50.0  # Hz; at 60 Hz a window averages little more
RING_RATE = 4.0  # samples a period of the ringing below which nothing is said of it


@dataclass(frozen=True)
class Measurement:
    """What a fit sees of a campaign. R runs, n cycles (the shorter runs padded), F features.

    Attributes:
        layout: which features.
        cycles: when and where each cycle begins, shape (R, n) and nodes (R, m).
        anchors: when the features are taken, shape (R, n, ...).
        values: features, SI, shape (R, n, F).
        valid: which of them the data give, shape (R, n, F).
        sensor: standard deviation of their sensor noise, SI, shape (R, n, F).
        names: of the runs.
        velocities: usual speed of the drive in each run (m/s), shape (R,).
        dropped: what was left out, and why.
        new_lines: how much of the contact is new at every event, 0 to 1, where that is known; None: its scatter tells.
        contacts: over how many of them the contact averages, where that is known.
    """

    layout: Layout
    cycles: Cycles
    anchors: Anchors
    values: np.ndarray
    valid: np.ndarray
    sensor: np.ndarray
    names: tuple[str, ...]
    velocities: np.ndarray
    dropped: tuple[str, ...] = ()
    new_lines: float | None = None
    contacts: int | None = None

    @property
    def runs(self) -> int:
        return self.values.shape[0]

    def take(self, runs: Sequence[int]) -> Measurement:
        """The measurement with these runs only."""
        i = np.asarray(runs, int)
        return Measurement(
            self.layout,
            jax.tree.map(lambda a: a[i], self.cycles),
            jax.tree.map(lambda a: a[i], self.anchors),
            self.values[i],
            self.valid[i],
            self.sensor[i],
            tuple(self.names[k] for k in i),
            self.velocities[i],
            self.dropped,
            self.new_lines,
            self.contacts,
        )


_FORWARDS = 'for runs in that direction write  unit = "-1 um"  or the like, and the drive\'s velocity as positive'


def measure(
    traces: Sequence[Trace],
    segmentations: Sequence[Segmentation],
    *,
    ring_period: float,
    most_cycles: int = 8,
    most_steps: int = MOST_STEPS,
    contacts: int | None = None,
) -> Measurement:
    """Features of every cycle of every run.

    Args:
        traces, segmentations: of the runs, in the same order; runs without a slip are left out and named.
        ring_period: expected period of the contact resonance (s).
        most_cycles: at most so many cycles of a run are used, the first ones.
        most_steps: that the model will have for one cycle; runs end before a longer one.
        contacts: of the rig, where that is known.

    Raises:
        InputError: there are fewer than two slips in all runs.
    """
    pairs = [(t, s) for t, s in zip(traces, segmentations, strict=True) if len(s.events) >= 1]
    dropped = [
        f"{t.name}: no slip in it ({s.reason})" for t, s in zip(traces, segmentations, strict=True) if not s.events
    ]
    dropped += [
        f"{t.name}: one slip only, so nothing of it that needs a slip before (ring-down, creep in a later stick"
        f"{'' if t.virgin else ', recurrence'})"
        for t, s in pairs
        if len(s.events) == 1
    ]
    if sum(len(s.events) for _, s in pairs) < 2:
        raise InputError(
            f"{'one slip' if pairs else 'no slip'} in the whole campaign: the dynamic model needs at least two, so "
            "that a stick between slips can be compared",
            key=", ".join(f"trace '{t.name}' ({t.provenance.file})" for t in traces[:4]) + ", ..." * (len(traces) > 4),
            hint="record longer, drive slower or with a softer spring"
            + ("; --model static fits single creep processes" if any(t.virgin for t in traces) else "")
            + doubts(traces),
        )
    one_way = [_one_way(t, s) for t, s in pairs]
    dropped += [text for _, text in one_way if text]
    pairs = [(t, s) for (t, s), _ in one_way if s.events]
    if not pairs:
        raise InputError("every run is pulled backwards, which the dynamic model does not follow", hint=_FORWARDS)
    whole = [_integrable(t, s, longest(most_steps)) for t, s in pairs]
    dropped += [text for _, text in whole if text]
    pairs = [(t, s) for (t, s), _ in whole if s.events]
    if not pairs:
        raise InputError(
            f"every run begins with a cycle of more than {longest(most_steps):.3g} s, for which the dynamic model has "
            "no steps",
            hint="drive faster, or fit single creep processes with --model static",
        )
    dropped += [
        f"{t.name}: {most_cycles} of {len(s.events)} slips are used, the first ones"
        for t, s in pairs
        if len(s.events) > most_cycles
    ]
    durations = np.concatenate([[e.duration for e in s.events] for _, s in pairs])
    settling = float(2.2 * np.median(durations))
    layout = Layout(settling, float(max(0.13 * np.median(durations), 2.0 * ring_period)))
    rows = [_run(t, s, layout, ring_period, most_cycles) for t, s in pairs]
    # padded to round sizes, so that campaigns of about one size share a compiled program
    width = _round_up(max(len(r[1]) for r in rows))
    nodes = _round_up(max(r[0][0].size for r in rows))
    cycles, anchors, values, valid, sensor = zip(
        *(_stack(r, i, width, nodes, layout) for i, r in enumerate(rows)), strict=True
    )
    return Measurement(
        layout,
        jax.tree.map(lambda *a: jnp.asarray(np.stack(a)), *cycles),
        jax.tree.map(lambda *a: jnp.asarray(np.stack(a)), *anchors),
        np.stack(values),
        np.stack(valid),
        np.stack(sensor),
        tuple(t.name for t, _ in pairs),
        np.array([s.settings.speed for _, s in pairs]),
        tuple(dropped),
        contacts=contacts,
    )


def _one_way(trace: Trace, found: Segmentation) -> tuple[tuple[Trace, Segmentation], str]:
    """A run as long as its slips go forwards, and what is to be said of the others."""
    back = next((n for n, e in enumerate(found.events) if e.direction < 0), None)
    if back is None:
        return (trace, found), ""
    count = len(found.events) - back
    text = (
        f"{trace.name}: slips from number {back + 1} on ({count} of {len(found.events)}) are left out, because there "
        f"the block is pulled backwards. To correct: {_FORWARDS}"
    )
    return (trace, replace(found, events=found.events[:back])), text


def doubts(traces: Sequence[Trace]) -> str:
    """What looked odd when the traces were read, to be added to a hint where nothing was found in them."""
    said = [f"{t.name}: {w}" for t in traces for w in t.warnings]
    return "".join(f". {line}" for line in said[:4])


def _integrable(trace: Trace, found: Segmentation, most: float) -> tuple[tuple[Trace, Segmentation], str]:
    """A run up to its first cycle that takes more steps than a cycle may have, and what is to be said of the others."""
    begins = [float(trace.time[0]), *(e.t_arrest for e in found.events)]
    long = [n for n, e in enumerate(found.events) if e.t_arrest - begins[n] > most]
    if not long:
        return (trace, found), ""
    first, lasts = long[0], found.events[long[0]].t_arrest - begins[long[0]]
    text = (
        f"{trace.name}: slips from number {first + 1} on ({len(found.events) - first} of {len(found.events)}) are left "
        f"out, because the cycle before lasts {lasts:.3g} s, more than the {most:.3g} s over which the dynamic model "
        "can be integrated"
    )
    return (trace, replace(found, events=found.events[:first])), text


def _round_up(n: int) -> int:
    """The next multiple of four, of sixteen beyond."""
    step = 4 if n <= 16 else 16
    return -(-n // step) * step


def _run(trace: Trace, found: Segmentation, layout: Layout, ring_period: float, most: int) -> tuple:
    """Nodes of the load point and one record for every cycle of a run."""
    assert trace.displacement is not None
    assert trace.drive is not None
    t, y, finer = _refined(trace, found)
    nodes = (np.asarray(trace.drive.times, float), np.asarray(trace.drive.positions, float))
    width = 0.18 * ring_period
    events = found.events[:most]
    tops = []
    for e in events:
        near = slice(max(e.i_onset - 5, 0) * finer, (e.i_arrest + 60) * finer)
        curve = SampledCurve(t[near], y[near], e.t_arrest, width)
        tops.append(curve.top)
    begins = [(float(t[0]), float(y[0])), *tops]
    noise = float(found.settings.noise if trace.noise is None else trace.noise)
    count = float(trace.resolution or 0.0)
    rate = 1.0 / float(np.median(np.diff(trace.time)))
    records = []
    for n in range(len(events)):
        start, position = begins[n]
        stop = tops[n][0]
        records.append(
            _cycle(t, y, start, position, stop, found, n, layout, ring_period, width, noise, count, trace, rate, finer)
        )
    onsets = np.array([e.t_onset for e in events[1:] or events])
    stretch = float(np.median(np.interp(onsets, *nodes) - np.interp(onsets, t, y)))
    return nodes, records, bool(trace.virgin), trace.spring_stiffness, stretch


def _refined(trace: Trace, found: Segmentation) -> tuple[np.ndarray, np.ndarray, int]:
    """Times and positions of a run, and how many there are for each sample.

    Features are taken on straight lines between samples. Where a slip has few, its curvature would be lost, and samples
    are put between them on a cubic spline (on a straight line where some are missing).
    """
    t, y = trace.time, np.asarray(trace.displacement)
    samples = float(np.median([e.duration for e in found.events])) * trace.sampling_rate
    finer = int(np.ceil(SLIP_SAMPLES / samples)) if LEAST_SAMPLES <= samples < SLIP_SAMPLES else 1
    if finer == 1:
        return t, y, 1
    number = np.arange((t.size - 1) * finer + 1)
    fine = np.interp(number / finer, np.arange(t.size), t)
    steps = np.diff(t)
    broken = np.append(np.repeat(steps > 1.5 * np.median(steps), finer), False)
    return fine, np.where(broken, np.interp(fine, t, y), CubicSpline(t, y)(fine)), finer


def _cycle(
    t: np.ndarray,
    y: np.ndarray,
    start: float,
    position: float,
    stop: float,
    found: Segmentation,
    n: int,
    layout: Layout,
    ring_period: float,
    width: float,
    noise: float,
    count: float,
    trace: Trace,
    rate: float,
    finer: int,
) -> dict[str, Any]:
    """Anchors, features, validity and sensor noise of the cycle that ends with event ``n``."""
    event = found.events[n]
    a = max(int(np.searchsorted(t, start)) - 2, 0)
    b = min(int(np.searchsorted(t, stop)) + 80 * finer, t.size)
    curve = SampledCurve(t[a:b], y[a:b], event.t_arrest, width)
    settling = layout.settling
    rest = float(curve.mean(np.array([start + 1.15 * settling]), 0.3 * settling)[0])
    _, peak = curve.top
    first = float(curve.rise(np.array([rest + 0.05 * (peak - rest)]), start + settling)[0])
    longest = max(first - start - 1.35 * settling, 2.0 * layout.shortest)
    ladder = np.geomspace(layout.shortest, longest, CREEP_POINTS)
    hold = max(event.holds, key=lambda h: h[1] - h[0], default=None)
    usable = hold is not None and hold[0] > start + 1.4 * settling
    span = np.array(hold if usable else (start, start + settling), float)
    anchors = Anchors(np.float64(start), ladder, span, np.float64(ring_period))
    values = features(curve, anchors, layout)
    virgin = n == 0
    valid = np.ones(layout.size, bool)
    s = layout.slices()
    if virgin:
        for group in ("overshoot", "ring", "frequency"):
            valid[s[group]] = False
        if not trace.virgin:
            # where the cycle began is not known: only the slip itself can be compared
            valid[s["recurrence"]] = valid[s["creep"]] = valid[s["settle"]] = False
    if first - start < 1.6 * settling:
        valid[s["creep"]] = valid[s["settle"]] = False
    late = start + np.array(SETTLE) * settling > first - 2.0 * layout.shortest
    valid[s["settle"]] &= ~late
    valid[s["hold"]] = usable
    short = np.array([start + np.max(SETTLE[:2]) * settling > first])
    if short.any():
        valid[s["ring"]] = False
    if virgin and not trace.virgin and first - start < 1.6 * settling:
        valid[:] = False  # the record begins too late to see where this slip started
    if rate * ring_period < RING_RATE:
        valid[s["ring"]] = valid[s["frequency"]] = False
    if count > 0 and float(values[s["ring"]][0]) < RING_COUNTS * count:
        # a reading that rests on its counts: neither how loud it rings nor how fast can be told
        valid[s["ring"]] = valid[s["frequency"]] = False
    valid &= np.isfinite(values)
    sensor = np.hypot(
        _sensor_noise(values, anchors, layout, noise, count, rate),
        slow_noise(anchors, layout, first, stop, trace.walk, trace.hum),
    )
    return {
        "start": start,
        "position": position,
        "limit": start + 1.6 * (stop - start) + 2.0 * settling,
        "least_slip": 0.3 * (peak - position),
        "anchors": anchors,
        "values": np.where(np.isfinite(values), values, 0.0),
        "valid": valid,
        "sensor": sensor,
        "stop": stop,
    }


def _sensor_noise(
    values: np.ndarray, anchors: Anchors, layout: Layout, noise: float, count: float, rate: float
) -> np.ndarray:
    """Standard deviation of every feature that comes from the sensor alone (SI)."""
    s = layout.slices()
    out = np.zeros(layout.size)
    white = noise**2 + count**2 / 12.0

    def window(length: float) -> float:
        # a count is a bias of up to half its size while the reading rests on it; motion dithers it
        return float(np.sqrt(noise**2 / max(rate * length, 1.0) + count**2 / 12.0 / 10.0))

    rest = window(0.3 * layout.settling)
    out[s["recurrence"]] = 0.5 / rate / np.sqrt(3.0)
    out[s["size"]] = np.hypot(rest, np.sqrt(white / 4.0))
    out[s["times"]] = np.hypot(
        0.02 / rate, _passage_noise(values[s["times"]], float(values[s["size"]][0]), np.sqrt(white))
    )
    out[s["overshoot"]] = np.hypot(rest, np.sqrt(white / 4.0))
    out[s["ring"]] = np.sqrt(white) / 5.0
    ringing = max(float(values[s["ring"]][0]), 1e-12)
    period = float(anchors.ring_period)
    out[s["frequency"]] = np.sqrt(white) / ringing / (2 * np.pi * period) / np.sqrt(max(rate * 3 * period, 1.0))
    widths = np.maximum(0.12 * anchors.creep, 0.25 * layout.shortest)
    out[s["creep"]] = [np.hypot(rest, window(w)) for w in widths]
    out[s["settle"]] = np.hypot(rest, window(0.1 * layout.settling))
    length = float(anchors.hold[1] - anchors.hold[0])
    out[s["hold"]] = [np.hypot(window(0.03 * length), window(0.08 * length))] * len(HOLD)
    return out


def slow_noise(anchors: Anchors, layout: Layout, first: float, stop: float, walk: float, hum: float) -> np.ndarray:
    """Standard deviation of every feature from a sensor's random walk (m/sqrt(s)) and hum (amplitude, m), SI.

    Displacements are differences of means over two windows: a walk grows with the root of the time between them, a hum
    counts as far as a window does not average it. ``first`` is when the slip of the cycle begins, ``stop`` its arrest.
    """
    s, settling, start = layout.slices(), layout.settling, float(anchors.start)
    out = np.zeros(layout.size)
    if walk == 0.0 and hum == 0.0:
        return out
    rest, rest_width = start + 1.15 * settling, 0.3 * settling

    def moved(at: np.ndarray, width: Any, since: float = rest, since_width: float = rest_width) -> np.ndarray:
        swing = hum / np.sqrt(2.0) * np.hypot(np.sinc(MAINS * width), np.sinc(MAINS * since_width))
        return np.hypot(walk * np.sqrt(np.abs(at - since)), swing)

    creep = anchors.creep
    out[s["size"]] = moved(np.array([stop]), 0.0)
    out[s["overshoot"]] = moved(np.array([start]), 0.0)
    out[s["creep"]] = moved(first - creep, np.maximum(0.12 * creep, 0.25 * layout.shortest))
    out[s["settle"]] = moved(start + np.array(SETTLE) * settling, 0.1 * settling)
    begin, length = float(anchors.hold[0]), float(anchors.hold[1] - anchors.hold[0])
    out[s["hold"]] = moved(begin + np.array(HOLD) * length, 0.08 * length, begin + 0.02 * length, 0.03 * length)
    return out


def _passage_noise(times: np.ndarray, size: float, noise: float) -> np.ndarray:
    """Noise of the time between the passage of a level and that of half the slip (s): noise over velocity at both.

    ``times`` are those of LEVELS counted from half the slip (s), ``size`` is the slip (m), ``noise`` of a sample (m).
    """
    middle = int(np.searchsorted(LEVELS, 0.5))
    levels = np.insert(LEVELS, middle, 0.5)
    t = np.insert(times, middle, 0.0)
    span = t[-1] - t[0]
    if not (np.isfinite(t).all() and span > 0 and size > 0):
        return np.zeros(times.size)
    slowness = np.abs(np.gradient(t, levels * size))
    own = np.minimum(noise * slowness, span)  # no passage can be off by more than the slip lasts
    return np.hypot(np.delete(own, middle), own[middle])


def _stack(run: tuple, number: int, width: int, nodes: int, layout: Layout) -> tuple:
    """One run's records as arrays, padded to ``width`` cycles and ``nodes`` nodes of the load point."""
    (times, positions), records, virgin, stiffness, stretch = run
    n = len(records)
    pad = width - n
    last = records[-1]["stop"]

    def column(key: str, fill: float) -> np.ndarray:
        return np.array([r[key] for r in records] + [fill] * pad, float)

    while times.size < nodes:  # more nodes on the last piece change nothing
        step = max(times[-1] - times[-2], 1e-3)
        slope = (positions[-1] - positions[-2]) / (times[-1] - times[-2])
        times, positions = np.append(times, times[-1] + step), np.append(positions, positions[-1] + slope * step)
    cycles = Cycles(
        start=column("start", last),
        position=column("position", 0.0),
        limit=column("limit", last + 1e-6),
        least_slip=column("least_slip", 1.0),
        ends=np.arange(width) < n,
        used=np.arange(width) < n,
        load_times=times,
        load_positions=positions,
        stiffness=np.array(np.nan if stiffness is None else stiffness),
        virgin=np.array(virgin),
        run=np.array(number),
        stretch=np.array(stretch),
    )
    filler = jax.tree.map(lambda a: np.asarray(a), records[-1]["anchors"])
    anchors = jax.tree.map(lambda *a: np.stack(a), *[r["anchors"] for r in records], *[filler] * pad)

    def rows(key: str) -> np.ndarray:
        return np.stack([r[key] for r in records] + [np.zeros(layout.size)] * pad)

    return cycles, anchors, rows("values"), rows("valid") > 0, np.maximum(rows("sensor"), 1e-15)
