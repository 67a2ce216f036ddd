"""A trace and its events as plain data, for JSON, tables and reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...data.checks.spring_force import stick_gain
from ...data.segment import LEVELS, Event, Segmentation, Shape, Shapes, event_shapes
from ...data.segment.left_out import unused_channels
from ...data.trace import Trace

_OF_EVENT = (
    "index", "t_onset", "t_arrest", "duration", "slip", "recurrence", "stick_time", "peak_velocity", "hold_time",
    "drive_position", "x_onset", "x_arrest", "direction",
)  # fmt: skip
_TIMES = (
    "t_onset", "t_arrest", "duration", "recurrence", "stick_time", "hold_time", "holds", "slip_times", "rise_time",
    "decay_time", "creep_before",
)  # fmt: skip
_LENGTHS = (
    "x_onset", "x_arrest", "slip", "drive_position", "overshoot", "ring_amplitude", "creep", "hold_motion"
)  # fmt: skip
_OF_TRACE = (
    "duration", "sampling_rate", "resolution", "noise", "walk", "hum", "drive_velocity", "spring_stiffness", "virgin",
    "role",
)  # fmt: skip
FEATURES = (
    "slip", "recurrence", "peak_velocity", "rise_time", "overshoot", "ring_frequency", "decay_time", "creep",
    "hold_motion",
)  # fmt: skip


def event_units(unit: str = "m") -> dict[str, str]:
    """Unit of every number of an event; ``unit`` is that of the segmentation's positions."""
    known = {"peak_velocity": f"{unit}/s", "ring_frequency": "Hz", "direction": "1", "index": "1", "decay_law": "1"}
    return dict.fromkeys(_TIMES, "s") | dict.fromkeys(_LENGTHS, unit) | known


def _describe_event(event: Event, shape: Shape) -> dict[str, Any]:
    ring = shape.ring
    return {
        **{name: getattr(event, name) for name in _OF_EVENT},
        "slip_times": shape.slip_times.tolist(),
        "rise_time": float(shape.slip_times[-1] - shape.slip_times[0]),
        "overshoot": shape.overshoot,
        "ring_frequency": ring.frequency if ring else float("nan"),
        "ring_amplitude": ring.amplitude if ring else float("nan"),
        "decay_law": ring.law if ring else "",
        "decay_time": ring.decay_time if ring else float("nan"),
        "creep": shape.creep.tolist(),
        "holds": [list(hold) for hold in event.holds],
        "hold_motion": list(shape.hold_motion),
        "warnings": list(event.warnings),
    }


def feature_table(events: Sequence[Mapping[str, Any]], shapes: Shapes) -> dict[str, dict[str, Any]]:
    """For every feature: in how many events it is there, its median, its scatter, the sensor's share, and why not.

    Scatter is 1.48 median deviations from event to event: realisation and conditions together. Of creep, which is a
    curve, and of holds, which may be many, the largest of an event counts.
    """
    out = {}
    for name in FEATURES:
        values = np.array([_one_number(event[name]) for event in events], float)
        known = values[np.isfinite(values)]
        middle = float(np.median(known)) if known.size else float("nan")
        out[name] = {
            "events": int(known.size),
            "median": middle,
            "scatter": _scatter(known, middle),
            "sensor": shapes.noise.get(name, float("nan")),
            "missing": "" if known.size else _why(name, shapes, len(events)),
        }
    return out


def _scatter(known: np.ndarray, middle: float) -> float:
    if known.size < 3:
        return float("nan")
    spread = 1.4826 * float(np.median(np.abs(known - middle)))
    return spread if spread > 1e-7 * abs(middle) else 0.0  # below that it is rounding


def _one_number(value: Any) -> float:
    if not isinstance(value, list):
        return float(value)
    known = [v for v in value if np.isfinite(v)]
    return max(known, key=abs) if known else float("nan")


def _why(name: str, shapes: Shapes, events: int) -> str:
    """Why the data do not give a feature."""
    if events == 0:
        return "no slip"
    if name == "recurrence":
        return "one slip"
    keys = {"rise_time": "slip_times", "ring_frequency": "ring", "decay_time": "ring"}
    if name == "decay_time" and "ring" not in shapes.missing:
        return "the ring-downs do not fall far enough above the noise"
    return shapes.missing.get(keys.get(name, name), "no event allows it")


def describe_trace(trace: Trace, found: Segmentation) -> dict[str, Any]:
    """Everything `inspect` says of a trace; numbers in SI unless ``units`` says otherwise."""
    signals = [n for n in ("displacement", "velocity", "spring_force") if getattr(trace, n) is not None]
    shapes = event_shapes(trace, found)
    events = [_describe_event(event, shape) for event, shape in zip(found.events, shapes.events, strict=True)]
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
        **{name: getattr(trace, name) for name in _OF_TRACE},
        "regime": found.regime,
        "reason": found.reason,
        "units": event_units(found.settings.unit),
        "settings": {
            "onset_threshold": found.settings.threshold,
            "window": found.settings.window,
            "minimum_slip": found.settings.minimum_slip,
        },
        "levels": list(LEVELS),
        "creep_before": shapes.creep_before.tolist(),
        "ring_frequency": shapes.frequency,
        "decay_law": shapes.decay,
        "features": feature_table(events, shapes),
        "events": events,
        "dropped": [*(str(d) for d in found.dropped), *unused_channels(trace)],
        "repairs": [str(r) for r in trace.repairs],
        "warnings": [*trace.warnings, *found.warnings],
        "stick_gain": stick_gain(trace, found),
    }
