"""Events of a trace: onset, slip, arrest, and the phases between, by one estimator for both data and model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...system.units import shown, to_si
from ..drive import Drive
from ..resolution import noise_level
from ..trace import Trace
from .choose_settings import choose_settings
from .downsampling import reduce_trace, thin
from .event_shape import LEVELS, Shape, Shapes, crept, event_shapes
from .find_slips import directions, half_of, pick
from .kinematics import Array, block_motion, position_at, velocity
from .phases import divide
from .records import PHASES, Dropped, Event, Segmentation, Settings
from .ringing import LAWS

__all__ = [
    "LAWS",
    "LEVELS",
    "PHASES",
    "Dropped",
    "Event",
    "Segmentation",
    "Settings",
    "Shape",
    "Shapes",
    "block_motion",
    "choose_settings",
    "crept",
    "event_shapes",
    "position_at",
    "reduce_trace",
    "segment",
    "segment_motion",
    "thin",
    "velocity",
]

_COMPLETE = 0.5  # share of the way that slips should make up for the threshold to have found them all
_STOPLESS = 0.2  # share of slips without a zero of velocity beyond which none is asked for
# slips that make up less than this share of the way and are smaller than so many noise levels are no stick-slip
_ACCIDENTAL = ((0.3, 30.0), (0.1, 100.0))


def segment(
    trace: Trace,
    *,
    spring_stiffness: float | str | None = None,
    minimum_slip: float | str | None = None,
    settings: Settings | None = None,
) -> Segmentation:
    """Events and phases of a trace.

    Args:
        trace: with at least one signal of the block.
        spring_stiffness: N/m or text, for traces of spring force alone; default the trace's, else from the rate of
            loading.
        minimum_slip: m or text such as ``"2 um"``; smaller slips are left out (default: 10 noise levels, and a tenth of
            the large slips).
        settings: those of another segmentation: give the measurement's when segmenting the model's trace.

    Raises:
        InputError: a unit that cannot be read.
    """
    if spring_stiffness is not None:
        spring_stiffness = to_si(spring_stiffness, "N/m", key="spring_stiffness")
    if minimum_slip is not None:
        minimum_slip = to_si(minimum_slip, "m", key="minimum_slip")
    gain = settings.gain if settings is not None else None
    position, drive, gain, unit = block_motion(trace, spring_stiffness, gain)

    def run(settings: Settings) -> Segmentation:
        return segment_motion(
            trace.time, position, drive, settings, name=trace.name, virgin=trace.virgin, missing=trace.missing
        )

    if settings is not None:
        return run(settings)
    noise, count = trace.noise, trace.resolution
    if gain is not None and trace.leading == "spring_force":
        noise, count = (None if v is None else v / gain for v in (noise, count))
    elif trace.leading != "displacement":
        noise = count = None
    if noise is None:
        noise = noise_level(position, count)
    smallest = minimum_slip if minimum_slip is not None else trace.minimum_slip

    def choose(slow: bool) -> Settings:
        return choose_settings(
            trace.time, position, drive, noise, count, minimum_slip=smallest, gain=gain, unit=unit, slow=slow
        )

    result = run(choose(False))
    moved = _path(position, result.settings.noise)
    if drive is not None and _slipped(result.events) < _COMPLETE * moved:
        other = run(choose(True))  # the threshold for fast slips finds only part of the motion, if any
        if _slipped(other.events) > _slipped(result.events) + 0.1 * moved:
            result = other
    stopless = sum(event.arrest == "drive" for event in result.events)
    if stopless > _STOPLESS * len(result.events):
        # one kind of arrest for the whole trace: slips that end in two ways cannot be compared
        result = run(replace(result.settings, arrest="drive"))
    # the limit found on this trace holds for the model's trace too
    return replace(result, settings=replace(result.settings, relative=0.0))


def _slipped(events: Sequence[Event]) -> float:
    return sum(event.slip for event in events)


def segment_motion(
    time: Array,
    position: Array,
    drive: Drive | None,
    settings: Settings,
    *,
    name: str = "",
    virgin: bool = False,
    missing: Sequence[float] = (),
) -> Segmentation:
    """Events and phases from arrays; a pure function, the same for data and model.

    Args:
        time, position: s and m, shape (n,), time strictly increasing.
        drive: the load point, or None.
        settings: see `choose_settings`.
    """
    speed = velocity(time, position, half_of(time, settings))
    way = directions(time, position, drive)
    if isinstance(way, np.ndarray) or way < 0:
        speed *= way
    events, dropped, settings = pick(time, position, speed, drive, settings, tuple(missing))
    regime, reason = _regime(time, position, drive, settings, events)
    if events and regime in ("continuous sliding", "no slip"):
        why = "single slips amid steady sliding, within what noise and tremor of the drive make"
        dropped.append(Dropped("slips", len(events), f"first at {events[0].t_onset:.6g} s", why))
        events = []
    idle = "continuous sliding" if regime == "continuous sliding" else "stick"
    phases = divide(time, speed, drive, settings, events, virgin=virgin, idle=idle)
    kept = tuple(events), tuple(phases), tuple(dropped)
    return Segmentation(name, *kept, regime, reason, settings, _warnings(events, virgin))


def _regime(
    time: Array, position: Array, drive: Drive | None, settings: Settings, events: list[Event]
) -> tuple[str, str]:
    """What kind of motion it is, and the numbers that say so."""
    moved = _path(position, settings.noise)
    slipped = _slipped(events)
    middle = float(np.median([event.slip for event in events])) if events else 0.0
    chance = any(slipped < share * moved and middle < levels * settings.noise for share, levels in _ACCIDENTAL)
    if events and not chance:
        rests = [event.stick_time / max(event.duration, 1e-300) for event in events[1:]]
        text = f"{len(events)} slip{'s' if len(events) > 1 else ''}, median {shown(middle, settings.unit, 3)}"
        if rests and float(np.median(rests)) < 1.0:
            return "oscillation", text + ", but the block rests for less time than it slips"
        if slipped < 0.5 * moved and len(events) > 1:
            return "oscillation", text + f", which make up only {100 * slipped / moved:.0f} % of the block's travel"
        return "stick-slip", text
    if drive is None:
        return "no slip", f"the velocity never passes {shown(settings.threshold, settings.unit + '/s', 3)}"
    pulled = _path(np.asarray(drive.position(time)), 0.0)
    share = moved / pulled if pulled > 0 else 0.0
    ways = (float(position[-1] - position[0]), float(np.diff(drive.position(time[[0, -1]]))[0]))
    if share > 0.2 and ways[0] * ways[1] < -0.04 * ways[1] ** 2:
        return "no slip", "the block moves against its drive: the sign of one of them is wrong"
    if share > 0.5:
        part = f" ({100 * share:.0f} % of its travel)" if share < 1.2 else ""
        return "continuous sliding", f"the block follows the drive{part} without slips"
    return "no slip", f"the block moves {100 * share:.2g} % of the drive's travel and never slips"


def _path(position: Array, noise: float, points: int = 1000) -> float:
    """Length of the way travelled, reversals included, noise left out as far as its size is known."""
    stride = max(1, position.size // points)
    steps = np.abs(np.diff(position[::stride]))
    return max(float(np.sum(steps[steps > 6 * noise])), abs(float(position[-1] - position[0])))


def _warnings(events: list[Event], virgin: bool) -> tuple[str, ...]:
    if not events:
        return ("no event: nothing but creep or sliding can be fitted",)
    if len(events) == 1:
        return ("one event: no recurrence, and " + ("virgin loading only" if virgin else "no complete stick phase"),)
    return ()
