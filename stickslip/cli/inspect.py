"""``stickslip inspect``: the traces of a campaign, their events, what was mended, and what the data can tell."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..errors import InputError
from ..runstore import json_text, open_run, refuse_existing, versions
from ..workflow import input_records

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
        from ..report.pieces import reduced_record

        for i, (trace, segmentation) in enumerate(zip(traces, found, strict=True)):
            variables |= reduced_record(trace, segmentation, i)
        _write(out, force, result, variables)
    if json:
        print(json_text(result))
    else:
        from ._inspected import text, width

        print(text(result, variables, out, width()))
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
    return {
        "schema": 1,
        "kind": kind,
        "title": loaded.title or loaded.path.stem,
        "inputs": input_records(loaded),
        "versions": versions(),
    }


def inspection(
    loaded: Campaign, traces: list[Trace], found: list[Segmentation]
) -> tuple[dict[str, Any], dict[str, tuple]]:
    """``result.json`` of an inspection, and the arrays its pictures need."""
    from ..checks import rig_against_motion, stopping
    from ..diagnose.spring import spring_finding
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
    cannot = [*able.cannot, *_lacking(loaded, traces, found)]
    dropped = [f"{t['name']}: {text}" for t in rows for text in (*t["repairs"], *t["dropped"])]
    rig = list(rig_against_motion(loaded, traces, found))
    if not stopping(rig) and (wrong := spring_finding(loaded, traces, found)) is not None:
        rig.append(wrong)
    result = {
        **head(loaded, "inspect"),
        "rig": [finding.plain() for finding in rig],
        "traces": rows,
        "can": list(able.can),
        "cannot": cannot,
        "dropped": dropped,
    }
    return result, variables


def _lacking(loaded: Campaign, traces: list[Trace], found: list[Segmentation]) -> list[str]:
    """What the campaign does not say of the rig and a fit will ask for."""
    from ..fit.normalised import is_ramp
    from ..fit.static_table import StaticRig

    slipping = [t for t, s in zip(traces, found, strict=True) if s.events and not is_ramp(t)]
    said = []
    for trace in slipping:
        try:
            StaticRig.of(loaded.rig_of(trace.name), spring_stiffness=trace.spring_stiffness)
        except InputError as error:
            said.append(f"The static model can be fitted only when the campaign has {error.key}: measured, or a guess.")
    if slipping and loaded.rig.mass is None:
        said.append("The dynamic model can be fitted only when the campaign has rig.mass: measured, or a guess.")
    return list(dict.fromkeys(said))


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
