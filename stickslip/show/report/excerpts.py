"""The parts of a trace that pictures show, as arrays for a run folder: the whole, one creep, one slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...data.channels import SIGNALS
from ...data.segment import Event, Segmentation, block_motion, reduce_trace, thin
from ...data.trace import Trace
from .describe import describe_trace

OVERVIEW, ZOOM = 3000, 1500
Variables = dict[str, tuple[str, np.ndarray, dict[str, Any]]]


def trace_pieces(trace: Trace, found: Segmentation, number: int) -> Variables:
    """Variables of an xarray data set, named ``trace0_whole_time``, ``trace0_whole_position`` and so on.

    Pieces: ``whole`` (thinned so that extremes stay), ``creep`` (the stick before a middle event), ``slip`` (that event
    and its ring-down), and the events themselves. Positions are as `block_motion` gives them.
    """
    position, _, _, unit = block_motion(trace, gain=found.settings.gain)
    out: Variables = {}

    def put(piece: str, time: np.ndarray, values: np.ndarray) -> None:
        key = f"trace{number}_{piece}"
        out[f"{key}_time"] = (key, np.asarray(time, float), {"units": "s"})
        out[f"{key}_position"] = (key, np.asarray(values, float), {"units": unit})

    if trace.drive is None or unit != "m":
        put("whole", *thin(trace.time, position, OVERVIEW))
    else:
        # a saw-tooth on a long way shows only against the load point: its tips must stay
        t, gap = thin(trace.time, trace.drive.position(trace.time) - position, OVERVIEW)
        put("whole", t, trace.drive.position(t) - gap)
    if found.events:
        event = middle_event(found.events)
        before = found.events[event.index - 1].t_arrest if event.index else float(trace.time[0])
        put("creep", *thin(*_cut(trace.time, position, before, event.t_onset), ZOOM))
        ring = event.t_arrest + 1.5 * event.duration
        put("slip", *thin(*_cut(trace.time, position, event.t_onset - 0.3 * event.duration, ring), ZOOM))
        key = f"trace{number}_event"
        out[f"{key}_onset"] = (key, np.array([e.t_onset for e in found.events]), {"units": "s"})
        out[f"{key}_arrest"] = (key, np.array([e.t_arrest for e in found.events]), {"units": "s"})
    if trace.drive is not None and unit == "m":
        key = f"trace{number}_whole"
        at = out[f"{key}_time"][1]
        drive = trace.drive.position(at)
        start = out[f"{key}_position"][1][0] - drive[0]
        out[f"{key}_drive"] = (key, drive + start, {"units": "m"})
    return out


def trace_sections(traces: Sequence[Trace], segmentations: Sequence[Segmentation]) -> tuple[dict[str, Any], Variables]:
    """Entries of ``result.json`` on the traces, and the variables behind their pictures."""
    pairs = list(zip(traces, segmentations, strict=True))
    variables: Variables = {}
    for i, (trace, found) in enumerate(pairs):
        variables |= trace_pieces(trace, found, i)
    return {"traces": [describe_trace(t, s) for t, s in pairs]}, variables


def reduced_record(trace: Trace, found: Segmentation, number: int) -> Variables:
    """The whole record in short: slips at full rate, creep and holds as means over log-spaced windows.

    Variables are named ``trace0_reduced_time``, ``trace0_reduced_displacement`` and so on, for what was measured.
    """
    short, key = reduce_trace(trace, found), f"trace{number}_reduced"
    out: Variables = {f"{key}_time": (key, np.asarray(short.time), {"units": "s"})}
    for name, unit in {**SIGNALS, "drive_position": "m", "normal_load": "N"}.items():
        values = getattr(short, name)
        if values is not None:
            out[f"{key}_{name}"] = (key, np.asarray(values), {"units": unit})
    return out


def middle_event(events: Sequence[Event]) -> Event:
    """The event shown in the zooms: one of middle size, not the first where there are others."""
    order = sorted(events[1:] or events, key=lambda e: e.slip)
    return order[len(order) // 2]


def _cut(t: np.ndarray, y: np.ndarray, start: float, stop: float) -> tuple[np.ndarray, np.ndarray]:
    low, high = max(int(np.searchsorted(t, start)) - 1, 0), int(np.searchsorted(t, stop)) + 1
    return t[low:high], y[low:high]
