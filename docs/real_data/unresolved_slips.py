"""Records whose slips are not resolved: the laboratory fault and the classroom slider."""

from __future__ import annotations

from pathlib import Path
from statistics import mean, median, stdev
from typing import Any

import numpy as np

from stickslip.show.report.figures import trace_picture

from .campaigns import keep, program, result, shipped


def fault(data: Path, work: Path) -> dict[str, Any]:
    """The laboratory fault."""
    path = str(shipped("laboratory-fault", data, work / "record").description.path)
    seen, arrays = result(path, work / "fault", "inspect")
    trace = seen["traces"][0]
    keep(trace_picture(arrays, 0, trace), "real-fault", 90)
    events = trace["events"]
    recurrence = [e["recurrence"] for e in events if e["recurrence"]]
    durations, slips = [e["duration"] for e in events], [e["slip"] for e in events]
    tied = float(np.corrcoef(durations, slips)[0, 1])
    refused = [program("fit", path, "--model", model)[1].splitlines()[0] for model in ("static", "inertial")]
    refused = [text.replace(str(Path(path).parent), "").replace("stickslip: ", "").lstrip("/") for text in refused]
    return {
        "slips": len(events),
        "recurrence_s": mean(recurrence),
        "recurrence_std_s": stdev(recurrence),
        "velocity_um_s": 1e6 * trace["drive_velocity"],
        "says": [*seen["can"], *seen["cannot"]],
        "duration_s": [median(durations), min(durations), max(durations)],
        "correlation": tied,
        "declined": refused,
    }


def classroom(data: Path, work: Path) -> dict[str, Any]:
    """The classroom slider: what the level of a slip follows, and the forecast."""
    campaign = shipped("classroom-slider", data, work / "classroom")
    sizes, forecast = campaign.levels()["slip"].values, campaign.forecast()
    keep(forecast.plot.levels(), "real-classroom")
    found = forecast.result
    return {
        "slips": int(sizes.size), "size_s": [float(sizes.mean()), float(sizes.std())],
        "levels": found["levels"], "coordinate": found["coordinate"]["text"], "methods": found["methods"],
        "gains": found["gains"], "train": found["train"], "chosen": found["chosen"],
    }  # fmt: skip
