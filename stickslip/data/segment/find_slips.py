"""Finding slips: onset, arrest and what lies between, by one estimator for measured and modelled traces."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...system.units import shown
from ..drive import Drive
from .kinematics import position_at
from .records import Dropped, Event, Settings

Array = NDArray[np.float64]


def half_of(time: Array, settings: Settings) -> int:
    """Samples on each side that make up the settings' window on this time base."""
    step = float(np.median(np.diff(time[:200_001])))
    return max(1, round(settings.window / step))


def directions(time: Array, position: Array, drive: Drive | None) -> Array | float:
    """+1 or -1: the way the block is pulled, one number or one for each sample."""
    if drive is None:
        return 1.0 if position[-1] >= position[0] else -1.0
    edges = np.unique(np.concatenate([time[[0, -1]], drive.times[(drive.times > time[0]) & (drive.times < time[-1])]]))
    speeds = np.diff(drive.position(edges)) / np.diff(edges)
    signs = np.sign(np.where(np.abs(speeds) > 0.05 * drive.speed, speeds, 0.0))
    if not signs.any():
        return 1.0
    last = np.maximum.accumulate(np.where(signs != 0, np.arange(signs.size), 0))
    signs = np.where(signs[last] == 0, signs[np.argmax(signs != 0)], signs[last])
    if (signs == signs[0]).all():
        return float(signs[0])
    return signs[np.clip(np.searchsorted(edges, time, side="right") - 1, 0, signs.size - 1)]


def pick(
    time: Array, position: Array, speed: Array, drive: Drive | None, settings: Settings, missing: tuple[float, ...] = ()
) -> tuple[list[Event], list[Dropped], Settings]:
    """Slips of a record in order, what was left out, and the settings with the smallest slip that was let pass.

    Onset: the velocity rises through the threshold (interpolated between samples). Arrest: its first zero after that;
    where the block does not stop within one slip's duration after it has become slower than the drive, that moment
    (for all events where the settings say so).

    Args:
        time, position: s, m, shape (n,).
        speed: velocity along the pull by `velocity` with the settings' window, m/s, shape (n,).
        missing: times after which samples are missing.
    """
    dropped: Counter[str] = Counter()
    first_at: dict[str, float] = {}

    def drop(reason: str, moment: float) -> None:
        dropped[reason] += 1
        first_at.setdefault(reason, moment)

    half = half_of(time, settings)
    above = speed > settings.threshold
    ups = np.flatnonzero(above[1:] & ~above[:-1]) + 1
    position_half = max(1, half // 3)
    stop_level = min(settings.speed, 0.5 * settings.threshold)
    resume = 0
    events: list[Event] = []
    if above[0]:
        drop("the block is already slipping when the record begins", float(time[0]))
        resume = _first(speed, 1, lambda v: v <= stop_level)[0]
    gaps = np.asarray(missing)
    for up in ups.tolist():
        if up < resume:
            continue
        below, fell = _first(speed, up, lambda v: v <= stop_level)
        zero, stopped = _first(speed, up, lambda v: v <= 0)
        if not fell and not stopped:
            drop("the slip does not end before the record does", float(time[up]))
            break
        kind, end, level = "zero", zero, 0.0
        patience = max(time[below] - time[up], 2 * settings.window)
        if settings.arrest == "drive" or not stopped or time[zero] > time[below] + patience:
            kind, end, level = "drive", below, stop_level
        resume = end + 1
        t_onset = _crossing(time, speed, up, settings.threshold)
        t_arrest = _crossing(time, speed, end, level)
        x_onset = position_at(time, position, t_onset, position_half)
        x_arrest = position_at(time, position, t_arrest, position_half)
        slip = abs(x_arrest - x_onset)
        if slip < settings.minimum_slip:
            drop(_too_small(settings.minimum_slip, settings.unit), t_onset)
            continue
        peak = up + int(np.argmax(speed[up : end + 1]))
        warnings = []
        if gaps.size and np.any((gaps >= time[max(up - half, 0)]) & (gaps < time[end])):
            warnings.append("samples are missing within the slip")
        if kind == "drive":
            warnings.append("the block does not stop after the slip; its end is where it falls behind the drive")
        way = 1 if position[end] >= position[max(up - 1, 0)] else -1
        where = float(drive.position(t_onset)) if drive is not None else float("nan")
        events.append(
            Event(
                index=len(events),
                t_onset=t_onset,
                t_arrest=t_arrest,
                x_onset=x_onset,
                x_arrest=x_arrest,
                slip=slip,
                peak_velocity=float(speed[peak]),
                t_peak=float(time[peak]),
                direction=way,
                recurrence=float("nan"),
                stick_time=float("nan"),
                holds=(),
                drive_position=where,
                i_onset=up,
                i_arrest=end,
                arrest=kind,
                warnings=tuple(warnings),
            )
        )
    events, settings = _drop_small(events, settings, drop)
    left_out = [Dropped("slips", n, f"first at {first_at[reason]:.6g} s", reason) for reason, n in dropped.items()]
    return _chain(events, time, drive), left_out, settings


def _too_small(limit: float, unit: str) -> str:
    return f"smaller than the smallest slip that counts, {shown(limit, unit, 3)}"


def _drop_small(
    events: list[Event], settings: Settings, drop: Callable[[str, float], None]
) -> tuple[list[Event], Settings]:
    """Leave out what is small beside the large slips: tremors of the ring-down and of the drive."""
    if not events:
        return [], settings
    # half of all slipped length is in slips of at least this size: many tremors cannot pull it down
    sizes = np.sort([event.slip for event in events])[::-1]
    limit = settings.relative * float(sizes[np.searchsorted(np.cumsum(sizes), 0.5 * sizes.sum())])
    for event in events:
        if event.slip < limit:
            drop(_too_small(limit, settings.unit) + f" ({settings.relative:g} of the large ones)", event.t_onset)
    kept = [event for event in events if event.slip >= limit]
    return kept, replace(settings, minimum_slip=max(settings.minimum_slip, limit))


def _chain(events: list[Event], time: Array, drive: Drive | None) -> list[Event]:
    """Number the events and give each its recurrence, stick time and holds."""
    holds = drive.holds(float(time[0]), float(time[-1])) if drive is not None else []
    shortest = 10 * float(time[-1] - time[0]) / time.size
    holds = [hold for hold in holds if hold[1] - hold[0] > shortest]
    result = []
    for index, event in enumerate(events):
        before = events[index - 1] if index else None
        since = before.t_arrest if before else float(time[0])
        inside = tuple((max(a, since), min(b, event.t_onset)) for a, b in holds if b > since and a < event.t_onset)
        event = replace(event, index=index, holds=inside)
        if before:
            waited, stuck = event.t_onset - before.t_onset, event.t_onset - before.t_arrest
            event = replace(event, recurrence=waited, stick_time=stuck)
        result.append(event)
    return result


def _first(values: Array, start: int, test: Callable[[Array], NDArray[np.bool_]]) -> tuple[int, bool]:
    """Index of the first value from ``start`` on that passes, and whether there is one (else the last index)."""
    size = 256
    while start < values.size:
        hits = test(values[start : start + size])
        if hits.any():
            return start + int(np.argmax(hits)), True
        start, size = start + size, min(2 * size, 1 << 20)
    return values.size - 1, False


def _crossing(time: Array, values: Array, i: int, level: float) -> float:
    """Time at which values cross a level between samples i - 1 and i."""
    if i == 0 or values[i] == values[i - 1]:
        return float(time[i])
    share = float(np.clip((level - values[i - 1]) / (values[i] - values[i - 1]), 0.0, 1.0))
    return float(time[i - 1] + share * (time[i] - time[i - 1]))
