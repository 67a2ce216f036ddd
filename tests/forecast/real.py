"""Levels and forecasts of measured records, for docs/forecast.md.

    python -m tests.forecast.real [FOLDER]

FOLDER holds the records (default: the environment's STICKSLIP_REAL_DATA). They are others' and are not part of this
repository. Writes docs/results/forecast.json and docs/figures/forecast.png.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pandas

import stickslip as ss
from stickslip.inference.forecast.predict import METHODS, Forecaster
from stickslip.inference.forecast.rolling import prepare, roll
from stickslip.inference.forecast.scoring import quantiles
from stickslip.inference.forecast.wander import Wander
from stickslip.objects.forecast import Forecast
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, LIGHT, MIDDLE, figure, styled

DOCS = Path(__file__).parents[2] / "docs"
FAULT = "psu-stickslip-p5198/newDF_TimeToFailure_from_6600_to_6900_WITHOUT_subwindows.csv"
CAMPAIGNS = {
    "paper slider": """schema = 1
title = "Paper on paper"
[rig]
mass = "30.7 g"
spring_stiffness = "168 N/m"
[[trace]]
name = "k168v42"
file = "{data}/paper-slider-ens/k168Nm_v42.mat"
outside = true
time = {{ column = "t", unit = "s" }}
spring_force = {{ column = "Fnorm", unit = "0.3012 N" }}
drive_velocity = "42 um/s"
""",
    "laboratory fault": """schema = 1
title = "Laboratory fault p5198"
[[trace]]
name = "p5198"
file = "{data}/FAULT"
outside = true
time = {{ column = "Time", unit = "s" }}
drive_position = {{ column = "LPDisp", unit = "um" }}
spring_force = {{ column = "ShearStress", unit = "1 MPa * 25 cm^2" }}
""".replace("FAULT", FAULT),
}
TRAIN = {"paper slider": 0.5, "laboratory fault": 0.7}  # the latter as those who published learners of it
STEPS = 70  # samples at the end of the record that their score leaves out


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


def main() -> None:
    data = Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("STICKSLIP_REAL_DATA", ""))
    if not (data / FAULT).is_file():
        raise SystemExit(f"there are no records in '{data}'; name their folder, or set STICKSLIP_REAL_DATA")
    found: dict[str, Forecast] = {}
    results: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, text in CAMPAIGNS.items():
            path = Path(folder) / "campaign.toml"
            path.write_text(text.format(data=data.resolve()), encoding="utf-8")
            found[name] = ss.load_campaign(path).forecast(train=TRAIN[name])
            results[name] = own_scores(found[name])
            s = found[name].score
            print(
                f"{name}: CRPS {s['crps']:.3f} s (mean recurrence {s['crps_mean_recurrence']:.3f} s), R2 {s['r2']:.3f}"
            )
            ties = results[name]["levels"]
            print("  " + ", ".join(f"{k} {v:.3g}" for k, v in ties.items()))
    results["laboratory fault"]["learners"] = learners(found["laboratory fault"], data / FAULT)
    print(results["laboratory fault"]["learners"])
    # the same law through the slip path: how strongly the choice of coordinate matters
    past, laws = prepare(found["paper slider"].past.trace, 0.5)
    alone = {str(c.law): roll(past, c.law).score()[METHODS[0]]["crps"] for c in laws}
    results["paper slider"]["crps by law"] = alone
    (DOCS / "results").mkdir(exist_ok=True)
    head = {"version": ss.__version__, "date": date.today().isoformat(), "command": "python -m tests.forecast.real"}
    text = json.dumps({**head, "records": results}, indent=1, default=float)
    (DOCS / "results" / "forecast.json").write_text(text + "\n", encoding="utf-8")
    save(picture(found["paper slider"], found["laboratory fault"]), DOCS / "figures" / "forecast.png", dpi=90)


if __name__ == "__main__":
    main()
