"""The paper slider: its slips, the scale of its force, ripple, the static model and the dynamic one."""

from __future__ import annotations

import json
from pathlib import Path
from statistics import mean, stdev
from typing import Any

import numpy as np

from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import segment
from stickslip.data.segment.stick_ripple import stick_spectrum
from stickslip.show.report.figures import ripple_picture, trace_picture

from .campaigns import campaign, keep, program, result

PAPER_RIG = """[rig]
mass = "30.7 g"
contacts = 1
normal_force = "0.3012 N"
friction_coefficient = {{ guess = 0.3, lower = 0.15, upper = 0.6 }}
spring_stiffness = "{k} N/m"
"""
PAPER = """[[trace]]
name = "k{k}v{v}"
file = "{data}/paper-slider-ens/k{k}Nm_v{v}.mat"
outside = true
time = {{ column = "t", unit = "s" }}
spring_force = {{ column = "Fnorm", unit = "0.3012 N" }}
drive_velocity = "{v} um/s"
"""

# peaks of the force that the collector of the records counted
BY_EYE = {
    (168, 1100): "119", (168, 4300): "67", (1002, 1100): "224", (1002, 4300): "132",
    (2254, 42): "0", (2254, 1100): "few", (2254, 4300): "168",
}  # fmt: skip


def paper(data: Path, work: Path) -> dict[str, Any]:
    """The paper slider."""
    rig = PAPER_RIG.format(k=168)
    path = campaign(work, "paper", "Paper on paper", rig, PAPER.format(k=168, v=42, data=data))
    seen, arrays = result(path, work / "paper", "inspect")
    trace = seen["traces"][0]
    keep(trace_picture(arrays, 0, trace), "real-paper", 90)
    keep(ripple_picture(arrays, 0, {**trace["ripple"], "name": trace["name"]}), "real-paper-ripple", 90)
    slips = [1e6 * e["slip"] for e in trace["events"]]
    static, _ = result(path, work / "paper-static", "fit", "--model", "static", "--v-lim", "10 um/s")
    part = PAPER.format(k=168, v=42, data=data) + 'start = "260 s"\nstop = "300 s"\n'
    short = campaign(work, "paper-part", "Paper on paper", rig, part)
    dynamic, _ = result(short, work / "paper-dynamic", "fit")
    others = []
    for k, v in ((168, 1100), (168, 4300), (1002, 1100), (1002, 4300), (2254, 42), (2254, 1100), (2254, 4300)):
        other = PAPER_RIG.format(k=k)
        file = campaign(work, f"paper{k}-{v}", "Paper on paper", other, PAPER.format(k=k, v=v, data=data))
        found = json.loads(program("inspect", file, "--json")[1])["traces"][0]
        others.append({
            "k": k, "v_um_s": v, "slips": len(found["events"]), "motion": found["regime"], "by_eye": BY_EYE[k, v],
        })  # fmt: skip
    ripple, static = trace["ripple"], static["static"]
    f, a = arrays["trace0_ripple_frequency"].values, arrays["trace0_ripple_amplitude"].values
    last = dynamic["ladder"][-1]
    return {
        "slips": len(slips),
        "large": sum(s > 15 for s in slips),
        "mean_um": mean(slips),
        "std_um": stdev(slips),
        "says": [*seen["can"], *seen["cannot"]],
        "gain": {name: trace["stick_gain"][name] for name in ("sticks", "value", "std")},
        "part_s": dynamic["traces"][0]["duration"],
        "scale": [dynamic["parameters"]["sensor.force_scale"][name] for name in ("value", "std")],
        "fit_says": [note for note in dynamic["notes"] if "sensor-gain" in note],
        "ripple": ripple["text"],
        "lines_near": sum(0.1 < line["period"] < 0.2 for line in ripple["lines"]),
        "around_nm": 1e9 * float(a[(f > 1 / 0.17) & (f < 1 / 0.13)].max()),
        "without_phase": without_phase(path),
        "static": {name: static[name] for name in ("text", "satisfying", "processes", "median_nrmse")},
        "dynamic": {
            "error": last["train_error"], "cycles": dynamic["fit"]["cycles"], "by_phase": last["by_phase"],
            "level": dynamic["scatter"]["text"],
        },
        "others": others,
    }  # fmt: skip


def without_phase(path: str) -> dict[str, float]:
    """What the mean of the sticks' spectra without phase says of a ripple of 0.15 s."""
    (trace,) = load_traces(load_campaign(path))
    f, a, sticks = stick_spectrum(trace, segment(trace))
    inside = (f > 1 / 0.17) & (f < 1 / 0.13)
    beside = (f > 4.5) & (f < 10.0) & ~inside
    smooth = np.exp(np.polyval(np.polyfit(np.log(f[beside]), np.log(a[beside] ** 2), 2), np.log(f[inside])))
    excess = float(np.sqrt(max(np.max(a[inside] ** 2 - smooth), 0.0)))
    # a mean of so many powers of noise is known to its size over their root
    seen = float(np.sqrt(3.0 / np.sqrt(sticks) * np.max(smooth)))
    return {
        "sticks": sticks, "from_nm": 1e9 * float(a[inside][0]), "from_hz": float(f[inside][0]),
        "to_nm": 1e9 * float(a[inside][-1]), "to_hz": float(f[inside][-1]), "excess_nm": 1e9 * excess,
        "visible_nm": 1e9 * seen,
    }  # fmt: skip
