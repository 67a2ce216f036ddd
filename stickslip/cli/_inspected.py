"""What ``inspect`` prints: the table of traces, a drawing and a table of events of each, what the data can tell."""

from __future__ import annotations

import math
import sys
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import get_terminal_size
from typing import Any

import numpy as np

from ..system.units import PREFIXES, power_for, takes_prefix
from . import show
from ._sketch import sketch

MOST_EVENTS = 12  # rows of a table; more are in the JSON and in the report
# key of an event, head of its column
_COLUMNS = (
    ("t_onset", "onset"), ("recurrence", "since"), ("hold_time", "held"), ("slip", "slip"), ("peak_velocity", "peak"),
    ("rise_time", "5-97 %"), ("overshoot", "over"), ("ring_frequency", "ring"), ("decay_time", "decay"),
    ("hold_moved", "in hold"),
)  # fmt: skip
_MEANINGS = {
    "recurrence": "since: time since the onset before",
    "hold_time": "held: how long the drive stood still",
    "peak_velocity": "peak: greatest velocity",
    "rise_time": "5-97 %: time between these shares of the slip",
    "overshoot": "over: how far the arrest lies beyond where the block settles",
    "ring_frequency": "ring, decay: frequency of the ring-down and time in which it falls by a factor e",
    "hold_moved": "in hold: displacement while the drive stood still",
}
Scales = dict[tuple[str, str], tuple[int, str]]
_ROWS = "scatter: from event to event; sensor: what its noise alone makes"


def width() -> int:
    """Columns of the terminal; where there is none, enough for every table."""
    return min(get_terminal_size().columns, 118) if sys.stdout.isatty() else 100


def text(result: Mapping[str, Any], variables: Mapping[str, tuple], out: Path | None, columns: int) -> str:
    """Everything, as lines no longer than ``columns`` where words allow."""
    rows = result["traces"]
    lines = [f"{result['title']}: {len(rows)} trace{'s' * (len(rows) != 1)}", "", *_traces(rows, columns)]
    scales = _scales(rows)
    for i, row in enumerate(rows):
        heading = f"{row['name']}: {row['regime']} ({row['reason']})"
        lines += ["", *_fold(heading, columns), *_drawing(variables, i, columns), *_events(row, scales, columns)]
        said = [*(f"warning: {w}" for w in row["warnings"]), *(f"read: {w}" for w in row["notes"])]
        said += [f"repaired: {w}" for w in row["repairs"]]
        said += [f"left out: {w}" for w in row["dropped"]]
        if row.get("ripple", {}).get("lines"):
            said.append(row["ripple"]["text"])
        for line in said:
            lines += _fold(f"{row['name']}: {line}", columns)
    shown = {key for row in rows for key, _ in _shown(_with_holds(row))}
    if shown:
        lines += ["", *_fold("; ".join([*(m for key, m in _MEANINGS.items() if key in shown), _ROWS]) + ".", columns)]
    lines.append("")
    for heading, told in (
        ("The motion contradicts the file:", [found["sentence"] for found in result["rig"]]),
        ("The data can tell:", result["can"]),
        ("They cannot:", result["cannot"]),
    ):
        if told:
            lines.append(heading)
            for line in told:
                lines += _fold(f"- {line}", columns, "  ")
    last = "With --out FOLDER: pictures of every trace, report.html, and all events in result.json."
    if out is not None:
        last = f"written to {out}: report.html, result.json, arrays.nc and a picture of every trace"
    lines += ["", *_fold(last, columns)]
    return "\n".join(line.rstrip() for line in lines)


def _fold(line: str, columns: int, indent: str = "  ") -> list[str]:
    return textwrap.wrap(
        line, max(columns, 20), subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def _traces(rows: Sequence[Mapping[str, Any]], columns: int) -> list[str]:
    """The table of traces; on narrow terminals the columns that matter least are left out."""
    q = show.quantity
    header = ["trace", "slips", "drive", "motion", "length", "sampling", "signal"]
    cells = [
        [
            row["name"],
            str(len(row["events"])),
            q(row["drive_velocity"], "m/s", 3),
            row["regime"],
            f"{_number(row['duration'], 0, 3)} s" if row["duration"] > 1 else q(row["duration"], "s", 3),
            q(row["sampling_rate"], "Hz", 3),
            ", ".join(s.replace("_", " ") for s in row["signals"]),
        ]
        for row in rows
    ]
    while len(header) > 2 and len(_left(header, cells)[0]) > columns:
        header, cells = header[:-1], [row[:-1] for row in cells]
    return _left(header, cells)


def _left(header: list[str], rows: list[list[str]]) -> list[str]:
    widths = [max(len(r[i]) for r in [header, *rows]) for i in range(len(header))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)) for r in [header, *rows]]
    return [lines[0], "  ".join("-" * w for w in widths), *lines[1:]]


def _drawing(variables: Mapping[str, tuple], number: int, columns: int) -> list[str]:
    """The trace in four rows of characters: the spring's elongation where the drive is known, else the position."""
    key = f"trace{number}_whole"
    if f"{key}_time" not in variables:
        return []
    t, x = (np.asarray(variables[f"{key}_{name}"][1]) for name in ("time", "position"))
    label, unit = "position", str(variables[f"{key}_position"][2]["units"])
    if f"{key}_drive" in variables:
        x, label = np.asarray(variables[f"{key}_drive"][1]) - x, "load point less position"
    power, symbol = _scale([float(np.ptp(x))], unit)
    marks = [f"{_number(float(np.ptp(x)), power, 3)} {symbol}", "0"]
    margin = max(len(m) for m in marks) + 1
    drawn = sketch(t, x, columns=max(min(columns, 100) - margin - 1, 10))
    left = [marks[0], *[""] * (len(drawn) - 2), marks[1]]
    lines = [f"{m.rjust(margin - 1)} {line}" for m, line in zip(left, drawn, strict=True)]
    return [*lines, f"{' ' * margin}{label}, {_number(float(t[-1] - t[0]), 0, 3)} s"]


def _scale(values: Sequence[float], unit: str) -> tuple[int, str]:
    """Power of ten and symbol of the unit that suits most of the values."""
    known = sorted(abs(v) for v in values if v is not None and math.isfinite(v) and v != 0)
    if not known or not takes_prefix(unit):
        return 0, unit
    power = power_for(known[len(known) // 2], 9, 0 if unit == "s" else 9)
    return power, f"{PREFIXES[power]}{unit}"


def _scales(rows: Sequence[Mapping[str, Any]]) -> Scales:
    """Power of ten and symbol for every column and its SI unit, the same in the tables of all traces."""
    values: dict[tuple[str, str], list[float]] = {}
    sensor: dict[tuple[str, str], float] = {}
    for row in rows:
        units = _units(row)
        for key, facts in row["features"].items():
            if _known(facts.get("sensor")):
                column = (key, units.get(key, ""))
                sensor[column] = max(sensor.get(column, 0.0), facts["sensor"])
        for event in _with_holds(row):
            for key, _ in _COLUMNS:
                if _known(event[key]):
                    values.setdefault((key, units[key]), []).append(event[key])
    # values below what the sensor can tell are shown on its scale
    return {
        column: _scale([max(abs(v), sensor.get(column, 0.0)) for v in known], column[1])
        for column, known in values.items()
    }


def _units(row: Mapping[str, Any]) -> dict[str, str]:
    return {**row["units"], "hold_moved": row["units"]["hold_motion"]}


def _events(row: Mapping[str, Any], scales_of: Scales, columns: int) -> list[str]:
    """The table of events: a row each, then median, scatter and noise."""
    events = _with_holds(row)
    if not events:
        return []
    units = _units(row)
    features = {**row["features"], "hold_moved": row["features"]["hold_motion"]}
    shown = _shown(events)
    scales = {key: scales_of[key, units[key]] for key, _ in shown}
    body: list[list[str]] = []
    kept = events if len(events) <= MOST_EVENTS else events[: MOST_EVENTS - 2]
    for e in kept:
        values = {**e, "hold_time": e["hold_time"] or None}
        cells = [_number(values[key], scales[key][0], 6 if key == "t_onset" else 4) for key, _ in shown]
        body.append([str(e["index"] + 1), *cells])
    for name in ("median", "scatter", "sensor"):
        digits = 4 if name == "median" else 2
        cells = [_number(features.get(key, {}).get(name), scales[key][0], digits) for key, _ in shown]
        if any(c != "-" for c in cells) and len(events) > 1:
            body.append([name, *cells])
    header = [["event", *(head for _, head in shown)], ["", *(scales[key][1] for key, _ in shown)]]
    lines = _right([*header, *body], columns)
    if len(events) > len(kept):
        lines.insert(2 + len(kept), f"... {len(events) - len(kept)} more: --json, or the report of --out")
    names = {"rise_time": "5-97 % time", "overshoot": "overshoot", "ring_frequency": "ring-down", "decay_time": "decay"}
    missing = [f"no {name}: {why}" for key, name in names.items() if (why := features[key]["missing"])]
    if row["decay_law"]:
        lines += _fold(f"decay of the ring-downs: {row['decay_law']}", columns)
    if "ring" in " ".join(missing):
        missing = [m for m in missing if not m.startswith("no decay")]
    for line in missing:
        lines += _fold(line, columns)
    return lines


def _with_holds(row: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [{**e, "hold_moved": _largest(e["hold_motion"])} for e in row["events"]]


def _shown(events: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Columns in which some event has something."""
    return [(key, head) for key, head in _COLUMNS if any(_known(e[key]) and e[key] != 0 for e in events)]


def _right(rows: list[list[str]], columns: int) -> list[str]:
    """Right-aligned columns, one blank between them where two do not fit; the last ones below where one does not."""
    widths = [max(len(r[i]) for r in rows) for i in range(len(rows[0]))]
    gap = "  " if sum(widths) + 2 * (len(widths) - 1) <= columns else " "
    most = len(widths)
    while most > 2 and sum(widths[:most]) + len(gap) * (most - 1) > columns:
        most -= 1
    lines = [gap.join(c.rjust(w) for c, w in zip(r[:most], widths[:most], strict=True)) for r in rows]
    if most < len(widths):
        rest = [[r[0], *r[most:]] for r in rows]
        lines += ["", *_right(rest, columns)]
    return lines


def _known(value: Any) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value)


def _number(value: Any, power: int, digits: int = 4) -> str:
    if not _known(value):
        return "-"
    scaled = value / 10.0**power
    if scaled == 0:
        return "0"
    if abs(scaled) < 1e-3:
        return f"{scaled:.3f}"  # far below what its column is about
    return f"{scaled:.{max(min(digits - 1 - math.floor(math.log10(abs(scaled))), 6), 0)}f}"


def _largest(values: Sequence[float]) -> float:
    known = [v for v in values if math.isfinite(v)]
    return max(known, key=abs) if known else float("nan")
