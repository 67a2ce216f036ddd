"""How far parameters of a fit are off in the mean, with and without noise of the readings: for docs/diagnosis.md.

    python -m tests.force.offsets [--number 8]

Two runs by the program's own solver are read through a sensor that counts, with other noise each time, and once without
noise. Any difference beyond the solver's tolerance is the fit's. Writes docs/results/offsets.json.
"""

from __future__ import annotations

import argparse
import json

import numpy as np

from tests.force.counted_motions import COUNT, NOISE, Moved, moved, read
from tests.kept_results import keep

SPEEDS = ((1e-4, 7.5), (2e-4, 4.0))  # m/s, s
TOLERANCE, SILENT = 1e-5, 1e-12  # of the solver; m


def truths(run: Moved) -> dict[str, float]:
    """What the model has, by the names of the fit; the drop is known together with the strength only."""
    weakening = run.model.weakening
    return {
        "weakening.slip_distance": float(weakening.slip_distance),
        "weakening.healing_time": float(weakening.healing_time),
        "rig.damping": float(run.model.block.damping),
    }


def off(runs: list[Moved], seed: int, noise: float, count: float) -> dict[str, tuple[float, float]]:
    """By how much each parameter is off: as a share, and in its stated deviations."""
    table = read(runs, seed, noise, count).fit(progress=lambda text, share: None).parameters
    out = {}
    for name, true in truths(runs[0]).items():
        value, std = float(table.loc[name, "value"]), float(table.loc[name, "std"])
        out[name] = (value / true - 1.0, (value - true) / std)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=8)
    options = parser.parse_args()
    runs = [moved(*s, tolerance=TOLERANCE, damping=8.0, healing_time=8e-3) for s in SPEEDS]
    still = off(runs, 0, SILENT, 0.0)
    noisy = [off(runs, seed, NOISE, COUNT) for seed in range(options.number)]
    rows = {}
    for name in still:
        shares, deviations = np.array([n[name] for n in noisy]).T
        rows[name] = {
            "without noise": still[name][0],
            "with noise": float(shares.mean()),
            "error": float(shares.std(ddof=1) / np.sqrt(len(noisy))),
            "in deviations": float(deviations.mean()),
        }
    command = f"python -m tests.force.offsets --number {options.number}"
    keep("offsets", command, readings=len(noisy), noise=NOISE, count=COUNT, parameters=rows)
    print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
