"""Floors against what fresh rough lines do to the features, in campaigns of an independent simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.blind.generator import draw_setup, make_campaign
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import segment
from stickslip.inference.features.measurement import measure
from stickslip.inference.fit.stated_rig import ring_period

from .scatter_floors import floors, scatter_factor

pytestmark = pytest.mark.long  # eight campaigns

SEEDS = (21, 22, 23, 24)


def scatter(folder, new_lines: bool, contacts: int | None = None) -> dict[str, float]:
    """Rms deviation from the mean of a run over its floor, by group of features; without holds and first cycles."""
    found: dict[str, list[float]] = {}
    for seed in SEEDS:
        setup = None
        if contacts is not None:
            setup = draw_setup(np.random.default_rng(seed))
            setup.with_rig(loads=(sum(setup.rig.loads) / contacts,) * contacts)
        make_campaign(folder / str(seed), seed, new_lines=new_lines, setup=setup)
        traces = load_traces(load_campaign(folder / str(seed) / "campaign.toml"))
        segments = [segment(t) for t in traces]
        m = measure(traces, segments, ring_period=ring_period(traces, segments), most_cycles=14, contacts=contacts)
        told = scatter_factor(m)  # the events tell which of the two it is
        assert told > 0.4 if new_lines else told < 0.2, (seed, told)
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
    return {group: float(np.sqrt(np.mean(squares))) for group, squares in found.items()}


def test_fresh_lines_scatter_the_features_as_the_floors_say(tmp_path):
    found = scatter(tmp_path, new_lines=True)
    print({group: round(value, 2) for group, value in found.items()})
    for group in ("recurrence", "size", "times", "overshoot", "ring", "frequency", "settle"):
        assert 0.6 < found[group] < 1.5, (group, found)
    # more than the floor, for two factors of each event are refitted and take most of it
    assert 1.0 < found["creep"] < 3.0, found


def test_lines_average_out_over_the_contacts(tmp_path):
    """The same rigs on one, four and nine contacts that carry the same load: about the same share of a floor."""
    found = {n: scatter(tmp_path / str(n), new_lines=True, contacts=n) for n in (1, 4, 9)}
    # creep falls faster than the root, by more than six from one contact to nine; most of it is refitted event by event
    for group, most in (("recurrence", 2.0), ("size", 2.0), ("creep", 3.0)):
        shares = [found[n][group] for n in (1, 4, 9)]
        print(group, [round(s, 2) for s in shares])
        assert max(shares) < most * min(shares), group


def test_with_the_same_lines_only_the_sensor_scatters(tmp_path):
    found = scatter(tmp_path, new_lines=False)
    print({group: round(value, 2) for group, value in found.items()})
    for group in ("recurrence", "size", "times"):
        assert found[group] < 0.8, (group, found)
    assert found["overshoot"] == pytest.approx(1.0, abs=0.4)  # a count of the sensor
