"""Simulation-based calibration of the posterior sample (Talts et al., arXiv:1804.06788), on the independent simulator.

    python -m tests.force.ranks FOLDER [--number 60]

Rigs are drawn, two runs of each simulated with other rough lines at every event, fitted and sampled. Where the
posterior is right the true value is as likely to be the smallest of the draws as any other: its rank among them is
uniform. FOLDER keeps what is finished, and the same command goes on from there. Writes docs/results/posterior.json and
docs/figures/posterior-ranks.png, for docs/diagnosis.md.

Drop, slip distance, healing time and damping are drawn over ranges of ten to a thousand deviations of their posterior,
so that what the fit assumes of them beforehand does not matter; the strength and its prior follow from the file.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import arviz
import numpy as np
from scipy.stats import kstest, kstwo

import stickslip as ss
from stickslip.blind.generator import Run, make_campaign
from stickslip.show.plots import save
from stickslip.show.plots.style import DARK, LIGHT, figure, styled
from tests.kept_cases import each
from tests.kept_results import keep

ROOT = Path(__file__).parents[2]
RUNS = (Run("v100", 1e-4, 5), Run("v400", 4e-4, 5))
DRAWS, TUNE, CHAINS = 150, 100, 2
THINNED = 50  # draws that are compared: more are not independent
SEED, APART = 5000, 10  # of the first rig, and the next
SHARES = (0.5, 0.9)


def truths(rig: dict[str, Any]) -> dict[str, float]:
    """What a rig of the simulator has, by the names of the fit."""
    return {
        "contact.strength": rig["mu_s"] * sum(rig["loads"]),
        "weakening.drop": 1.0 - rig["mu_k"] / rig["mu_s"],
        "weakening.slip_distance": rig["slip_length"],
        "weakening.healing_time": rig["heal_time"],
        "rig.damping": rig["damping"],
    }


def one(seed: int) -> dict[str, Any]:
    """Ranks of the true values among the draws of one campaign, 0 to :data:`THINNED`."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case"
        truth = make_campaign(case, seed, runs=RUNS, new_lines=True, spring_known=True, grouped=False)
        fit = ss.load_campaign(case / "campaign.toml").fit()
        found = fit.sample(draws=DRAWS, tune=TUNE, chains=CHAINS, seed=seed, progress=lambda text, share: None)
    rows = {}
    for name, value in truths(truth["rig"]).items():
        drawn = found.posterior[name].values.ravel()
        kept = drawn[np.linspace(0, drawn.size - 1, THINNED).astype(int)]
        rows[name] = {
            "rank": int(np.sum(kept < value)),
            "off": float((drawn.mean() - value) / drawn.std()),
            "of the fit": float(drawn.std() / fit.std[name]),
            "rhat": float(arviz.rhat(found, var_names=[name])[name]),
        }
    return {"seed": seed, "trust": found.posterior.attrs["trust"], "parameters": rows}


def tally(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Of every parameter: ranks, how likely they are if uniform, the share of truths in the central intervals."""
    out: dict[str, Any] = {}
    for name in cases[0]["parameters"]:
        rows = [case["parameters"][name] for case in cases]
        ranks = np.array([row["rank"] for row in rows])
        even = (ranks + 0.5) / (THINNED + 1.0)
        off = np.array([row["off"] for row in rows])
        out[name] = {
            "ranks": ranks.tolist(),
            "chance": float(kstest(even, "uniform").pvalue),
            "within": {f"{share:.0%}": float(np.mean(np.abs(even - 0.5) < 0.5 * share)) for share in SHARES},
            "mean off": float(off.mean()),
            "rms off": float(np.sqrt(np.mean(off**2))),
            "of the fit": float(np.median([row["of the fit"] for row in rows])),
            "worst rhat": float(max(row["rhat"] for row in rows)),
        }
    return out


@styled
def picture(found: dict[str, Any]) -> Any:
    """Share of true values below each rank, less that of a uniform rank, with the band of chance."""
    names = list(found)
    made, axes = figure(1, len(names), width=2.0 * len(names), height=2.3)
    for ax, name in zip(axes[0], names, strict=True):
        ranks = (np.array(found[name]["ranks"]) + 0.5) / (THINNED + 1.0)
        at = np.linspace(0.0, 1.0, 201)
        below = np.mean(ranks[:, None] <= at, axis=0) - at
        band = kstwo.ppf(0.95, ranks.size)
        ax.axhspan(-band, band, color=LIGHT, alpha=0.3, lw=0)
        ax.axhline(0.0, color=DARK, lw=0.6)
        ax.plot(at, below, color=DARK, lw=1.4)
        ax.set(title=name.split(".")[1].replace("_", " "), xlabel="rank / draws", ylim=(-0.6, 0.6))
    axes[0, 0].set_ylabel("ECDF of ranks - uniform")
    for ax in axes[0, 1:]:
        ax.set_yticklabels([])
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--number", type=int, default=60)
    options = parser.parse_args()
    cases = []
    seeds = range(SEED, SEED + APART * options.number, APART)
    for name, case in each(options.folder, map(str, seeds), lambda seed: one(int(seed))):
        cases.append(case)
        print(name, case["trust"], {k: v["rank"] for k, v in case["parameters"].items()}, flush=True)
    found = tally(cases)
    command = f"python -m tests.force.ranks FOLDER --number {len(cases)}"
    keep("posterior", command, campaigns=len(cases), draws=THINNED, seed=SEED, parameters=found)
    save(picture(found), ROOT / "docs" / "figures" / "posterior-ranks.png", dpi=90)
    for name, row in found.items():
        print(name, {k: v for k, v in row.items() if k != "ranks"})


if __name__ == "__main__":
    main()
