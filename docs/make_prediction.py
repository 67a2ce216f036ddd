"""Slips through another spring, from a model fitted to records of one spring: ``docs/results/prediction.json``.

    python docs/make_prediction.py [FOLDER]

FOLDER holds the records (default: the environment's STICKSLIP_REAL_DATA), which are others' and not part of this
repository. Also writes docs/figures/real-prediction.png.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import stickslip as ss
from stickslip.inference.forecast.wander import Wander, covariance
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, MIDDLE, figure, styled
from tests.kept_results import keep

DOCS = ROOT / "docs"
SPEEDS = ROOT / "scenarios" / "real" / "paper-slider-speeds.toml"
SOFT, STIFF = 168, 1002  # N/m
VELOCITIES = (1100, 4300)  # um/s
SETTLED = 3  # slips from the start of a simulation that are not counted
EVENTS, DRAWS, SEED = 12, 200, 1
NEW = """schema = 1
title = "Paper on paper, {k} N/m"
[rig]
mass = "30.7 g"
contacts = 1
normal_force = "0.3012 N"
spring_stiffness = "{k} N/m"
[[trace]]
name = "k{k}v{v}"
file = "k{k}Nm_v{v}.mat"
time = {{ column = "t", unit = "s" }}
spring_force = {{ column = "Fnorm", unit = "0.3012 N" }}
drive_velocity = "{v} um/s"
"""


def measured(folder: Path, k: int, v: int) -> ss.Campaign:
    """One record as a campaign."""
    path = folder / f"k{k}v{v}.toml"
    path.write_text(NEW.format(k=k, v=v), encoding="utf-8")
    return ss.load_campaign(path)


def drawn(law: Wander, mean_slip: float, period: float, k: float, v: float, rng: np.random.Generator) -> Any:
    """Slips (m) and recurrences (s) whose levels wander as a law says, around those of a simulation."""
    n = EVENTS * 10
    onset = period * np.arange(n)
    path = v * onset
    at = {"time": np.repeat(onset, 2), "slip path": np.stack([path, path + mean_slip], 1).ravel()}
    at["place"] = at["slip path"]
    kind = np.tile([0, 1], n)
    total = np.diag(np.array(law.scatter)[kind] ** 2)
    for part in law.components:
        size = np.array(part.size)[kind]
        apart = np.abs(at[part.coordinate][:, None] - at[part.coordinate])
        total += size[:, None] * size * covariance(part.kernel, apart, part.length)
    level = rng.multivariate_normal(np.zeros(2 * n), total, DRAWS, method="cholesky").reshape(DRAWS, n, 2)
    slips = mean_slip + (level[:, :, 0] - level[:, :, 1]) / k
    waits = period + (level[:, 1:, 0] - level[:, :-1, 1]) / (k * v)
    return slips.ravel(), waits.ravel()


def compared(own: np.ndarray, seen: np.ndarray) -> dict[str, Any]:
    """Mean and standard deviation, and quantiles side by side."""
    shares = (np.arange(99) + 1) / 100
    return {
        "predicted": [float(own.mean()), float(own.std())], "measured": [float(seen.mean()), float(seen.std())],
        "quantiles": [np.quantile(own, shares).tolist(), np.quantile(seen, shares).tolist()], "of": int(seen.size),
    }  # fmt: skip


LONG = 1.6  # medians, from which a wait is looked at by itself


def long_waits(levels: Any, k: float, v: float) -> dict[str, Any]:
    """Where the long waits of a record come from: how far the slider goes in a stick, and how far the force rises."""
    waits = levels["recurrence"].values[1:]
    rise = levels["onset"].values[1:] - levels["arrest"].values[:-1]
    loaded = v * (levels["time_onset"].values[1:] - levels["time_arrest"].values[:-1])
    gone = (loaded - rise / k) / loaded
    far = waits > LONG * np.median(waits)
    return {
        "of": int(waits.size),
        **{
            name: {
                "waits": int(own.sum()), "mean": float(waits[own].mean()), "std": float(waits[own].std()),
                "gone": float(np.median(gone[own])), "rise": float(rise[own].mean()),
                "slip_before": float(levels["slip"].values[:-1][own].mean()),
            }
            for name, own in (("long", far), ("others", ~far))
        },
        "next_to_next": float(np.corrcoef(waits[1:], waits[:-1])[0, 1]),
    }  # fmt: skip


@styled
def quantiles(found: dict[str, Any]) -> Any:
    """Predicted against measured quantiles."""
    made, axes = figure(1, 2, width=9.0, height=4.2)
    for axis, what, k, unit in zip(axes[0], ("slip", "recurrence"), (1e6, 1e3), ("µm", "ms"), strict=True):
        slipping = {v: rows for v, rows in found.items() if not rows["slides"]}
        for (v, rows), color, mark in zip(slipping.items(), (DARK, MIDDLE), "o^", strict=False):
            own, seen = (k * np.array(q) for q in rows[what]["quantiles"])
            axis.plot(seen, own, mark, ms=3, color=color, label=f"{v} µm/s")
        low, high = 0.0, 1.05 * max(k * max(map(max, rows[what]["quantiles"])) for rows in slipping.values())
        axis.plot([low, high], [low, high], "-", lw=0.8, color=DARK)
        axis.set(xlabel=f"measured {what} / {unit}", ylabel=f"predicted {what} / {unit}")
        axis.legend(title="quantiles, 1 to 99 %")
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", default=os.environ.get("STICKSLIP_REAL_DATA", ""))
    records = Path(parser.parse_args().folder).resolve() / "paper-slider-ens"
    if not records.is_dir():
        raise SystemExit(f"there is no folder {records}; name the one above it, or set STICKSLIP_REAL_DATA")
    rng = np.random.default_rng(SEED)
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        for file in records.glob("*.mat"):
            shutil.copy(file, work)
        path = Path(shutil.copy(SPEEDS, work))
        assert tomllib.loads(path.read_text(encoding="utf-8"))["rig"]["spring_stiffness"] == f"{SOFT} N/m"
        fit = ss.load_campaign(path).fit()
        for v in VELOCITIES:
            made = fit.simulate([f"block.spring_stiffness={STIFF} N/m", f"drive.velocity={v} um/s"], events=EVENTS)
            levels = measured(work, STIFF, v).levels()
            if made.sizes["event"] < EVENTS:
                found[str(v)] = {"slides": True, "slips": int(levels.sizes["slip_number"])}
                continue
            slip, period = (float(np.mean(made[key].values[SETTLED:])) for key in ("slip", "recurrence"))
            law = measured(work, SOFT, v).forecast().laws[0].law
            slips, waits = drawn(law, slip, period, STIFF, 1e-6 * v, rng)
            found[str(v)] = {
                "slides": False, "law": str(law), "simulated": {"slip": slip, "recurrence": period},
                "slip": compared(slips, levels["slip"].values),
                "recurrence": compared(waits, levels["recurrence"].values[1:]),
                "long_waits": long_waits(levels, STIFF, 1e-6 * v),
            }  # fmt: skip
    save(quantiles(found), DOCS / "figures" / "real-prediction.png", dpi=80)
    keep("prediction", "python docs/make_prediction.py", stiffness=STIFF, velocities=found, **{"from": SOFT})


if __name__ == "__main__":
    main()
