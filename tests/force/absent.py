"""What laws gain that are not there, on motions of the program's own solver: for docs/diagnosis.md.

    python -m tests.force.absent [--number 8]

Four runs of the base model are read through a sensor with other noise each time, and effects are tried on each reading.
Here the model is right, so that all a law gains is by the reading and the fit: about one for each of its parameters,
where these are right. Writes docs/results/absent.json.
"""

from __future__ import annotations

import argparse

import numpy as np

from stickslip.data.segment import segment
from stickslip.inference.diagnose.prepare import prepare
from stickslip.inference.force.candidates import every_form, try_effect
from stickslip.inference.force.fit import fit_base
from stickslip.inference.force.signatures import Explained
from stickslip.system import process
from tests.force.counted_motions import COUNT, NOISE, Moved, moved, read
from tests.kept_results import keep

SPEEDS = ((5e-5, 14.0), (1e-4, 7.5), (2e-4, 4.0), (4e-4, 2.2))  # m/s, s
SENSORS = {"counts": (NOISE, COUNT), "counts, more noise": (3.5e-9, COUNT), "no counts": (2.6e-9, 0.0)}  # m
TAGS = (
    "velocity-weakening", "direct-effect", "rate-and-state", "contact-ageing", "viscoelastic-contact", "residual-load",
    "viscous-drag", "tilt", "contact-damping", "thermal-creep",
)  # fmt: skip


def gains(runs: list[Moved], seed: int, noise: float, count: float) -> dict[str, tuple[float, int]]:
    """What the first form of each effect gains, and how many parameters it has."""
    campaign = read(runs, seed, noise, count)
    prepared = prepare(campaign.description, campaign.traces, [segment(t) for t in campaign.traces])
    base = fit_base(prepared.problem, prepared.start)
    explained, out = Explained(base), {}
    for tag in TAGS:
        (found,) = try_effect(base, explained, tag, [form for _, form in every_form([tag])][:1])
        assert found.fit is not None
        own = sum(f.name.startswith(f"{tag}.") for f in found.fit.free)
        out[tag] = (base.cost - found.fit.cost, own)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=8)
    options = parser.parse_args()
    process.begin()
    runs = [moved(*s, tolerance=1e-5, damping=8.0, healing_time=8e-3) for s in SPEEDS]
    rows: dict[str, dict[str, float]] = {}
    for name, sensor in SENSORS.items():
        found = [gains(runs, seed, *sensor) for seed in range(options.number)]
        for tag in TAGS:
            row = rows.setdefault(tag, {"parameters": found[0][tag][1]})
            values = np.array([f[tag][0] for f in found])
            row[name], row[f"{name}, most"] = float(values.mean()), float(values.max())
        print(name, {tag: round(row[name], 1) for tag, row in rows.items()}, flush=True)
    command = f"python -m tests.force.absent --number {options.number}"
    sensors = {name: {"noise": noise, "count": count} for name, (noise, count) in SENSORS.items()}
    keep("absent", command, readings=options.number, sensors=sensors, effects=rows)


if __name__ == "__main__":
    main()
