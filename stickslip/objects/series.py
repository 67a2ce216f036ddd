"""The runs of a series, kept in its run folder as they are finished, from which an interrupted one goes on."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, overload

from ..simulation.scenario import Scenario
from ..system.runstore import Run, json_text
from .sweep import one_by_one, what_runs_depend_on

if TYPE_CHECKING:
    import xarray

Tell = Callable[[int, "xarray.Dataset"], None]
_INPUTS = "inputs"  # attribute of a kept run: digest of all that it depends on


class KeptRuns(Sequence["xarray.Dataset"]):
    """Runs of a series that lie in its folder; each is read when it is asked for, so that memory holds one."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = tuple(paths)

    def __len__(self) -> int:
        return len(self._paths)

    @overload
    def __getitem__(self, at: int) -> xarray.Dataset: ...

    @overload
    def __getitem__(self, at: slice) -> KeptRuns: ...

    def __getitem__(self, at: int | slice) -> xarray.Dataset | KeptRuns:
        if isinstance(at, slice):
            return KeptRuns(self._paths[at])
        found = _read(self._paths[at])
        del found.attrs[_INPUTS]
        return found


def runs_of_series(
    scenario: Scenario, key: str, members: Sequence[tuple[float, Scenario]], run: Run | None, jobs: int, tell: Tell
) -> Sequence[xarray.Dataset]:
    """Every run of a series, in the order of its values.

    Args:
        scenario, key: what is driven, and what changes from run to run.
        members: value and scenario of every run.
        run: folder that keeps finished runs under ``pieces/``; those of the same inputs and code are not run again.
            None: they are kept in memory.
        jobs: processes that share the runs (1: this one).
        tell: told the number of every run that is finished, or was found finished, and the run.

    Raises:
        ArgumentError: no number of processes.
        KeyboardInterrupt: with a folder, says how many runs it keeps.
    """
    scenarios = [member for _, member in members]
    if run is None:
        made = []
        for number, data in enumerate(one_by_one(scenarios, jobs)):
            made.append(data)
            tell(number, data)
        return made
    rows = [((key, value),) for value, _ in members]
    digest = hashlib.sha256(json_text(what_runs_depend_on(scenario, scenarios, rows)).encode()).hexdigest()
    names = [f"pieces/{number:06d}.nc" for number in range(len(members))]
    paths = [run.path(name) for name in names]
    ready = {number for number, path in enumerate(paths) if _is_of(path, digest)}
    missing = [number for number in range(len(members)) if number not in ready]
    for number in sorted(ready):
        tell(number, _read(paths[number]))
    try:
        for number, data in zip(missing, one_by_one([scenarios[n] for n in missing], jobs), strict=True):
            run.arrays(data.assign_attrs({_INPUTS: digest}), names[number])
            ready.add(number)
            tell(number, data)
    except KeyboardInterrupt:
        kept = f"{len(ready)} of {len(members)} runs are kept, and the same command resumes from them"
        raise KeyboardInterrupt(kept if ready else "") from None
    return KeptRuns(paths)


def _read(path: Path) -> xarray.Dataset:
    import xarray

    with xarray.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
        return file.load()


def _is_of(path: Path, digest: str) -> bool:
    """Whether a finished run of the same inputs is there, and whole."""
    try:
        return path.is_file() and str(_read(path).attrs.get(_INPUTS)) == digest
    except (OSError, ValueError, KeyError, RuntimeError):  # damaged
        return False
