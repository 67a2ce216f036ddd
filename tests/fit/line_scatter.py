"""What fresh rough lines do to the features, over the floors: tables of docs/challenge, by an independent simulator.

``python -m tests.fit.line_scatter`` makes the campaigns (four rigs; the same lines at every event, new ones, and new
ones on one, four and nine contacts of the same load), reduces them to features, and writes both tables to
docs/results/figures.json. The tests judge the same numbers.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from stickslip.blind.generator import draw_setup, make_campaign
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import segment
from stickslip.inference.features.measurement import measure
from stickslip.inference.fit.stated_rig import ring_period
from tests.kept_results import keep_table

from .scatter_floors import floors, scatter_factor

COMMAND = "python -m tests.fit.line_scatter"
SEEDS = (21, 22, 23, 24)
CONTACTS = (1, 4, 9)
NAMES = {
    "recurrence": "recurrence", "size": "size", "times": "times in the slip", "overshoot": "overshoot",
    "ring": "ringing", "frequency": "its frequency", "creep": "creep", "settle": "settling",
}  # fmt: skip
OF_CONTACTS = ("recurrence", "size", "creep")


def scatter(folder: Path, new_lines: bool, contacts: int | None = None) -> tuple[dict[str, float], list[float]]:
    """Rms deviation from the mean of a run over its floor, by group of features; without holds and first cycles.

    Also what :func:`scatter_factor` tells of each campaign. ``contacts`` share the load of the rig's own.
    """
    found: dict[str, list[float]] = {}
    told = []
    for seed in SEEDS:
        setup = None
        if contacts is not None:
            setup = draw_setup(np.random.default_rng(seed))
            setup.with_rig(loads=(sum(setup.rig.loads) / contacts,) * contacts)
        make_campaign(folder / str(seed), seed, new_lines=new_lines, setup=setup)
        traces = load_traces(load_campaign(folder / str(seed) / "campaign.toml"))
        segments = [segment(t) for t in traces]
        m = measure(traces, segments, ring_period=ring_period(traces, segments), most_cycles=14, contacts=contacts)
        told.append(scatter_factor(m))
        floor = floors(replace(m, new_lines=1.0 if new_lines else 0.0))
        for r, name in enumerate(m.names):
            if name == "holds":
                continue
            later = np.flatnonzero(np.asarray(m.cycles.used)[r])[2:]  # those before still remember the virgin contact
            for group, at in m.layout.slices().items():
                values, valid = m.values[r, later, at], m.valid[r, later, at].all(axis=0)
                if valid.any():
                    z = (values - values.mean(axis=0)) / floor[r, later, at] * np.sqrt(later.size / (later.size - 1))
                    found.setdefault(group, []).append(float(np.mean(z[:, valid] ** 2)))
    return {group: float(np.sqrt(np.mean(squares))) for group, squares in found.items()}, told


def _row(name: str, found: dict[str, float], groups: Iterable[str]) -> list[str]:
    return [name, *(f"{found[group]:.2f}" for group in groups)]


def main() -> None:
    """Make both tables and keep them."""
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        rows = [
            _row(name, scatter(at / name, new_lines=new)[0], NAMES)
            for name, new in (("new lines", True), ("the same lines", False))
        ]
        keep_table("figures", COMMAND, "floors", ["", *NAMES.values()], rows)
        rows = [_row(str(n), scatter(at / str(n), new_lines=True, contacts=n)[0], OF_CONTACTS) for n in CONTACTS]
        keep_table("figures", COMMAND, "contacts", ["contacts", *OF_CONTACTS], rows)


if __name__ == "__main__":
    main()
