"""Break-away ramps of a robot's joints, by the static model."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from stickslip.show.report.fit_figures import ramp_grid

from .campaigns import campaign, keep, result

RAMP = """[[trace]]
name = "joint {joint}, {name}"
file = "{position}"
outside = true
time = {{ column = 1, unit = "s" }}
displacement = {{ column = 2, unit = "mm" }}
spring_force = {{ column = 2, unit = "N", file = "{torque}" }}
minimum_slip = "{smallest} mm"
stop = "{stop:.3f} s"
virgin = true
"""


def robot(data: Path, work: Path) -> dict[str, Any]:
    """The robot's break-away ramps."""
    folder = data / "robot-breakaway-creep" / "test1"
    parts, left_out = [], []
    for position in sorted(folder.glob("*pos*")):
        torque = Path(str(position).replace("pos", "tau"))
        joint = 1 if "pos1" in position.name else 2
        rate = 0.5 if joint == 1 else 0.1  # N m/s
        t, tau = np.loadtxt(torque).T
        if np.mean(np.diff(t) <= 0) > 0.1:
            left_out.append(position.stem)
            continue
        # the controller's return motion is no part of the ramp
        off = np.flatnonzero(np.abs(np.abs(tau) - rate * t) > 1.5 * rate)
        stop = t[off[0] - 2] if off.size else t[-1]
        name = position.stem.removeprefix("est_").removesuffix("_gan")
        parts.append(
            RAMP.format(
                joint=joint,
                name=name,
                position=position,
                torque=torque,
                smallest=0.03 if joint == 1 else 0.3,
                stop=stop,
            )
        )
    path = campaign(work, "robot", "Robot joints", *parts)
    found, arrays = result(path, work / "robot", "fit", "--model", "static")
    r = found["ramps"]
    keep(ramp_grid(arrays, r["fits"]), "real-robot")
    low = [
        float(abs(arrays[f"ramp{i}_displacement"].values[: len(arrays[f"ramp{i}_tau"]) // 5]).max() / f["u_max"])
        for i, f in enumerate(r["fits"])
    ]
    worst = max(r["fits"], key=lambda f: f["nrmse"])
    joints = []
    for joint in (1, 2):
        own = [f for f in r["fits"] if f["trace"].startswith(f"joint {joint}")]
        joints.append({
            "joint": joint, "ramps": len(own), "fit": sum(f["satisfying"] for f in own),
            "median_nrmse": median(f["nrmse"] for f in own), "u_max_deg": median(1e3 * f["u_max"] for f in own),
        })  # fmt: skip
    return {
        "text": r["text"],
        "ramps": r["ramps"],
        "satisfying": r["satisfying"],
        "median_nrmse": r["median_nrmse"],
        "left_out": left_out,
        "joints": joints,
        "dead": sum(x < 0.01 for x in low),
        "worst": worst["trace"],
        "worst_nrmse": worst["nrmse"],
        "at_edge": sum(bool(f["note"]) for f in r["fits"]),
    }
