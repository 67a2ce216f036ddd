"""What every result of a campaign has: its head, and how it is shown and kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from ..system.object_repr import Shown
from ..system.progress import Tell as Tell
from ..system.runstore import Run, open_run, versions

if TYPE_CHECKING:
    import xarray

    from .campaign import Campaign
    from .fit import Fit

Name = TypeVar("Name", bound=str | Path)


def several(names: Name | Sequence[Name]) -> tuple[Name, ...]:
    """Names, of which a single one may stand by itself."""
    return (names,) if isinstance(names, str | Path) else tuple(names)


def head(campaign: Campaign, kind: str) -> dict[str, Any]:
    """What every ``result.json`` made from a campaign begins with."""
    return {"schema": 1, "kind": kind, "title": campaign.title, "inputs": campaign.inputs(), "versions": versions()}


def dataset(variables: Mapping[str, Any], title: str) -> xarray.Dataset:
    """Arrays with their units as one data set; an entry ``coordinates`` holds those that are coordinates."""
    import xarray

    data = dict(variables)
    return xarray.Dataset(data, coords=data.pop("coordinates", {}), attrs={"title": title})


class Result(Protocol):
    """What can be kept."""

    @property
    def result(self) -> dict[str, Any]:
        """Plain data, as in ``result.json``."""

    @property
    def arrays(self) -> xarray.Dataset:
        """As in ``arrays.nc``."""

    def _finish(self, run: Run) -> None:
        """Write what else a run folder holds."""


class Savable(Shown):
    """What a campaign gave, which can be kept as a run folder."""

    def save(self: Result, folder: str | Path, force: bool = False, **more: Any) -> Path:
        """Keep it as a run folder: ``result.json``, ``arrays.nc``, ``report.html``, and models to go on from.

        Args:
            folder: where; it appears when all of it is written.
            force: replace an existing run folder.
            more: entries for ``result.json`` besides.

        Raises:
            RunFolderError: the folder exists or cannot be written.
        """
        result, arrays = {**self.result, **more}, self.arrays
        with open_run(folder, force=force) as run:
            run.arrays(arrays)
            run.json(result)
            self._finish(run)
        return Path(folder)

    def _finish(self, run: Run) -> None:
        finish(run)


def finish(run: Run, fit: Fit | None = None) -> None:
    """Write what a run folder holds besides its numbers: the models to go on from, and the report."""
    from ..show.report import write_report
    from .stored_fit import write_models

    if fit is not None:
        write_models(run, fit)
    write_report(run.folder)


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write plain arrays as an ``.npz`` file, aside and renamed, so that it is there whole or not at all."""
    aside = path.with_suffix(".part")
    with aside.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **arrays)
    aside.replace(path)
