"""``stickslip simulate``: a scenario in; slip events, pictures and a trace out."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import ArgumentError, InputError, StickslipError
from ..system.runstore import Run, json_text, open_run, refuse_existing
from . import show
from .parameters import Changes, Flag, Force, MoreChanges, OwnEffects

if TYPE_CHECKING:
    from ..simulation.scenario import Scenario
    from ..simulation.scenario.schema import SweepTable

PIECES = "pieces"  # folder of a series' finished runs


def simulate(
    scenario: str,
    *more: MoreChanges,
    out: Path | None = None,
    set: Changes = (),
    sweep: str | None = None,
    json: Flag = False,
    jobs: int = 1,
    trace: str | None = None,
    effect: OwnEffects = (),
    force: Force = False,
) -> int:
    """Simulate a scenario, or the model that a fit or a diagnosis found: trace, slip events, pictures.

    Parameters
    ----------
    scenario:
        TOML file that describes the rig and its drive; or the run folder of a fit or a diagnosis, whose model is then
        driven at the velocity of its first run.
    out:
        Folder for result.json, arrays.nc, the pictures and the synthetic measurement.
    sweep:
        Run a series: --sweep drive.velocity=20um/s:1mm/s:8 (start, stop, number), or values with commas. With --out an
        interrupted series resumes from its finished runs.
    json:
        Print the result as JSON instead of a table.
    jobs:
        Processes that share the runs of a series.
    trace:
        Of a run folder: drive as this measured run was driven, with its holds.
    """
    path, changes = scenario_arguments(scenario, more, set)
    refuse_existing(out, force)
    from ..show.simulated import head

    began = time.perf_counter()
    loaded = _load(path, changes, trace, effect, sweep)
    series = loaded.file.sweep
    if series is None and jobs != 1:
        raise ArgumentError("only the runs of a series are shared", key="jobs", value=jobs, hint="add --sweep")
    with (
        open_run(out, force=force, resume=series is not None) if out is not None else nullcontext() as run,
        _resumable(run) if series is not None else nullcontext(),
    ):
        work = _single(loaded, run) if series is None else _series(loaded, series, run, jobs)
        work["warnings"] = [*outside(loaded), *work["warnings"]]
        result = {**head(loaded), **work, "seconds": round(time.perf_counter() - began, 3)}
        if run is not None:
            run.json(result)
            shutil.rmtree(run.folder / PIECES, ignore_errors=True)
    for text in result["warnings"]:
        show.warn(text)
    print(json_text(result) if json else _report(result, out))
    return 0


def _load(
    path: str, changes: list[str], trace: str | None, files: tuple[Path, ...], sweep: str | None = None
) -> Scenario:
    """A scenario from its file, or the model of a run folder; with a series over it."""
    from ..simulation.scenario.overrides import parse_sweep

    if Path(path).is_dir():
        from ..objects.fitted_run import load_run

        found = load_run(path, files)
        loaded = found.scenario(changes, trace)
        if sweep is None:
            return loaded
        table = parse_sweep(sweep)
        return loaded.with_changes([("sweep", {**table, "key": found.key(table["key"])})])
    if trace is not None:
        raise InputError("--trace names a run of a fit or a diagnosis", key="--trace", hint="give a run folder")
    if files:
        from ..simulation.conformance import load_effects

        load_effects(files)
    from ..simulation.scenario import load_scenario

    loaded = load_scenario(path, changes)
    return loaded if sweep is None else loaded.with_changes([("sweep", parse_sweep(sweep))])


def scenario_arguments(scenario: str, more: tuple[str, ...], changes: tuple[str, ...]) -> tuple[str, list[str]]:
    """The scenario's path and all changes; both may stand in any order."""
    words = [scenario, *more]
    paths = [word for word in words if "=" not in word or Path(word).is_file()]
    if len(paths) != 1:
        what = "no scenario is given" if not paths else f"more than one scenario is given: {', '.join(paths)}"
        raise InputError(what, allowed="one TOML file", hint="stickslip simulate SCENARIO --set contact.H=0.5")
    return paths[0], [*changes, *(word for word in words if word not in paths)]


def outside(scenario: Scenario) -> list[str]:
    """Files that the scenario names and that do not lie in its folder or below: read, but said."""
    home = scenario.folder.resolve()
    files = [part for part in (scenario.file.drive.file, getattr(scenario.file.contact, "file", None)) if part]
    beyond = (part for part in files if not (scenario.folder / part).resolve().is_relative_to(home))
    return [f"{part} lies outside the scenario's folder" for part in beyond]


def _single(scenario: Scenario, run: Run | None) -> dict[str, Any]:
    from ..show.simulated import numbers, write_single
    from ..simulation.scenario import record

    recording = record(scenario)
    if run is not None:
        write_single(run, scenario, recording)
    return numbers(recording)


def _series(scenario: Scenario, sweep: SweepTable, run: Run | None, jobs: int) -> dict[str, Any]:
    from ..objects.series import runs_of_series
    from ..show.simulated import series_numbers, write_series
    from ..simulation.scenario.series import scenarios_of, summary

    members = scenarios_of(scenario, sweep)
    if run is not None:
        run.clear(PIECES)
    done = runs_of_series(scenario, sweep.key, members, run, jobs, _tell)
    table = summary(scenario, sweep.key, [value for value, _ in members], done)
    if run is not None:
        write_series(run, members, table, done)
    return series_numbers(sweep, members, table, done)


def _tell(text: str) -> None:
    if sys.stderr.isatty():
        print(text, file=sys.stderr)


@contextmanager
def _resumable(run: Run | None) -> Iterator[None]:
    """Say of a series that is not finished how many of its runs its folder keeps."""
    try:
        yield
    except (KeyboardInterrupt, StickslipError) as error:
        kept = 0 if run is None else sum(1 for _ in run.folder.glob(f"{PIECES}/*.npz"))
        text = f"{kept} finished runs are kept, and the same command resumes from them"
        if isinstance(error, KeyboardInterrupt):
            raise KeyboardInterrupt(text if kept else "") from None
        if kept:
            show.warn(text)
        raise


def _report(result: dict[str, Any], out: Path | None) -> str:
    lines = [f"{result['title']}: {result['verdict']}"]
    if result["kind"] == "series":
        lines += ["", _series_table(result)]
        unit = result["units"]["value"]
        plain = "stick-slip: "  # and nothing to be said of sliding
        odd = [r for r in result["runs"] if not r["verdict"].startswith(plain) or "slides" in r["verdict"]]
        lines += [f"{show.quantity(part['value'], unit)}: {part['verdict']}" for part in odd]
    elif result["events"]:
        lines += ["", _event_table(result)]
    if result["kind"] == "simulate":
        lines += ["", _facts(result["facts"])]
    lines.append(f"{result['seconds']:.1f} s")
    if out is not None:
        written = sorted((p.name for p in out.iterdir()), key=lambda name: (not name.endswith(".png"), name))
        lines.append(f"written to {out}: {', '.join(written)}")
    return "\n".join(lines)


def _event_table(result: dict[str, Any], most: int = 12) -> str:
    units = result["units"]
    rows = [
        [str(number), *(show.quantity(event[name], units[name]) for name in units)]
        for number, event in enumerate(result["events"], start=1)
    ]
    left = len(rows) - most
    text = show.table(["event", *(name.replace("_", " ") for name in units)], rows[:most])
    return text if left <= 0 else f"{text}\n... and {left} more"


def _series_table(result: dict[str, Any]) -> str:
    names = [name for name in result["table"] if not name.endswith("_std")]
    units = result["units"]
    columns = [[show.quantity(value, units[name]) for value in result["table"][name]] for name in names]
    header = [result["key"], *(name.replace("_", " ") for name in names[1:])]
    return show.table(header, [list(row) for row in zip(*columns, strict=True)])


def _facts(facts: dict[str, Any]) -> str:
    q = show.quantity
    line = f"; N = {facts['N']} springs" if facts["N"] else ""
    line += f", L = {q(facts['L'], 'm')}" if facts["L"] == facts["L"] else ""
    return (
        f"full friction {q(facts['friction_force'], 'N')}, contact stiffness {q(facts['contact_stiffness'], 'N/m')}, "
        f"mean u_max {q(facts['u_max'], 'm')}, resonance {q(facts['contact_resonance'], 'Hz')}\n"
        f"{_stick_slip_range(facts)}{line}\n"
        f"{facts['steps']} steps, {facts['rejected']} rejected, energy balance to {facts['energy_error']:.1e}"
    )


def _stick_slip_range(facts: dict[str, Any]) -> str:
    """Where steady sliding is unstable: velocities with this spring, springs at this velocity."""
    fastest, stiffest = facts["critical_velocity"], facts["critical_stiffness"]
    slow = f"below {show.quantity(fastest, 'm/s')}" if fastest > 0 else "at no velocity with this spring"
    soft = (
        f"at this velocity with springs softer than {show.quantity(stiffest, 'N/m')}"
        if stiffest > 0
        else "at this velocity with no spring, however soft"
    )
    return f"stick-slip {slow} and {soft}"
