"""Many campaigns fitted side by side, on this machine or on a cluster, as one data set."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError, InputError, StickslipError
from ..system import process, threads
from ..system.cluster import cluster
from ..system.parent_watch import end_with
from ..system.progress import reporting, silent
from .campaign import Campaign, load_campaign
from .result_base import Tell, several

if TYPE_CHECKING:
    import xarray

WHOLE = ("error", "unseen_error", "cost", "cycles")


def study(
    campaigns: Mapping[str, str | Path | Campaign] | str | Path | Sequence[str | Path],
    effects: str | Sequence[str] = (),
    *,
    effect_files: str | Path | Sequence[str | Path] = (),
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Tell | None = None,
) -> xarray.Dataset:
    """Fit the dynamic model to every campaign.

    Args:
        campaigns: campaign files by a name of each or by their folders, or campaigns by name.
        effects: added to the base in each, as of :meth:`Campaign.fit`.
        effect_files: Python files with effects of one's own; they must be there on every worker.
        scheduler: address of a running dask scheduler, ``tcp://host:8786``; default a cluster on this machine.
        workers: of the local cluster; default one a core.
        progress: told which campaign is done and the share of all; default a bar in a terminal or a notebook.

    Returns:
        Over ``campaign`` and ``parameter``: ``value`` and ``std`` (SI, unit in the coordinate ``unit``); over
        ``campaign``: ``error`` and ``unseen_error`` (floors), ``cost``, ``cycles`` and ``note``, which says why a
        campaign could not be fitted (its numbers are nan).

    Raises:
        InputError: no campaign, two of one name, no scheduler at that address, or dask.distributed is missing.
    """
    bare = [campaigns] if isinstance(campaigns, Campaign | str | Path | Mapping) else campaigns
    if any(isinstance(one, Campaign) for one in bare):
        raise ArgumentError("a campaign by itself has no name", key="campaigns", hint='give {"name": campaign}')
    campaigns = campaigns if isinstance(campaigns, Mapping) else several(campaigns)
    named = dict(campaigns) if isinstance(campaigns, Mapping) else {_name(Path(p)): p for p in campaigns}
    if not named or len(named) != len(campaigns):
        raise InputError("at least one campaign is needed, each with a unique name", value=len(campaigns))
    found: dict[str, dict[str, Any]] = {}
    with reporting("studying", progress) as tell, cluster(scheduler, workers) as client, client.as_current():
        from distributed import as_completed

        local = None if scheduler else os.getpid()
        own = (several(effects), tuple(map(str, several(effect_files))), local)
        given = {n: c if isinstance(c, Campaign) else str(Path(c).resolve()) for n, c in named.items()}
        work = {client.submit(_fitted, one, *own, pure=False): name for name, one in given.items()}
        for done in as_completed(work):
            name = work[done]
            found[name] = done.result()
            tell(name, len(found) / len(named))
    return _together({name: found[name] for name in named})


def _name(path: Path) -> str:
    return path.resolve().parent.name if path.name == "campaign.toml" else path.stem


def _fitted(
    given: str | Campaign, effects: tuple[str, ...], files: tuple[str, ...], parent: int | None
) -> dict[str, Any]:
    """One campaign, in a worker."""
    if parent is not None:
        end_with(parent)
    process.begin()
    threads.alone(False)  # campaigns share the processors
    try:
        fit = _loaded(given, files).fit(effects, progress=silent)
    except StickslipError as error:
        return {"note": str(error).split("\n")[0]}
    frame = fit.parameters
    cycles = sum(len(s.events) for s in fit.climbed.prepared.segmentations)
    whole = {"error": fit.error, "unseen_error": fit.unseen_error, "cost": fit.climbed.fit.cost, "cycles": cycles}
    return {"note": "", **whole, "parameters": {n: (r["value"], r["std"], r["unit"]) for n, r in frame.iterrows()}}


def _loaded(given: str | Campaign, files: tuple[str, ...]) -> Campaign:
    if not isinstance(given, Campaign):
        return load_campaign(given, files)
    if files or given.effect_files:  # its own are known in the process that sent it
        from ..simulation.conformance import load_effects

        load_effects([*given.effect_files, *map(Path, files)])
    return given


def _together(found: Mapping[str, Mapping[str, Any]]) -> xarray.Dataset:
    import xarray

    units: dict[str, str] = {}
    for one in found.values():
        units |= {name: unit for name, (_, _, unit) in one.get("parameters", {}).items()}
    table = np.full((2, len(found), len(units)), np.nan)
    for i, one in enumerate(found.values()):
        for j, name in enumerate(units):
            table[:, i, j] = one.get("parameters", {}).get(name, (np.nan, np.nan))[:2]
    both = ("campaign", "parameter")
    whole = {k: ("campaign", np.array([float(one.get(k, np.nan)) for one in found.values()])) for k in WHOLE}
    note = ("campaign", [one["note"] for one in found.values()])
    return xarray.Dataset(
        {"value": (both, table[0]), "std": (both, table[1]), **whole, "note": note},
        coords={"campaign": list(found), "parameter": list(units), "unit": ("parameter", list(units.values()))},
    )
