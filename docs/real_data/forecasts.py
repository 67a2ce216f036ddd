"""Levels and forecasts of the records whose slips are irregular."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas

import stickslip as ss
from stickslip.inference.forecast.predict import METHODS, Forecaster
from stickslip.inference.forecast.rolling import roll
from stickslip.inference.forecast.scoring import quantiles
from stickslip.inference.forecast.wander import Wander
from stickslip.objects.forecast import Forecast
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, styled

from .campaigns import keep, shipped

# share for training, for the fault as those who published learners of it
RECORDS = {"paper slider": ("paper-slider", 0.5), "laboratory fault": ("laboratory-fault", 0.7)}
STEPS = 70  # samples at the end of the record that their score leaves out
LEADS = (0.5, 1.0)  # s before an onset, from which on forecasts are not counted


def chosen(found: Forecast) -> tuple[Wander, bool]:
    """Law of a forecast, and whether it uses the rise of late."""
    told = found.result["chosen"]
    return next(c.law for c in found.laws if str(c.law) == told["law"]), told["rise"]


def learners(found: Forecast, file: Path) -> dict[str, float]:
    """R2 of the time to the start of failure on the same samples and the same target as the published learners'.

    Their target is the column ``TimeToStartFailure``, which counts from the top of the stress, somewhat before our
    onsets; the usual difference is taken from the part for training. While a slip is seen to go on, the mean
    recurrence less the time since its onset stands in. ``in sticks``: without the samples from the top of the stress to
    the end of the slip, in which it is not the same slip that the two count to.
    """
    target = pandas.read_csv(file)["TimeToStartFailure"].to_numpy()
    past, time = found.past, found.past.trace.time
    first, last = int(0.7 * target.size), target.size - STEPS
    onsets = past.arrays["time_onset"]
    next_onset = np.searchsorted(onsets, time[:first])
    sticks = (next_onset > 0) & (next_onset < onsets.size) & (target[:first] > 1.0)
    early = float(np.median(onsets[next_onset[sticks]] - time[:first][sticks] - target[:first][sticks]))
    forecaster = Forecaster(past, *chosen(found))
    means = {name: np.zeros(last - first) for name in METHODS[:2]}
    seen = []
    for row, i in enumerate(range(first, last)):
        told = forecaster.at(i)
        seen.append(told is not None)
        for name, out in means.items():
            if told is not None:
                # a start that has passed, though no onset is seen yet, leaves the one after it to be told
                left = told[name] - early
                out[row] = float(np.where(left >= 0.0, left, left + forecaster.recurrence).mean())
            else:
                before = int(np.searchsorted(past.visible, time[i], side="right")) - 1
                out[row] = forecaster.recurrence - early - (time[i] - onsets[before])
    truth = target[first:last]
    ours = onsets[np.minimum(np.searchsorted(onsets, time[first:last]), onsets.size - 1)] - time[first:last]
    same = (np.abs(ours - early - truth) < 1.0) & np.array(seen)

    def r2(told: np.ndarray, chosen: np.ndarray) -> float:
        rest = float(np.sum((truth[chosen] - truth[chosen].mean()) ** 2))
        return 1.0 - float(np.sum((told - truth)[chosen] ** 2)) / rest

    out_all: dict[str, float] = {"samples": last - first, "in sticks": int(same.sum()), "earlier": early}
    for name, told_means in means.items():
        out_all[f"r2 {name}"] = r2(told_means, np.ones(truth.size, bool))
        out_all[f"r2 {name}, in sticks"] = r2(told_means, same)
    return out_all


def own_scores(found: Forecast) -> dict[str, Any]:
    """What is kept of a forecast."""
    kept = ("train", "levels", "laws", "coordinate", "score", "methods", "gains", "by_moment", "chosen")
    out = {key: found.result[key] for key in kept}
    law, _ = chosen(found)
    out["growth"] = Forecaster(found.past, law).curves.growth
    for name, rise in (("with the rise of late", True), ("without the rise of late", False)):
        out[name] = roll(found.past, law, rise=rise).score()[METHODS[0]]
    early = {lead: found.rolled.ahead(lead) for lead in LEADS}
    out["ahead"] = {
        f"{lead:g} s": {
            "methods": {name: s["crps"] for name, s in rolled.score().items()},
            "gains": rolled.gains(),
            "forecasts": int(rolled.truth.size),
        }
        for lead, rolled in early.items()
    }
    return out


@styled
def picture(slider: Forecast, fault: Forecast) -> Any:
    """Levels of the paper slider, and forecasts along the end of the fault's record."""
    made, axes = figure(1, 2, width=12.0, height=3.8)
    ax, beside = axes[0, 0], axes[0, 1]
    data = slider.arrays
    ax.plot(data.time_onset, 1e3 * data.onset, ".-", color=DARK, lw=0.8, ms=3.5, label="at onset")
    ax.plot(data.time_arrest, 1e3 * data.arrest, ".-", color=MIDDLE, lw=0.8, ms=3.5, label="at arrest")
    ax.set(xlabel="time / s", ylabel="force of the spring / mN", title="paper slider, every slip")
    ax.legend(loc="best")
    past, forecaster = fault.past, Forecaster(fault.past, *chosen(fault))
    t, onsets = past.trace.time, past.arrays["time_onset"]
    shown = np.arange(int(np.searchsorted(t, past.split)), int(np.searchsorted(t, past.split + 45.0)))
    rows = []
    for i in shown.tolist():
        begun = np.searchsorted(onsets, t[i]) != np.sum(past.known <= t[i])
        told = None if begun else forecaster.at(i)
        band = np.full(3, np.nan) if told is None else quantiles(told[METHODS[0]], [0.05, 0.5, 0.95])
        rows.append([t[i] - past.split, onsets[np.searchsorted(onsets, t[i])] - t[i], *band])
    r = np.array(rows)
    beside.fill_between(r[:, 0], r[:, 2], r[:, 4], color=LIGHT, alpha=0.6, lw=0, label="90 % interval")
    beside.plot(r[:, 0], r[:, 3], color=MIDDLE, lw=1.4, label="median")
    beside.plot(r[:, 0], r[:, 1], color=DARK, lw=0.9, ls="--", label="measured")
    beside.set(xlabel="time since the end of training / s", ylabel="time to the next slip / s")
    beside.set_title("laboratory fault")
    beside.legend(loc="upper right", ncols=3)
    beside.set_ylim(0.0, 8.5)
    return made


def forecasts(data: Path, work: Path) -> dict[str, Any]:
    """Both records, and the picture of the page."""
    found: dict[str, Forecast] = {}
    results: dict[str, Any] = {}
    for name, (file, train) in RECORDS.items():
        found[name] = whole(file, data, work / file).forecast(train=train)
        results[name] = own_scores(found[name])
    fault = next((work / "laboratory-fault").glob("*.csv"))
    results["laboratory fault"]["learners"] = learners(found["laboratory fault"], fault)
    # the same law through the slip path: how strongly the choice of coordinate matters
    slider = found["paper slider"]
    alone = {str(c.law): roll(slider.past, c.law).score()[METHODS[0]]["crps"] for c in slider.laws}
    results["paper slider"]["crps by law"] = alone
    keep(picture(found["paper slider"], found["laboratory fault"]), "forecast", 90)
    return {"records": results}


def whole(name: str, data: Path, work: Path) -> ss.Campaign:
    """A shipped campaign, whose record is used from its beginning to its end."""
    path = shipped(name, data, work).description.path
    lines = [row for row in path.read_text(encoding="utf-8").splitlines() if not row.startswith(("start", "stop"))]
    path.write_text("\n".join(lines), encoding="utf-8")
    return ss.load_campaign(path)
