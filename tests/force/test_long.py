"""A long record takes part with its first slips, and the numbers of these are those of the whole record."""

from __future__ import annotations

import numpy as np

import stickslip as ss
from stickslip.blind.generator import Run, make_campaign
from stickslip.data.first_cycles import first_cycles
from stickslip.inference.diagnose import prepare as preparing
from stickslip.inference.force.knots import CREEP, knots

HUM = 1e-10  # m, by which hum is known less well from fewer sticks


def test_first_cycles_are_what_they_are_in_the_whole(small):
    trace, found = small.traces[0], small.found[0]
    whole, part = small.knots[0], knots(*first_cycles(trace, found, 2), small.times)
    assert part.events < whole.events
    last = found.events[1].t_onset
    # windows of the creep are as long as the sensor's own slow noise asks, which fewer cycles tell otherwise
    here, there = ((k.at < last) & (k.phase != CREEP) for k in (part, whole))
    np.testing.assert_allclose(part.at[here], whole.at[there], rtol=1e-12)
    for power, name in enumerate(("rate", "acceleration"), start=1):
        own, other = getattr(part, name)[here], getattr(whole, name)[there]
        np.testing.assert_allclose(own, other, rtol=1e-9, atol=HUM * (2.0 * np.pi * 50.0) ** power)
    assert (part.of[here] == whole.of[there]).all()


def test_a_campaign_takes_part_with_as_many_slips_as_are_allowed(tmp_path, monkeypatch):
    runs = (Run("v100", 1e-4, 4), Run("v200", 2e-4, 8))
    make_campaign(tmp_path / "c", 11, (), runs=runs, spring_known=True)
    campaign = ss.load_campaign(tmp_path / "c" / "campaign.toml")
    whole = campaign.prepare()
    counts = [len(s.events) for s in whole.segmentations]
    monkeypatch.setattr(preparing, "MOST_EVENTS", 10)
    short = campaign.prepare()
    assert [len(s.events) for s in short.segmentations] == [counts[0], 10 - counts[0]]
    assert [k.events for k in short.runs] == [whole.runs[0].events, 10 - counts[0]]
    (said,) = set(short.dropped) - set(whole.dropped)
    assert said.startswith(f"v200: of {counts[1]} slips those after the first {10 - counts[0]}")
