"""Many rigs simulated side by side, on this machine or on a cluster, as one data set that is kept as it comes."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError, StickslipError
from ..simulation.scenario import Scenario, load_scenario, simulate
from ..simulation.scenario.series import KEY_UNITS, NUMBERS, numbers
from ..system import process
from ..system.cluster import cluster
from ..system.lifeline import end_with
from ..system.progress import silent, telling
from ..system.runstore import json_text, open_run, versions
from .checkpoints import Pieces, code_digest
from .run import Tell

if TYPE_CHECKING:
    import xarray

CHUNK = 20  # runs, which a process does one after the other and which are kept together
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
        out: folder that keeps finished runs; the same call goes on where one was interrupted, and ends with
            ``arrays.nc`` and ``result.json`` in it.
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
        InputError: a key or a value is not allowed (before anything runs), columns of different length, no scheduler.
        RunFolderError: the folder exists.

    Examples:
        ``ss.sweep("rig.toml", {"contact.H": [0.3, 0.5, 0.7], "drive.velocity": ["50 um/s"] * 3}, out="out/roughness")``
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    rows = _rows(changes)
    members = [loaded.with_changes(row) for row in rows]  # all checked before the first runs
    chunks = {f"{first:06d}": members[first : first + CHUNK] for first in range(0, len(members), CHUNK)}
    with (
        telling("sweeping", progress) as tell,
        open_run(out, force=force, resume=True) if out else nullcontext() as run,
    ):
        given = {"scenario": loaded.content, "rows": rows, "versions": versions(), "code": code_digest()}
        pieces = None if run is None else Pieces(run, json_text(given))
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
        data = _together(members, list(changes), [found[key] for key in chunks])
        if run is not None:
            shutil.rmtree(run.folder / "pieces")
            run.arrays(data)
            run.json(
                {"schema": 1, "kind": "sweep", "title": loaded.title, "runs": len(members), "versions": versions()}
            )
    return data


def _rows(changes: Mapping[str, Sequence[Any]]) -> list[Changes]:
    columns = {key: list(values) for key, values in changes.items()}
    sizes = {len(values) for values in columns.values()}
    if len(sizes) != 1 or not sizes.pop():
        told = ", ".join(f"{key}: {len(values)}" for key, values in columns.items()) or "none"
        allowed = "as many for every key, at least one"
        raise ArgumentError("values do not make a table", key="changes", value=told, allowed=allowed)
    plain = [[v.item() if isinstance(v, np.generic) else v for v in values] for values in columns.values()]
    return [tuple(zip(columns, row, strict=True)) for row in zip(*plain, strict=True)]


def _made(
    chunks: Mapping[str, Sequence[Scenario]], scheduler: str | None, workers: int | None
) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Every chunk as it is finished."""
    if not chunks:
        return
    if workers == 1 and scheduler is None:
        yield from ((key, _chunk(members)) for key, members in chunks.items())
        return
    with cluster(scheduler, workers) as client, client.as_current():
        from distributed import as_completed

        parent = None if scheduler else os.getpid()
        waiting = {client.submit(in_worker, _chunk, c, parent, pure=False): key for key, c in chunks.items()}
        for done in as_completed(waiting):
            yield waiting[done], done.result()


def one_by_one(members: Sequence[Scenario], workers: int) -> Iterator[xarray.Dataset]:
    """The whole data set of every run in their order, by processes of this machine (1: in this one).

    Raises:
        ArgumentError: no number of processes.
    """
    if workers < 1:
        raise ArgumentError("out of range", key="jobs", value=workers, allowed="1 or more")
    if workers == 1:
        yield from map(simulate, members)
        return
    with cluster(None, workers) as client, client.as_current():
        waiting = [client.submit(in_worker, simulate, member, os.getpid(), pure=False) for member in members]
        yield from (done.result() for done in waiting)


def in_worker(work: Callable[[Any], Any], given: Any, parent: int | None) -> Any:
    """Do something in a process of a cluster, which ends with its ``parent`` if that is on this machine."""
    if parent is not None:
        end_with(parent)
    process.begin()
    return work(given)


def _chunk(members: Sequence[Scenario]) -> dict[str, np.ndarray]:
    """Some runs, one after the other: columns of numbers, and why a run failed."""
    rows, notes = [], []
    for member in members:
        try:
            rows.append(numbers(simulate(member, silent)))
            notes.append("")
        except StickslipError as error:
            rows.append(dict.fromkeys(NUMBERS, np.nan))
            notes.append(str(error).split("\n")[0])
    return {"note": np.array(notes), **{name: np.array([row[name] for row in rows]) for name in NUMBERS}}


def _together(members: Sequence[Scenario], keys: Sequence[str], parts: Sequence[Mapping[str, Any]]) -> xarray.Dataset:
    import xarray

    columns = {name: np.concatenate([part[name] for part in parts]) for name in ("note", *NUMBERS)}
    known: dict[str, Any] = {name: ("run", columns[name], {"units": unit}) for name, unit in NUMBERS.items()}
    changed = {
        key: ("run", np.array([_value(m, key) for m in members]), {"units": KEY_UNITS[key]} if key in KEY_UNITS else {})
        for key in keys
    }
    return xarray.Dataset(
        {**known, "note": ("run", columns["note"])}, coords=changed, attrs={"title": members[0].title}
    )


def _value(scenario: Scenario, key: str) -> Any:
    """What a key stands at, in SI."""
    value: Any = scenario.file
    for name in key.split("."):
        value = value[int(name)] if isinstance(value, list | tuple) else getattr(value, name)
    return value
