"""``stickslip inspect``: the traces of a campaign, their events, what was mended, and what the data can tell."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..runstore import file_record, json_text, open_run, refuse_existing, versions
from . import show

if TYPE_CHECKING:
    from ..campaign import Campaign
    from ..segment import Segmentation
    from ..trace import Trace


def inspect(
    campaign: Path,
    *,
    out: Path | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    force: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Traces of a campaign, their events, what was mended or left out, and what they can tell.

    Parameters
    ----------
    campaign:
        TOML file that names the measurements.
    out:
        Folder for result.json, arrays.nc, a picture of every trace and report.html.
    json:
        Print everything as JSON, with the events of every trace, instead of a table.
    force:
        Replace an existing run folder.
    """
    if out is not None:
        refuse_existing(out, force)
    began = time.perf_counter()
    loaded, traces, found = load_and_segment(campaign)
    result, variables = inspection(loaded, traces, found)
    result["seconds"] = round(time.perf_counter() - began, 3)
    if out is not None:
        _write(out, force, result, variables)
    if json:
        print(json_text(result))
    else:
        _print(result, out)
    return 0


def load_and_segment(path: Path) -> tuple[Campaign, list[Trace], list[Segmentation]]:
    """A campaign with its traces and their events."""
    from ..campaign import load_campaign, load_traces
    from ..segment import segment

    loaded = load_campaign(path)
    traces = load_traces(loaded)
    return loaded, traces, [segment(trace) for trace in traces]


def head(loaded: Campaign, kind: str) -> dict[str, Any]:
    """What every ``result.json`` made from a campaign begins with."""
    files = {file_record(loaded.path)["file"]: file_record(loaded.path)}
    for entry in loaded.entries:
        for name in dict.fromkeys([entry.file, *_channel_files(entry)]):
            record = file_record(loaded.folder / name)
            files[record["file"]] = record
    return {
        "schema": 1,
        "kind": kind,
        "title": loaded.title or loaded.path.stem,
        "inputs": list(files.values()),
        "versions": versions(),
    }


def _channel_files(entry: Any) -> list[str]:
    channels = ("displacement", "velocity", "spring_force", "normal_load", "drive_position")
    return [c.file for name in channels if (c := getattr(entry, name)) is not None and c.file]


def inspection(
    loaded: Campaign, traces: list[Trace], found: list[Segmentation]
) -> tuple[dict[str, Any], dict[str, tuple]]:
    """``result.json`` of an inspection, and the arrays its pictures need."""
    from ..report import abilities, describe_trace, trace_pieces
    from ..report.ripple import stick_ripple

    rows, variables = [], {}
    for i, (trace, segmentation) in enumerate(zip(traces, found, strict=True)):
        row = describe_trace(trace, segmentation)
        ripple = stick_ripple(trace, segmentation) if trace.drive is not None else None
        if ripple is not None:
            key = f"trace{i}_ripple"
            for name, unit in (("frequency", "Hz"), ("amplitude", ripple["unit"])):
                variables[f"{key}_{name}"] = (key, ripple.pop(name), {"units": unit})
            row["ripple"] = ripple
        variables |= trace_pieces(trace, segmentation, i)
        rows.append(row)
    able = abilities(traces, found)
    dropped = [f"{t['name']}: {text}" for t in rows for text in (*t["repairs"], *t["dropped"])]
    result = {
        **head(loaded, "inspect"),
        "traces": rows,
        "can": list(able.can),
        "cannot": list(able.cannot),
        "dropped": dropped,
    }
    return result, variables


def _write(out: Path, force: bool, result: dict[str, Any], variables: dict[str, tuple]) -> None:
    import xarray

    from ..plots import save
    from ..report import write_report
    from ..report.figures import trace_picture

    data = xarray.Dataset(variables, attrs={"title": result["title"]})
    with open_run(out, force=force) as run:
        run.arrays(data)
        run.json(result)
        for i, row in enumerate(result["traces"]):
            save(trace_picture(data, i, row), run.path(f"trace{i + 1}.png"))
        write_report(run.folder)


def _print(result: dict[str, Any], out: Path | None) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False, width=None if sys.stdout.isatty() else 118)
    console.print(
        Text(f"{result['title']}: {len(result['traces'])} trace{'s' * (len(result['traces']) != 1)}"), style="bold"
    )
    table = Table(box=box.SIMPLE_HEAD)
    for name in ("trace", "signal", "drive", "length", "sampling", "motion"):
        table.add_column(name, overflow="fold")
    for name in ("slips", "slip", "recurrence", "peak velocity", "holds"):
        table.add_column(name, justify="right")
    for row in result["traces"]:
        table.add_row(*(Text(cell) for cell in _cells(row)))
    console.print(table)
    for row in result["traces"]:
        lines = [*(f"warning: {w}" for w in row["warnings"]), *(f"mended: {w}" for w in row["repairs"])]
        lines += [f"left out: {w}" for w in row["dropped"]]
        if row.get("ripple", {}).get("lines"):
            lines.append(row["ripple"]["text"])
        for line in lines:
            console.print(Text(f"{row['name']}: {line}"))
    console.print()
    for line in (*result["can"], *result["cannot"]):
        console.print(Text(line))
    if out is not None:
        console.print(Text(f"written to {out}: report.html, result.json, arrays.nc and a picture of every trace"))


def _cells(row: dict[str, Any]) -> list[str]:
    from statistics import median

    q, units, events = show.quantity, row["units"], row["events"]

    def middle(key: str) -> float | None:
        known = [event[key] for event in events if event[key] == event[key]]
        return median(known) if known else None

    return [
        row["name"],
        ", ".join(s.replace("_", " ") for s in row["signals"]),
        q(row["drive_velocity"], "m/s", 3),
        q(row["duration"], "s", 3),
        q(row["sampling_rate"], "Hz", 3),
        row["regime"],
        str(len(events)),
        q(middle("slip"), units["slip"], 3) if events else "-",
        q(middle("recurrence"), "s", 3) if events else "-",
        q(middle("peak_velocity"), units["peak_velocity"], 3) if events else "-",
        str(sum(event["hold_time"] > 0 for event in events)) if events else "-",
    ]
