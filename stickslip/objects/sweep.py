"""Many rigs simulated side by side, on this machine or on a cluster, as one data set that is kept as it comes."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError, SolveError, StickslipError
from ..physics.effects import catalogue
from ..show.simulated import input_records
from ..simulation.scenario import Scenario, load_scenario, simulate
from ..simulation.scenario.load import Parts, from_parts
from ..simulation.scenario.series import KEY_UNITS, NUMBERS, numbers
from ..system import process
from ..system.cluster import cluster
from ..system.parent_watch import end_with
from ..system.progress import reporting, silent
from ..system.runstore import json_text, open_run, versions
from ..system.threads import processors
from .checkpoints import FinishedParts, code_digest
from .result_base import Tell

if TYPE_CHECKING:
    import xarray
    from distributed import Client, Future

CHUNK = 20  # runs at most, which a process does one after the other and which are kept together
Changes = tuple[tuple[str, Any], ...]


def sweep(
    scenario: str | Path | Scenario,
    changes: Mapping[str, Sequence[Any]],
    *,
    out: str | Path | None = None,
    force: bool = False,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Tell | None = None,
) -> xarray.Dataset:
    """Simulate a scenario once for every row of a table of changes.

    Args:
        scenario: file, or from :func:`load_scenario`.
        changes: key of the scenario -> its values (numbers in SI, or text with a unit), one for each run.
        out: folder that keeps finished runs; after an interruption the same call does those that are missing. When all
            are done it holds ``arrays.nc`` and ``result.json``.
        force: replace an existing run folder.
        scheduler: address of a running dask scheduler, ``tcp://host:8786``; default a cluster on this machine.
        workers: of the local cluster; default one a core. 1: in this process, without dask.
        progress: told how many runs are done and the share of all; default a bar in a terminal or a notebook.

    Returns:
        Over ``run``: the changed keys as coordinates; ``events``, ``critical_velocity`` (m/s), ``recurrence`` (s),
        ``slip`` (m), ``peak_velocity`` (m/s) and ``creep_before_slip`` (m), means over the events after the first, with
        ``..._std``; ``note`` says why a run failed (its numbers are nan). Every run has the numbers that
        :func:`simulate` gives, to the last bit.

    Raises:
        InputError: a key or a value is not allowed (before anything runs), columns of different length, no
            scheduler, or a run would not fit into memory.
        RunFolderError: the folder exists.

    Examples:
        ``ss.sweep("rig.toml", {"contact.H": [0.3, 0.5, 0.7], "drive.velocity": ["50 um/s"] * 3}, out="out/roughness")``
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    if loaded.path is not None:  # workers may be elsewhere
        loaded = replace(loaded, path=loaded.path.resolve())
    rows = _rows(changes)
    members = [loaded.with_changes(row) for row in rows]  # all checked before the first runs
    coordinates = _coordinates(members, list(changes))
    at_once = workers or processors()
    size = max(1, min(CHUNK, len(members) // (4 * at_once)))
    chunks = {f"{first:06d}-{size}": members[first : first + size] for first in range(0, len(members), size)}
    if scheduler is None:
        workers = min(at_once, len(chunks)) if workers is None or workers > 0 else workers
    with (
        reporting("sweeping", progress) as tell,
        open_run(out, force=force, resume=True) if out else nullcontext() as run,
    ):
        pieces = None if run is None else FinishedParts(run, json_text(what_runs_depend_on(loaded, members, rows)))
        found = {key: kept for key in chunks if pieces is not None and (kept := pieces.load(key)) is not None}
        try:
            for key, made in _made({k: c for k, c in chunks.items() if k not in found}, scheduler, workers):
                found[key] = made
                if pieces is not None:
                    pieces.save(key, made)
                done = sum(part["note"].size for part in found.values())
                tell(f"{done} of {len(members)} runs", done / len(members))
        except KeyboardInterrupt:
            text = f"{len(found)} of {len(chunks)} parts are kept, and the same call resumes from them"
            raise KeyboardInterrupt(text if pieces is not None else "") from None
        data = _together([found[key] for key in chunks], coordinates, loaded.title)
        if run is not None:
            run.arrays(data)
            run.json(
                {"schema": 1, "kind": "sweep", "title": loaded.title, "runs": len(members), "versions": versions()}
            )
            shutil.rmtree(run.folder / "pieces")
    return data


def _rows(changes: Mapping[str, Sequence[Any]]) -> list[Changes]:
    for key, values in changes.items():
        if isinstance(values, str) or not hasattr(values, "__len__"):
            raise ArgumentError("not a list of values", key="changes", value={key: values}, allowed="one for each run")
    columns = {key: list(values) for key, values in changes.items()}
    sizes = {len(values) for values in columns.values()}
    if len(sizes) != 1 or not sizes.pop():
        told = ", ".join(f"{key}: {len(values)}" for key, values in columns.items()) or "none"
        allowed = "as many for every key, at least one"
        raise ArgumentError("values do not make a table", key="changes", value=told, allowed=allowed)
    plain = [[v.item() if isinstance(v, np.generic) else v for v in values] for values in columns.values()]
    return [tuple(zip(columns, row, strict=True)) for row in zip(*plain, strict=True)]


def what_runs_depend_on(loaded: Scenario, members: Sequence[Scenario], rows: Sequence[Changes]) -> dict[str, Any]:
    """The scenario, the ``rows`` of changes to it, the files that its ``members`` name, versions and code."""
    naming = {(m.file.drive.file, getattr(m.file.contact, "file", None)): m for m in members}
    inputs = [input_records(m) for m in naming.values()]
    code = code_digest([str(module.__file__) for module in catalogue.user_modules()])
    return {"scenario": loaded.content, "rows": rows, "inputs": inputs, "versions": versions(), "code": code}


def _made(
    chunks: Mapping[str, Sequence[Scenario]], scheduler: str | None, workers: int | None
) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Every chunk as it is finished."""
    if not chunks:
        return
    if workers == 1 and scheduler is None:
        yield from ((key, _chunk(*members)) for key, members in chunks.items())
        return
    with cluster(scheduler, workers) as client, client.as_current():
        from distributed import as_completed

        submit = _submitting(client, None if scheduler else os.getpid())
        waiting = {submit(_chunk, *members): key for key, members in chunks.items()}
        for done in as_completed(waiting):
            yield waiting[done], _result(done)


def one_by_one(members: Sequence[Scenario], workers: int) -> Iterator[tuple[int, xarray.Dataset]]:
    """Number and whole data set of every run as it is finished, by processes of this machine (1: in this one).

    Raises:
        ArgumentError: no number of processes.
    """
    if workers < 1:
        raise ArgumentError("out of range", key="jobs", value=workers, allowed="1 or more")
    workers = min(workers, len(members))
    if workers <= 1:
        yield from enumerate(map(simulate, members))
        return
    with cluster(None, workers) as client, client.as_current():
        from distributed import as_completed

        submit = _submitting(client, os.getpid())
        waiting = {submit(simulate, member): number for number, member in enumerate(members)}
        for done in as_completed(waiting):
            yield waiting.pop(done), _result(done)


def _submitting(client: Client, parent: int | None) -> Callable[..., Future]:
    """What sends work to a cluster, with scenarios as plain tables, which are read where users' effects are known."""
    files = tuple(str(module.__file__) for module in catalogue.user_modules())

    def submit(work: Callable[..., Any], *members: Scenario) -> Future:
        return client.submit(_in_worker, work, [m.parts for m in members], files, parent, pure=False)

    return submit


def _in_worker(work: Callable[..., Any], members: Sequence[Parts], files: Sequence[str], parent: int | None) -> Any:
    """Do something in a process of a cluster, which ends with its ``parent`` if that is on this machine."""
    if parent is not None:
        end_with(parent)
    process.begin()
    for file in files:
        if not any(str(module.__file__) == file for module in catalogue.user_modules()):
            catalogue.load_file(file)
    return work(*(from_parts(*parts) for parts in members))


def _result(done: Future) -> Any:
    from distributed import CancelledError
    from distributed.scheduler import KilledWorker

    try:
        return done.result()
    except (CancelledError, KilledWorker) as error:
        what = "a worker process was ended from outside, or there was no memory for it"
        raise StickslipError(
            f"{what}; repeat the call: with out=FOLDER it keeps finished runs, and fewer workers need less memory"
        ) from error


def _chunk(*members: Scenario) -> dict[str, np.ndarray]:
    """Some runs, one after the other: columns of numbers, and why a run failed."""
    rows, notes = [], []
    for member in members:
        try:
            rows.append(numbers(simulate(member, silent)))
            notes.append("")
        except SolveError as error:
            rows.append(dict.fromkeys(NUMBERS, np.nan))
            notes.append(str(error).split("\n")[0])
    return {"note": np.array(notes), **{name: np.array([row[name] for row in rows]) for name in NUMBERS}}


def _together(parts: Sequence[Mapping[str, Any]], coordinates: Mapping[str, Any], title: str) -> xarray.Dataset:
    import xarray

    columns = {name: np.concatenate([part[name] for part in parts]) for name in ("note", *NUMBERS)}
    known: dict[str, Any] = {name: ("run", columns[name], {"units": unit}) for name, unit in NUMBERS.items()}
    known["note"] = ("run", columns["note"])
    return xarray.Dataset(known, coords=coordinates, attrs={"title": title})


def _coordinates(members: Sequence[Scenario], keys: Sequence[str]) -> dict[str, Any]:
    """The changed keys over the runs, as they stand in the checked scenarios."""
    found = {}
    for key in keys:
        values = [_value(member, key) for member in members]
        if not all(isinstance(v, str) for v in values) and not all(isinstance(v, int | float) for v in values):
            allowed = "a number or a text in every run"
            raise ArgumentError("values of a key are of different kinds", key="changes", value=key, allowed=allowed)
        found[key] = ("run", np.array(values), {"units": KEY_UNITS[key]} if key in KEY_UNITS else {})
    return found


def _value(scenario: Scenario, key: str) -> Any:
    """What a key stands at, in SI; entries of lists are counted from 1, effects also called by their tags."""
    value: Any = scenario.file
    for name in key.split("."):
        if isinstance(value, list | tuple):
            value = value[int(name) - 1] if name.isdigit() else next(entry for entry in value if entry.type == name)
        else:
            value = getattr(value, name)
    return value
