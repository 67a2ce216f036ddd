"""Dividing a record into virgin loading, stick, hold, nucleation, slip and ring-down."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..drive import Drive
from .find_slips import half_of
from .kinematics import velocity_noise
from .records import Event, Phase, Settings

Array = NDArray[np.float64]


def divide(
    time: Array, speed: Array, drive: Drive | None, settings: Settings, events: list[Event], *, virgin: bool, idle: str
) -> list[Phase]:
    """Phases that follow one another without a gap, from the first sample to the last.

    Slip: onset to arrest. Nucleation: from where the block last overtook the drive (spring force at its greatest) to
    onset. Ring-down: from arrest until the velocity stays within its noise, at most half of the stick. Hold: where the
    drive stands still. Stick: the rest; before the first event of a virgin contact it is virgin loading.

    Args:
        speed: velocity along the pull, m/s, shape (n,).
        idle: kind of the whole record if there is no event.
    """
    start, stop = float(time[0]), float(time[-1])
    step = (stop - start) / (time.size - 1)
    some = speed[:: max(1, speed.size // 100_000)]
    spread = 1.4826 * float(np.median(np.abs(some - np.median(some))))  # noise that is not white, ripple of the drive
    quiet = 4 * max(velocity_noise(settings.noise, half_of(time, settings), step), spread)
    holds = [hold for hold in (drive.holds(start, stop) if drive is not None else []) if hold[1] - hold[0] > 10 * step]
    pieces: list[tuple[str, float, float, int | None]] = []
    rest = "virgin loading" if virgin else (idle if not events else "stick")
    at = start
    for event in events:
        before = events[event.index - 1] if event.index else None
        awake = _nucleation(time, speed, settings, event, quiet, at)
        if before is not None:
            calm = _ring_down(time, speed, settings, before, 0.5 * (before.t_arrest + awake), quiet)
            pieces.append(("ring-down", before.t_arrest, calm, before.index))
            at = calm
        pieces += _with_holds(rest, at, awake, holds, event.index)
        pieces.append(("nucleation", awake, event.t_onset, event.index))
        pieces.append(("slip", event.t_onset, event.t_arrest, event.index))
        at, rest = event.t_arrest, "stick"
    if events:
        calm = _ring_down(time, speed, settings, events[-1], 0.5 * (at + stop), quiet)
        pieces.append(("ring-down", at, calm, events[-1].index))
        at = calm
    pieces += _with_holds(rest, at, stop, holds, None)
    ends = np.searchsorted(time, [piece[2] for piece in pieces])
    result, first = [], 0
    for (kind, a, b, number), end in zip(pieces, ends, strict=True):
        if b > a:
            last = time.size if b >= stop else int(end)
            result.append(Phase(kind, a, b, first, last, number))
            first = last
    return result


def _with_holds(
    kind: str, start: float, stop: float, holds: list[tuple[float, float]], event: int | None
) -> list[tuple[str, float, float, int | None]]:
    pieces: list[tuple[str, float, float, int | None]] = []
    for a, b in holds:
        low, high = max(a, start), min(b, stop)
        if high > low:
            pieces += [(kind, start, low, event), ("hold", low, high, event)]
            start = high
    return [*pieces, (kind, start, stop, event)]


def _nucleation(time: Array, speed: Array, settings: Settings, event: Event, quiet: float, since: float) -> float:
    level = min(max(settings.speed, quiet), settings.threshold)
    low = int(np.searchsorted(time, since))
    slow = speed[low : event.i_onset] <= level
    if not slow.any():
        return min(since, event.t_onset)
    last = low + slow.size - 1 - int(np.argmax(slow[::-1]))
    return min(max(float(time[last]), since), event.t_onset)


def _ring_down(time: Array, speed: Array, settings: Settings, event: Event, limit: float, quiet: float) -> float:
    low, high = event.i_arrest, int(np.searchsorted(time, min(limit, event.t_arrest + 10 * event.duration)))
    if high <= low:
        return event.t_arrest
    loud = np.abs(speed[low:high]) > max(quiet, 0.02 * settings.threshold + settings.speed)
    if not loud.any():
        return event.t_arrest
    return float(time[min(low + loud.size - int(np.argmax(loud[::-1])), time.size - 1)])
