"""A trace and its events as plain data, for JSON, tables and reports."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..segment import Segmentation
from ..trace import Trace

_LENGTHS = ("x_onset", "x_arrest", "slip", "drive_position")


def event_units(unit: str = "m") -> dict[str, str]:
    """Unit of every number of an event; ``unit`` is that of the segmentation's positions."""
    units = dict.fromkeys(("t_onset", "t_arrest", "duration", "recurrence", "stick_time", "hold_time", "holds"), "s")
    units |= dict.fromkeys(_LENGTHS, unit)
    return units | {"peak_velocity": f"{unit}/s", "direction": "1", "index": "1"}


def describe_trace(trace: Trace, found: Segmentation) -> dict[str, Any]:
    """Everything `inspect` says of a trace; numbers in SI unless ``units`` says otherwise."""
    signals = [n for n in ("displacement", "velocity", "spring_force") if getattr(trace, n) is not None]
    events = [
        {
            "index": event.index,
            "t_onset": event.t_onset,
            "t_arrest": event.t_arrest,
            "duration": event.duration,
            "slip": event.slip,
            "recurrence": event.recurrence,
            "stick_time": event.stick_time,
            "peak_velocity": event.peak_velocity,
            "holds": [list(hold) for hold in event.holds],
            "hold_time": event.hold_time,
            "drive_position": event.drive_position,
            "x_onset": event.x_onset,
            "x_arrest": event.x_arrest,
            "direction": event.direction,
            "warnings": list(event.warnings),
        }
        for event in found.events
    ]
    p = trace.provenance
    return {
        "name": trace.name,
        "file": p.file,
        "sha256": p.sha256,
        "reader": p.reader,
        "columns": dict(p.columns),
        "notes": list(p.notes),
        "signals": signals,
        "samples": int(trace.time.size),
        "duration": trace.duration,
        "sampling_rate": trace.sampling_rate,
        "resolution": trace.resolution,
        "noise": trace.noise,
        "drive_velocity": trace.drive_velocity,
        "spring_stiffness": trace.spring_stiffness,
        "virgin": trace.virgin,
        "role": trace.role,
        "regime": found.regime,
        "reason": found.reason,
        "units": event_units(found.settings.unit),
        "settings": {
            "onset_threshold": found.settings.threshold,
            "window": found.settings.window,
            "minimum_slip": found.settings.minimum_slip,
        },
        "events": events,
        "dropped": [str(d) for d in found.dropped],
        "repairs": [str(r) for r in trace.repairs],
        "warnings": [*trace.warnings, *found.warnings],
        "stick_gain": stick_gain(trace, found),
    }


def stick_gain(trace: Trace, found: Segmentation) -> dict[str, float] | None:
    """Slope of the spring's force in early stick over stiffness times drive, for traces of force alone.

    While the block stands still the force must rise by c_s v0; a median slope that differs is an error of the force's
    scale, of the stiffness or of the drive's velocity (a slope above 1 cannot be creep, which only lowers it).
    """
    stiffness, drive, force = trace.spring_stiffness, trace.drive, trace.spring_force
    if trace.leading != "spring_force" or stiffness is None or drive is None or force is None or not drive.speed:
        return None
    slopes = []
    for event in found.events[1:]:
        if event.holds or not np.isfinite(event.stick_time):
            continue
        begin = event.t_onset - event.stick_time
        low, high = np.searchsorted(trace.time, [begin + 0.15 * event.stick_time, begin + 0.5 * event.stick_time])
        if high - low < 30:
            continue
        t = trace.time[low:high]
        rate = np.polynomial.polynomial.polyfit(t - t.mean(), force[low:high], 1)[1]
        slopes.append(rate / (stiffness * float(drive.velocity(t.mean()))))
    if len(slopes) < 5:
        return None
    spread = 1.4826 * float(np.median(np.abs(slopes - np.median(slopes))))
    return {
        "value": float(np.median(slopes)),
        "std": 1.2533 * spread / float(np.sqrt(len(slopes))),
        "sticks": float(len(slopes)),
    }
