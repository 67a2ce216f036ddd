"""The runs of a series, kept in its run folder as they are finished, from which an interrupted one goes on."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, overload

import numpy as np

from ..errors import StickslipError
from ..simulation.scenario import Scenario
from ..system.runstore import Run, json_text
from .checkpoints import FinishedParts
from .sweep import one_by_one, what_runs_depend_on

if TYPE_CHECKING:
    import xarray

Tell = Callable[[str], None]


class KeptRuns(Sequence["xarray.Dataset"]):
    """Runs of a series that lie in its folder; each is read when it is asked for, so that one is in memory.

    Args:
        pieces: of the run folder.
        keys: of the runs, in their order.

    Raises:
        StickslipError: when a run is asked for that is no longer there, or damaged.
    """

    def __init__(self, pieces: FinishedParts, keys: Sequence[str]) -> None:
        self._pieces, self._keys = pieces, tuple(keys)

    def __len__(self) -> int:
        return len(self._keys)

    @overload
    def __getitem__(self, at: int) -> xarray.Dataset: ...

    @overload
    def __getitem__(self, at: slice) -> KeptRuns: ...

    def __getitem__(self, at: int | slice) -> xarray.Dataset | KeptRuns:
        if isinstance(at, slice):
            return KeptRuns(self._pieces, self._keys[at])
        found = self._pieces.load(self._keys[at])
        if found is None:
            raise StickslipError("a finished run is no longer in the run folder; give the same command again")
        return _unpacked(found)


def runs_of_series(
    scenario: Scenario, key: str, members: Sequence[tuple[float, Scenario]], run: Run | None, jobs: int, tell: Tell
) -> Sequence[xarray.Dataset]:
    """Every run of a series, in the order of its values, as data sets of :func:`stickslip.simulate`.

    Args:
        scenario, key: what is driven, and what changes from run to run.
        members: value (SI) and scenario of every run.
        run: folder that keeps finished runs under ``pieces/``; those of the same value, inputs and code are not run
            again. None: they are kept in memory.
        jobs: processes that share the runs (1: this one).
        tell: told in words what is finished.

    Raises:
        ArgumentError: no number of processes.
        SolveError: a run cannot be simulated.
        StickslipError: a process was ended from outside.
    """
    scenarios = [member for _, member in members]
    keys = [hashlib.sha256(json_text([key, value]).encode()).hexdigest()[:16] for value, _ in members]
    inputs = what_runs_depend_on(scenario, scenarios, ())
    inputs["scenario"] = {name: table for name, table in scenario.content.items() if name != "sweep"}
    pieces = None if run is None else FinishedParts(run, json_text(inputs))
    ready = set() if pieces is None else {n for n, name in enumerate(keys) if pieces.load(name) is not None}
    if run is not None:
        for path in run.folder.glob("pieces/*"):  # of other inputs
            if path.stem not in {keys[n] for n in ready}:
                path.unlink()
    if ready:
        tell(f"resuming from {len(ready)} finished runs")
    missing = [n for n in range(len(members)) if n not in ready]
    made: dict[int, xarray.Dataset] = {}
    for i, data in one_by_one([scenarios[n] for n in missing], jobs):
        number = missing[i]
        if pieces is None:
            made[number] = data
        else:
            pieces.save(keys[number], _packed(data))
        ready.add(number)
        tell(f"{len(ready)} of {len(members)}: {key} = {members[number][0]:.4g}: {data.attrs['verdict']}")
    return [made[n] for n in range(len(members))] if pieces is None else KeptRuns(pieces, keys)


def _packed(data: xarray.Dataset) -> dict[str, np.ndarray]:
    return {"netcdf": np.frombuffer(bytes(data.to_netcdf(engine="h5netcdf")), np.uint8)}


def _unpacked(piece: Mapping[str, np.ndarray]) -> xarray.Dataset:
    import xarray

    with xarray.open_dataset(io.BytesIO(piece["netcdf"].tobytes()), engine="h5netcdf", decode_times=False) as file:
        return file.load()
