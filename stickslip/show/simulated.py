"""Run folders of simulations: what ``stickslip simulate`` and the workbench keep of a run and of a series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..simulation.scenario import Scenario
from ..simulation.scenario.schema import SweepTable
from ..system.runstore import Run, file_record, versions
from ..system.units import shown

if TYPE_CHECKING:
    import xarray

    from .plots.style import Run as Recorded


def head(scenario: Scenario) -> dict[str, Any]:
    """What `result.json` says of a simulation before anything is simulated."""
    file = scenario.file
    return {
        "schema": 1,
        "kind": "simulate",
        "title": scenario.title,
        "scenario": file.model_dump(by_alias=True, exclude_none=True),
        "changes": [f"{key}={value}" for key, value in scenario.changes],
        "inputs": input_records(scenario),
        "versions": versions(),
        "seeds": {"lines": getattr(file.contact, "seed", None), "sensor": file.sensor.seed if file.sensor else None},
    }


def input_records(scenario: Scenario) -> list[dict[str, str]]:
    """Name and SHA-256 of the scenario file and of those it names."""
    inputs = [file_record(scenario.path)] if scenario.path else []
    parts = (scenario.file.drive.file, getattr(scenario.file.contact, "file", None))
    return inputs + [file_record(scenario.folder / part) for part in parts if part]


def numbers(recorded: Recorded) -> dict[str, Any]:
    """What `result.json` says of one run: its event table and the facts."""
    columns = {str(name): v for name, v in recorded.variables.items() if v.dims == ("event",)}
    rows = [
        dict(zip(columns, row, strict=True)) for row in zip(*(v.values.tolist() for v in columns.values()), strict=True)
    ]
    attributes = recorded.attrs
    units = {name: v.attrs["units"] for name, v in columns.items()}
    facts = {key: value for key, value in attributes.items() if key not in ("title", "versions", "warnings")}
    return {
        "events": rows,
        "units": units,
        "facts": facts,
        "verdict": attributes["verdict"],
        "warnings": [text for text in str(attributes["warnings"]).split("\n") if text],
    }


def write_single(run: Run, scenario: Scenario, recorded: Recorded) -> None:
    """Arrays and pictures of one run, and its synthetic measurement where the scenario asks for one."""
    from .plots import save, static_against_inertial, trace_figure

    run.arrays(recorded)
    save(trace_figure(recorded), run.path("trace.png"))
    save(static_against_inertial([recorded], [scenario.title]), run.path("static_vs_inertial.png"))
    if scenario.file.output.trace:
        from ..simulation.scenario.writers import write_campaign

        write_campaign(run.folder, [scenario], [recorded])


def series_numbers(
    sweep: SweepTable, members: Sequence[tuple[float, Scenario]], table: xarray.Dataset, done: Sequence[Recorded]
) -> dict[str, Any]:
    """What `result.json` says of a series."""
    runs = [{"value": value, **numbers(data)} for (value, _), data in zip(members, done, strict=True)]
    return {
        "kind": "series",
        "key": sweep.key,
        "runs": runs,
        "table": {str(name): table[name].values.tolist() for name in table},
        "units": {str(name): table[name].attrs["units"] for name in table},
        "verdict": f"{sum(1 for told in runs if told['events'])} of {len(runs)} runs show slip events",
        "warnings": list(dict.fromkeys(text for told in runs for text in told["warnings"])),
    }


def write_series(
    run: Run, members: Sequence[tuple[float, Scenario]], table: xarray.Dataset, done: Sequence[Recorded]
) -> None:
    """Table and pictures of a series, and the synthetic measurements where the scenarios ask for them."""
    from .plots import save, series_figure, static_against_inertial

    run.arrays(table)
    run.text(_csv(table), "series.csv")
    save(series_figure(table), run.path("series.png"))
    unit = table["value"].attrs["units"]
    labels = [shown(float(value), unit, 3) if np.isfinite(value) else "-" for value in table["value"].values]
    save(static_against_inertial(done, labels), run.path("static_vs_inertial.png"))
    if members[0][1].file.output.trace:
        from ..simulation.scenario.writers import write_campaign

        write_campaign(run.folder, [member for _, member in members], done)


def _csv(table: Mapping[Any, Any]) -> str:
    names = [str(name) for name in table]
    header = ",".join(f"{name} [{table[name].attrs['units']}]" for name in names)
    rows = zip(*(table[name].values.tolist() for name in names), strict=True)
    return "\n".join([header, *(",".join(repr(cell) for cell in row) for row in rows)]) + "\n"
