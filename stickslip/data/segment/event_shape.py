"""What one event looks like: course of the slip, overshoot, ring-down, and the creep and the holds before it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..trace import Trace
from .kinematics import block_motion, velocity_noise
from .records import Event, Segmentation
from .ringing import Ringing, ringing

Array = NDArray[np.float64]
LEVELS = (0.05, 0.10, 0.25, 0.50, 0.75, 0.90, 0.97)  # shares of a slip whose passage is timed
SLIP_SAMPLES = 20  # fewer within a slip do not show its course
CREEP_POINTS = 16
# in slip durations: when the block has settled after an arrest, and over what its place is then averaged
REST, REST_WIDTH = 2.53, 0.66
NEAREST = 0.13  # creep is followed up to this share of a slip's duration before the onset
EDGE = 0.03  # share of a hold over which its ends are averaged


@dataclass(frozen=True)
class Shape:
    """Of one event; times in s, positions in m (or the settings' unit) along the slip; NaN where the data do not tell.

    Attributes:
        slip_times: passages of LEVELS of the slip, counted from the onset, shape (7,).
        overshoot: position at the arrest less that where the block settles.
        ring: the ring-down after the arrest, or None.
        creep: displacement still to come until the onset, at the segmentation's common times before it, shape (16,).
        hold_motion: displacement within each hold before the event.
    """

    slip_times: Array
    overshoot: float
    ring: Ringing | None
    creep: Array
    hold_motion: tuple[float, ...]


@dataclass(frozen=True)
class Shapes:
    """Of all events of a trace.

    Attributes:
        events: one for each, in order.
        creep_before: times before an onset at which creep is given (s), log-spaced, shape (16,).
        frequency: of the ring-downs together (Hz), or NaN.
        decay: the law that describes most of them best, or "".
        missing: what the data do not give -> why.
        noise: standard deviation that the sensor alone gives a feature (s, or m), by name.
    """

    events: tuple[Shape, ...]
    creep_before: Array
    frequency: float
    decay: str
    missing: dict[str, str]
    noise: dict[str, float]


def event_shapes(trace: Trace, found: Segmentation) -> Shapes:
    """Shapes of a trace's events, by the same estimator for measured and modelled traces."""
    nothing = np.full(CREEP_POINTS, np.nan)
    if not found.events:
        return Shapes((), nothing, float("nan"), "", {}, {})
    position, _, _, _ = block_motion(trace, gain=found.settings.gain)
    time, missing = trace.time, dict[str, str]()
    rate = trace.sampling_rate
    duration = float(np.median([e.duration for e in found.events]))
    samples = duration * rate
    if samples < SLIP_SAMPLES:
        missing["slip_times"] = f"{samples:.0f} samples a slip, {SLIP_SAMPLES} are needed"
    rings, frequency, decay, why = ringing(time, position, found, duration)
    if why:
        missing["ring"] = why
    if not any(e.holds for e in found.events):
        missing["hold_motion"] = "the drive never stands still" if trace.drive is not None else "the drive is not known"
    sticks = [e.stick_time for e in found.events if np.isfinite(e.stick_time)] or [found.events[0].t_onset - time[0]]
    longest, nearest = 0.9 * float(np.median(sticks)), max(NEAREST * duration, 2.0 / rate)
    before = np.geomspace(nearest, longest, CREEP_POINTS) if longest > 2 * nearest else nothing
    if not np.isfinite(before).all():
        missing["creep"] = "sticks are too short to separate creep from slips"
    shapes = []
    for event, ring in zip(found.events, rings, strict=True):
        times = _passages(time, position, event) if samples >= SLIP_SAMPLES else np.full(len(LEVELS), np.nan)
        overshoot = _overshoot(time, position, found, event, duration)
        creep = _creep(time, position, found, event, before)
        shapes.append(Shape(times, overshoot, ring, creep, _hold_motion(time, position, event)))
    if all(np.isnan(s.overshoot) for s in shapes):
        missing["overshoot"] = "the block does not stop, or not for long enough to determine its rest position"
    return Shapes(tuple(shapes), before, frequency, decay, missing, _noise(found, shapes, duration, rate))


def _passages(time: Array, position: Array, event: Event) -> Array:
    """Times from the onset to the last passage of each level before the arrest, s."""
    low, high = max(event.i_onset - 2, 0), min(event.i_arrest + 1, time.size)
    t = time[low:high]
    share = event.direction * (position[low:high] - event.x_onset) / event.slip
    out = []
    for level in LEVELS:
        # the last passage: noise reaches a low level before the block does
        below = np.flatnonzero(share < level)
        j = int(below[-1]) + 1 if below.size else 0
        if not 0 < j < share.size:
            out.append(float("nan"))
            continue
        out.append(t[j - 1] + (level - share[j - 1]) / (share[j] - share[j - 1]) * (t[j] - t[j - 1]) - event.t_onset)
    return np.array(out)


def _after(found: Segmentation, event: Event, end: float) -> float:
    """When the next slip begins, or the record ends."""
    later = event.index + 1
    return found.events[later].t_onset if later < len(found.events) else end


def _overshoot(time: Array, position: Array, found: Segmentation, event: Event, duration: float) -> float:
    if event.arrest != "zero":
        return float("nan")  # the block did not stop, so its position there is no turning point
    return event.direction * (event.x_arrest - _settled(time, position, found, event, duration))


def _settled(time: Array, position: Array, found: Segmentation, event: Event, duration: float) -> float:
    """Mean position (m) some slip durations after the arrest, where ringing averages out; NaN where it slips before."""
    centre, width = event.t_arrest + REST * duration, REST_WIDTH * duration
    if centre + width > _after(found, event, float(time[-1])):
        return float("nan")
    low, high = np.searchsorted(time, [centre - width / 2, centre + width / 2])
    return float(np.mean(position[low:high])) if high - low >= 3 else float("nan")


def crept(trace: Trace, found: Segmentation) -> Array:
    """Displacement from where the block has settled after a slip to the next onset, along that slip (m).

    Args:
        trace, found: a run and its events.

    Returns:
        One for each event, shape (n,); NaN for the first, and where the block does not settle.
    """
    out = np.full(len(found.events), np.nan)
    if out.size:
        position, _, _, _ = block_motion(trace, gain=found.settings.gain)
        duration = float(np.median([e.duration for e in found.events]))
        for i, (before, event) in enumerate(pairwise(found.events), 1):
            rest = _settled(trace.time, position, found, before, duration)
            out[i] = event.direction * (event.x_onset - rest)
    return out


def _creep(time: Array, position: Array, found: Segmentation, event: Event, before: Array) -> Array:
    """Displacement from each time before the onset to the onset, m; NaN where the stick had not yet begun."""
    since = float(time[0]) if event.index == 0 else found.events[event.index - 1].t_arrest
    out = np.full(before.size, np.nan)
    for k, ahead in enumerate(before):
        moment, width = event.t_onset - ahead, 0.12 * ahead
        if not moment - width / 2 >= since:
            continue
        there = _mean(time, position, moment - width / 2, moment + width / 2, moment)
        out[k] = event.direction * (event.x_onset - there)
    return out


def _hold_motion(time: Array, position: Array, event: Event) -> tuple[float, ...]:
    out = []
    for start, stop in event.holds:
        edge = EDGE * (stop - start)
        first = _mean(time, position, start, start + edge, start)
        out.append(event.direction * (_mean(time, position, stop - edge, stop, stop - edge) - first))
    return tuple(out)


def _mean(time: Array, position: Array, start: float, stop: float, moment: float) -> float:
    """Mean position between two times, or that at a ``moment`` where no sample lies between them."""
    low, high = np.searchsorted(time, [start, stop])
    return float(np.mean(position[low:high])) if high > low else float(np.interp(moment, time, position))


def _noise(found: Segmentation, shapes: list[Shape], duration: float, rate: float) -> dict[str, float]:
    """What the sensor's noise makes of a feature: noise over velocity for times, noise of means for positions."""
    noise = found.settings.noise
    ends = noise / np.sqrt(2 * max(1, round(found.settings.window * rate / 3)) + 1)
    rest = noise / np.sqrt(max(rate * REST_WIDTH * duration, 1.0))
    out = {"slip": float(np.sqrt(2.0) * ends), "overshoot": float(np.hypot(ends, rest))}
    out["creep"] = out["slip"]
    # of the velocity by which onsets are told, and of the moment it passes a threshold as a half cosine begins
    step = 1.0 / rate
    fast = velocity_noise(noise, max(1, round(found.settings.window * rate)), step)
    peak = float(np.median([e.peak_velocity for e in found.events]))
    out["peak_velocity"] = fast
    onset = float(np.hypot(fast * duration / (np.pi * max(peak, 1e-300)), step / np.sqrt(12.0)))
    out["recurrence"] = float(np.sqrt(2.0) * min(onset, duration))
    held = [stop - start for e in found.events for start, stop in e.holds]
    if held:
        out["hold_motion"] = float(noise * np.sqrt(2.0 / max(rate * EDGE * np.median(held), 1.0)))
    known = [s.ring for s in shapes if s.ring is not None and np.isfinite(s.ring.decay_time) and s.ring.amplitude > 0]
    if known:
        # the least a decaying sine in white noise allows (Cramer and Rao)
        lasts, loud = (float(np.median([getattr(r, name) for r in known])) for name in ("decay_time", "amplitude"))
        turn = noise / loud * np.sqrt(8.0 / (rate * lasts**3))
        out["ring_frequency"], out["decay_time"] = float(turn / (2.0 * np.pi)), float(turn * lasts**2)
    times = np.array([s.slip_times for s in shapes])
    if np.isfinite(times).any():
        middle = np.nanmedian(times, axis=0)
        size = float(np.median([e.slip for e in found.events]))
        slowness = np.abs(np.gradient(middle, np.array(LEVELS) * size))
        out["rise_time"] = float(np.hypot(noise * slowness[0], noise * slowness[-1]))
    return out
