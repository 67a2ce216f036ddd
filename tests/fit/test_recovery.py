"""Parameters of campaigns from an independent simulator: do the stated intervals hold the truth?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from stickslip.campaign import load_campaign, load_traces
from stickslip.challenge.generator import make_campaign
from stickslip.features.measurement import measure
from stickslip.fit.multistart import best_of
from stickslip.fit.problem import Problem
from stickslip.fit.start import base_composition, ring_period
from stickslip.floors import floors
from stickslip.segment import segment

CAMPAIGNS = 20
FIRST = 8000  # seeds; the factor on the intervals was set on others
TWO_SIDED = 1.96


def true_values(rig: dict) -> dict[str, float]:
    return {
        "contact.strength": rig["mu_s"] * sum(rig["loads"]),
        "weakening.drop": 1.0 - rig["mu_k"] / rig["mu_s"],
        "weakening.slip_distance": rig["slip_length"],
        "weakening.healing_time": rig["heal_time"],
        "rig.damping": rig["damping"],
        "rig.spring_stiffness": rig["spring_stiffness"],
    }


def deviations(folder, seed: int) -> dict[str, float]:
    """(fitted - true)/standard deviation on the search scale of every parameter that has a true value."""
    truth = make_campaign(folder, seed, new_lines=seed % 2 == 1)
    campaign = load_campaign(folder / "campaign.toml")
    traces = load_traces(campaign)
    segments = [segment(t) for t in traces]
    data = measure(traces, segments, ring_period=ring_period(traces, segments), most_cycles=14)
    base = base_composition(campaign, data)
    use = np.asarray(data.cycles.used)
    found = best_of(Problem(base, data), floors(data), use)
    sd = np.sqrt(np.diag(found.covariance))
    values = true_values(truth["rig"])
    return {
        f.name: (z - math.log(values[f.name])) / s
        for f, z, s in zip(found.free, found.z, sd, strict=True)
        if f.name in values
    }


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_intervals_hold_the_truth(tmp_path):
    """95 % intervals of the parameters with a true value, over 20 campaigns with noise and lines of their own."""
    rows = [deviations(tmp_path / str(seed), seed) for seed in range(FIRST, FIRST + CAMPAIGNS)]
    z = np.array([v for row in rows for v in row.values()])
    held = {}
    for name in sorted({n for row in rows for n in row}):
        own = np.array([row[name] for row in rows if name in row])
        held[name] = np.mean(np.abs(own) <= TWO_SIDED)
        print(f"{name:26s} {held[name]:5.2f} of {own.size}, median |z| {np.median(np.abs(own)):.2f}")
    assert min(held.values()) >= 0.85
    # intervals so wide that they say nothing would hold the truth as well
    assert np.median(np.abs(z)) > 0.2
