"""A forecast of the next slip, from how levels wander and how the load rises, scored on slips it has not seen."""

from __future__ import annotations

import shutil
import time
from collections.abc import Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError, InputError, nearest
from ..inference.forecast.coordinate_text import steps, told
from ..inference.forecast.known_record import Past
from ..inference.forecast.levels import levels, wandering
from ..inference.forecast.predict import (
    METHODS,
    Compared,
    Forecaster,
    best_first,
    candidates,
    compared,
    goes_back,
    training_slips,
)
from ..inference.forecast.rolling import SHARES, Rolled, choose, roll
from ..inference.forecast.scoring import quantiles
from ..inference.forecast.wander import Wander
from ..system.object_repr import facts, table
from ..system.progress import reporting
from ..system.runstore import json_text, open_run, versions
from .checkpoints import FinishedParts, code_digest
from .kept_forecast import Kept
from .result_base import Savable, Tell, dataset, finish, head
from .wander import most_slips

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .campaign import Campaign

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


class Forecast(Savable):
    """The outcome of :meth:`Campaign.forecast`.

    Attributes:
        campaign: what was forecast.
        past: the run, its part for training and its slips.
        laws: how levels may wander, the best first.
        rolled: forecasts along the later part, and what came.
        result: plain data, as in ``result.json``.
    """

    def __init__(
        self, campaign: Campaign, past: Past, laws: list[Compared], rolled: Rolled, result: dict[str, Any]
    ) -> None:
        self.campaign, self.past, self.laws, self.rolled, self.result = campaign, past, laws, rolled, result

    @property
    def score(self) -> dict[str, float]:
        """``crps``, ``coverage_50``, ``coverage_90``, ``mae``, ``r2`` and the CRPS of the plain forecasts (s)."""
        return dict(self.result["score"])

    @property
    def next(self) -> dict[str, float] | None:
        """Quantiles by their share of the time (s) from the end of the record to the slip that it does not hold."""
        found = self.result["next"]
        return None if found is None else dict(found)

    @cached_property
    def table(self) -> pandas.DataFrame:
        """A row for each method, with its scores."""
        return table(self.result["methods"], "forecast")

    @cached_property
    def wanders(self) -> pandas.DataFrame:
        """A row for each law of the wandering level, with its likelihood, its AIC and how it predicts later slips."""
        rows = {law["law"]: {k: law[k] for k in ("log_likelihood", "aic", "unseen")} for law in self.result["laws"]}
        return table(rows, "law")

    @cached_property
    def levels(self) -> xarray.Dataset:
        """Levels of every slip of the run, found with the settings of its first part; see :meth:`Campaign.levels`."""
        return self.arrays[[name for name, v in self.arrays.data_vars.items() if v.dims == ("slip_number",)]]

    @cached_property
    def arrays(self) -> xarray.Dataset:
        """Levels over ``slip_number``, forecasts over ``forecast``."""
        past, rolled = self.past, self.rolled
        length, level = past.settings.unit, past.scale.unit
        units = {"onset": level, "arrest": level, "direction": "1", "recurrence": "s"}
        data: dict[str, Any] = {
            name: ("slip_number", values, {"units": units.get(name, "s" if name.startswith("time") else length)})
            for name, values in past.arrays.items()
        }
        own = rolled.members[METHODS[0]]
        pit = [[float(np.mean(m < t)) for m, t in zip(rolled.members[k], rolled.truth, strict=True)] for k in METHODS]
        data |= {
            "moment": ("forecast", past.trace.time[rolled.sample], {"units": "s"}),
            "truth": ("forecast", rolled.truth, {"units": "s"}),
            "next_slip": ("forecast", rolled.slip + 1, {"units": "1"}),
            "quantile_times": (("forecast", "share"), quantiles(np.array(own), QUANTILES).T, {"units": "s"}),
            "pit": (("forecaster", "forecast"), np.array(pit), {"units": "1"}),
            "coordinates": {
                "slip_number": np.arange(1, len(past.events) + 1),
                "forecaster": list(METHODS), "share": list(QUANTILES),
            },
        }  # fmt: skip
        found = dataset(data, past.trace.name)
        return found.assign_attrs(split=past.split)

    @property
    def plot(self) -> ForecastPlots:
        """Its pictures, ``plot.levels()`` and ``plot.calibration()``."""
        return ForecastPlots(self)

    def _parts(self) -> list[Any]:
        r = self.result
        what = {"run": r["run"], "training": f"{r['train']['slips']} slips", "forecasts": r["score"]["forecasts"]}
        return [facts(what), r["coordinate"]["text"], self.table, self.wanders]


class ForecastPlots:
    """The pictures of a forecast, each of which returns its matplotlib figure.

    All of them take ``ax``: two axes to draw in, of a figure of one's own; texts, grid and frames are by ``rcParams``.
    """

    def __init__(self, found: Forecast) -> None:
        self._data = found.arrays

    def levels(self, *, ax: Sequence[Axes] | None = None) -> Figure:
        """Levels at onset and arrest against time, and the level at onset against that at the arrest before."""
        from ..show.report.forecast_figures import levels_picture

        return levels_picture(self._data, ax=ax)

    def calibration(self, *, ax: Sequence[Axes] | None = None) -> Figure:
        """Forecast intervals against what came, and the calibration of every method."""
        from ..show.report.forecast_figures import calibration_picture

        return calibration_picture(self._data, ax=ax)


def forecast(
    campaign: Campaign, run: str | None = None, train: float = 0.5, at: float | None = None, *,
    out: str | Path | None = None, force: bool = False, progress: Tell | None = None,
) -> Forecast:  # fmt: skip
    """Forecast the slips of the later part of a run, each from what was measured before it, and score it:
    ``campaign.forecast("v050", at=0.5)``.

    Args:
        campaign: the runs; called as its method, the campaign itself.
        run: name of the run; default the one with the most slips.
        train: share of its length from which everything is learned.
        at: mean recurrences after an arrest at which a forecast is made, once in each stick; default moments all
            along, ten in a mean recurrence.
        out: run folder for ``result.json``, ``arrays.nc``, ``report.html``, and until it is finished for the parts
            from which an interrupted forecast goes on; default none.
        force: replace an existing run folder.
        progress: called with a text and the share done (0 to 1); default a bar in a terminal or a notebook.

    Raises:
        InputError: no run of that name, too few slips, no load point or force, shares out of range.
        RunFolderError: the folder cannot be written.
    """
    number = _chosen(campaign, run)
    if at is not None and not at >= 0.0:
        raise ArgumentError("a moment before the stick begins", key="at", value=at, allowed="0 or more")
    if out is None:
        with reporting("forecasting", progress) as tell:
            return _forecast(campaign, number, train, at, Kept(), tell)
    with open_run(out, force=force, resume=True) as folder, reporting("forecasting", progress) as tell:
        folder.clear("pieces")
        # what was forecast of another run, or from another part of it, is of no use
        asked = {"run": campaign.names[number], "train": train}
        key = {"inputs": campaign.inputs(), **asked, "versions": versions(), "code": code_digest()}
        pieces = FinishedParts(folder, json_text(key))
        if ready := pieces.ready():
            tell(f"resuming from {ready} finished parts", 0.0)
        try:
            found = _forecast(campaign, number, train, at, Kept(pieces), tell)
        except KeyboardInterrupt:
            text = f"{pieces.ready()} finished parts are kept, and the same command resumes from them"
            raise KeyboardInterrupt(text) from None
        folder.arrays(found.arrays)
        folder.json(found.result)
        finish(folder)
        shutil.rmtree(folder.path("pieces"))
    return found


def _forecast(
    campaign: Campaign, number: int, train: float, at: float | None, kept: Kept, tell: Tell
) -> Forecast:  # fmt: skip
    began, trace = time.perf_counter(), campaign.traces[number]
    try:
        tell(f"levels of {trace.name}", 0.0)
        past = Past.of(trace, train)
        laws = _laws(past, kept, tell)
        law, rise = kept.choice(laws, lambda: choose(past, laws, tell))
        rolled = kept.rolled(_key(at), lambda: roll(past, law, at, tell, rise))
        if isinstance(rolled, InputError):
            raise rolled
    except InputError as error:
        raise error.at(file=campaign.description.path if campaign.description.filed else None) from None
    scores, gained = rolled.score(), rolled.gains()
    own = scores[METHODS[0]]
    others = {f"crps_{name.replace(' ', '_').replace('-', '_')}": scores[name]["crps"] for name in METHODS[1:]}
    counts = {"forecasts": int(rolled.truth.size), "slips": int(np.unique(rolled.slip).size)}
    result = {
        **head(campaign, "forecast"),
        "run": trace.name,
        "train": {"share": train, "until": past.split, "slips": training_slips(past), "of": len(past.events)},
        "at": at,
        "level_unit": past.scale.unit,
        "levels": dict(vars(wandering(levels(trace, campaign.scaled[0][number])))),
        "laws": [_law(c) for c in laws],
        "chosen": {"law": str(law), "rise": rise},
        "coordinate": told(laws, goes_back(past.arrays["direction"][: training_slips(past)]), steps(past.arrays)),
        "score": {**counts, **own, **others},
        "methods": scores,
        "gains": gained,
        "by_moment": _by_moment(past, law, rise, kept, tell),
        "next": _next(past, law, rise),
        "dropped": [str(d) for d in past.learned.dropped],
        "notes": _notes(past, at, law, rise),
        "seconds": round(time.perf_counter() - began, 3),
    }
    return Forecast(campaign, past, laws, rolled, result)


def _chosen(campaign: Campaign, run: str | None) -> int:
    """Number of the run: the one asked for, or that with the most slips."""
    if run is None:
        return most_slips(campaign)
    if run not in campaign.names:
        raise ArgumentError(f"there is no run '{run}'", key="run", hint=nearest(run, campaign.names))
    return campaign.names.index(run)


def _laws(past: Past, kept: Kept, tell: Tell) -> list[Compared]:
    """Every law of the wandering level, the best first."""
    training, arrays = training_slips(past), past.arrays
    every, found = candidates(arrays["direction"][:training]), []
    for n, components in enumerate(every):
        tell(f"laws of the level of {past.trace.name}", n / len(every))
        found.append(kept.law(components, partial(compared, arrays, components, training)))
    return best_first(found)


def _key(at: float | None) -> str:
    """Name of forecasts at a moment of each stick, or all along, among the parts that are kept."""
    return "rolled" if at is None else f"rolled-{at:.17g}"


def _law(one: Compared) -> dict[str, Any]:
    law = one.law
    return {
        "law": str(law),
        "components": [dict(vars(c)) for c in law.components],
        "scatter": law.scatter,
        "std": law.std,
        "log_likelihood": law.log_likelihood,
        "aic": law.aic,
        "unseen": float(one.unseen.mean()) if one.unseen.size else None,
    }


def _by_moment(past: Past, law: Wander, rise: bool, kept: Kept, tell: Tell) -> list[dict[str, Any]]:
    """Scores at moments so many mean recurrences after an arrest, once in each stick."""
    out = []
    for share in SHARES:
        rolled = kept.rolled(_key(share), partial(roll, past, law, share, tell, rise))
        if isinstance(rolled, InputError):
            continue  # no stick lasts so long
        scores = rolled.score()
        out.append({"at": share, "slips": int(rolled.truth.size), **scores[METHODS[0]],
                    "crps_mean_recurrence": scores["mean recurrence"]["crps"]})  # fmt: skip
    return out


def _next(past: Past, law: Wander, rise: bool) -> dict[str, float] | None:
    """Time from the end of the record to the next slip; None where the record ends within one."""
    found = Forecaster(past, law, rise).at(past.trace.time.size - 1)
    if found is None:
        return None
    return {f"{q:g}": float(v) for q, v in zip(QUANTILES, quantiles(found[METHODS[0]], QUANTILES), strict=True)}


def _notes(past: Past, at: float | None, law: Wander, rise: bool) -> list[str]:
    """What should be known of how it was made."""
    later = "at times spread evenly over the part after training"
    where = later if at is None else f"{at:g} mean recurrences after each arrest"
    how = f"{law}, {'with' if rise else 'without'} the recent rise of the level"
    said = [
        f"Forecasts are made {where}; each uses only what was measured by then.",
        f"Chosen within the part for training: {how}.",
    ]
    if goes_back(past.arrays["direction"]):
        said.append(
            "The block goes back: the reversal of the drive is not predicted, and no forecast extends beyond it."
        )
    if past.trace.drive_position is not None:
        said.append(
            "The load point was measured, so it is assumed to continue as fast as over the last mean recurrence."
        )
    return said
