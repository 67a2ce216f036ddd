"""Single creep processes cut out of a trace: from the end of the ring-down to where the block reaches a given speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ...data.segment import Dropped, Event, Segmentation, block_motion, position_at
from ...data.segment.kinematics import half_window, velocity_noise
from ...data.trace import Trace
from ...system.units import shown

Array = NDArray[np.float64]
V_LIM = 1e-6  # m/s, where the paper ends the comparison
RINGING = 0.25  # s after an arrest that are left out, or this share of a stick that is shorter
SHARE = 0.3
LONGEST = 0.05  # share of a stick that the window of a velocity may take to either side
LEAST_NOISE = 12.0  # creep smaller than this many noise levels of a mean is not fitted
POINTS = 160
LEAST_WINDOW = 10  # samples
Sampling = Literal["log", "uniform"]


@dataclass(frozen=True)
class CreepProcess:
    """Creep before one slip.

    Args:
        trace, event: where it comes from.
        time: s before the moment at which the block reaches ``v_lim`` (negative), increasing, shape (n,).
        displacement: m, relative to the position at that moment, shape (n,).
        velocity: of the drive, m/s.
        v_lim: m/s, speed of the block at the end.
        noise: standard deviation of the displacements, m, shape (n,).
        virgin: whether the contact was fresh.
    """

    trace: str
    event: int
    time: Array
    displacement: Array
    velocity: float
    v_lim: float
    noise: Array
    virgin: bool

    @property
    def amplitude(self) -> float:
        """Displacement over the process, m."""
        return float(np.ptp(self.displacement))


def creep_processes(
    trace: Trace,
    segmentation: Segmentation,
    *,
    v_lim: float = V_LIM,
    points: int = POINTS,
    sampling: Sampling = "log",
) -> tuple[list[CreepProcess], list[Dropped]]:
    """Every stick that ends in a slip, as the static model is compared with it.

    The record is replaced by means over windows that lie evenly in the logarithm of the time left, so that the end,
    where most of the creep happens, has as many points as the beginning; or evenly in time, as in the paper.

    Args:
        v_lim: speed of the block at which a process ends, m/s.
        points: most points of a process.
        sampling: "log" or "uniform" windows.

    Returns:
        The processes, and those left out with the reason.
    """
    position, _, _, unit = block_motion(trace, gain=segmentation.settings.gain)
    if unit != "m":
        why = "neither the spring's stiffness nor the drive is known, so the force gives no displacement"
        return [], [Dropped("creep processes", len(segmentation.events), trace.name, why)]
    noise = segmentation.settings.noise
    step = 1.0 / trace.sampling_rate
    sticks = [e.stick_time for e in segmentation.events if np.isfinite(e.stick_time)] or [trace.duration]
    most = max(int(LONGEST * float(np.median(sticks)) / step), 1)
    half = half_window(noise, step, v_lim / 10.0, most)
    if velocity_noise(noise, half, step) > 0.5 * v_lim:
        hidden = f"{shown(noise, 'm', 2)} of noise at {shown(trace.sampling_rate, 'Hz', 3)}"
        why = f"v_lim = {shown(v_lim, 'm/s', 3)} is below the resolution ({hidden})"
        return [], [Dropped("creep processes", len(segmentation.events), trace.name, why, coarse=True)]
    kept, dropped = [], []
    for event in segmentation.events:
        outcome = _process(trace, segmentation, event, position, noise, half, v_lim, points, sampling)
        if isinstance(outcome, _Refused):
            where = f"{trace.name}, event {event.index + 1}"
            dropped.append(Dropped("creep process", 1, where, outcome.why, outcome.coarse))
        else:
            kept.append(outcome)
    return kept, dropped


class _Refused(NamedTuple):
    """Why an event has no process; ``coarse`` if a larger v_lim might be seen."""

    why: str
    coarse: bool = False


def _process(
    trace: Trace,
    found: Segmentation,
    event: Event,
    position: Array,
    noise: float,
    half: int,
    v_lim: float,
    points: int,
    sampling: Sampling,
) -> CreepProcess | _Refused:
    """One process, or why there is none."""
    time = trace.time
    first, start = _begin(trace, found, event)
    if event.holds:
        return _Refused("the drive stood still before this slip: virtual time needs a steady pull")
    if first is None:
        return _Refused("the record begins within this stick (with freshly set down contacts: virgin = true)")
    drive = trace.drive
    speed = abs(float(drive.velocity(max(event.t_onset - 1e-9, time[0])))) if drive is not None else 0.0
    if speed <= v_lim:
        return _Refused(f"the drive ({shown(speed, 'm/s', 3)}) is not faster than v_lim ({shown(v_lim, 'm/s', 3)})")
    low, high = int(np.searchsorted(time, start)), event.i_onset
    if high - low < 4 * half + 8:
        return _Refused("too few samples between ring-down and onset")
    # where x - v_lim t is smallest the isotonic fit of the velocity passes v_lim: hum and counts do not fool it
    smooth = uniform_filter1d(event.direction * position[low:high], 2 * half + 1, mode="nearest")
    i = int(np.argmin(smooth - v_lim * (time[low:high] - time[low])))
    if i < 8 or i >= high - low - 1:
        seen = f"the block never creeps through v_lim = {shown(v_lim, 'm/s', 3)} (sampled or sensed too coarsely)"
        return _Refused(seen, coarse=True)
    moment = float(time[low + i])
    there = position_at(time, position, moment, max(half, 2))
    t, u, n = _windows(
        time[low : low + i + 1] - moment, event.direction * (position[low : low + i + 1] - there), points, sampling
    )
    spread = noise / np.sqrt(n)
    amplitude = float(np.ptp(u))
    if amplitude < LEAST_NOISE * float(np.median(spread)):
        least = f"{shown(noise, 'm', 2)} a sample"
        return _Refused(f"its creep ({shown(amplitude, 'm', 2)}) does not stand out of the noise ({least})")
    virgin = trace.virgin and event.index == 0
    return CreepProcess(trace.name, event.index, t, u, speed, v_lim, spread, virgin)


def _begin(trace: Trace, found: Segmentation, event: Event) -> tuple[float | None, float]:
    """When the stick before an event began (None: unknown), and from when on it is compared (s)."""
    if event.index == 0:
        begin = float(trace.time[0])
        return (begin if trace.virgin else None), begin
    before = found.events[event.index - 1]
    calm = max((p.stop for p in found.during("ring-down") if p.event == before.index), default=before.t_arrest)
    stick = event.t_onset - before.t_arrest
    return before.t_arrest, max(calm, before.t_arrest + min(RINGING, SHARE * stick))


def _windows(t: Array, u: Array, points: int, sampling: Sampling) -> tuple[Array, Array, Array]:
    """Means over windows even in ln(time left) or in time; times, displacements and samples in each."""
    size = t.size
    spaced = np.geomspace(1, size, points + 1) if sampling == "log" else np.linspace(0, size, points + 1)
    # counted from the end, no window with fewer than so many samples
    back = np.maximum(spaced, LEAST_WINDOW * np.arange(points + 1))
    starts = np.unique(np.clip(size - np.round(back[1:]).astype(int), 0, size - 1))
    starts[0] = 0
    n = np.diff(np.append(starts, size)).astype(float)
    return np.add.reduceat(t, starts) / n, np.add.reduceat(u, starts) / n, n
