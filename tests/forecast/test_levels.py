"""Levels of slips: they are the force that was written down, and say how they hang together."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.errors import InputError
from stickslip.inference.forecast.levels import levels, wandering
from stickslip.objects.wander import wander, wander_sentence

from .synthetic import LAW, MEANS, SPEED, STIFFNESS, record


@pytest.fixture(scope="module")
def trace():
    return record(60, 0, rate=400.0)


def test_levels_are_the_force_at_onset_and_arrest(trace):
    data = levels(trace, segment(trace))
    assert data.sizes["slip_number"] > 55 and data.onset.attrs["units"] == "N"
    # the top of the sawtooth and its bottom, as far as the velocity's threshold and its window see them
    for slip in range(5, 50):
        t, force = trace.time, trace.spring_force
        near = slice(*np.searchsorted(t, [data.time_onset[slip] - 0.1, data.time_arrest[slip] + 0.1]))
        assert float(data.onset[slip]) == pytest.approx(force[near].max(), abs=6e-4)
        assert float(data.arrest[slip]) == pytest.approx(force[near].min(), abs=6e-4)
    assert float(data.slip.mean()) == pytest.approx((MEANS[0] - MEANS[1]) / STIFFNESS, rel=0.15)
    np.testing.assert_allclose(np.diff(data.time_onset), data.recurrence[1:], atol=1e-9)
    # never back: place and slip path are one coordinate
    np.testing.assert_allclose(data.path_onset, data.place_onset - data.place_onset[0], atol=2e-6)


def test_a_displacement_with_its_spring_tells_the_same_levels(trace):
    x = SPEED * (trace.time - trace.time[0]) - trace.spring_force / STIFFNESS
    other = Trace.from_arrays(
        "moved", time=trace.time, displacement=x, drive_velocity=SPEED, spring_stiffness=STIFFNESS
    )
    ours, theirs = levels(trace, segment(trace)), levels(other, segment(other))
    n = min(ours.sizes["slip_number"], theirs.sizes["slip_number"])
    np.testing.assert_allclose(theirs.onset[:n], ours.onset[:n], atol=2e-4)
    without = levels(other.replace(spring_stiffness=None), segment(other))
    assert without.onset.attrs["units"] == "m"
    np.testing.assert_allclose(without.onset * STIFFNESS, theirs.onset, rtol=1e-9)


def test_counts_at_two_kilohertz_tell_levels(trace):
    """One count of 1 um of elongation, spikes mended on reading: the force of the paper slider."""
    rng, count = np.random.default_rng(1), STIFFNESS * 1e-6
    t = np.arange(trace.time[0], trace.time[-1], 5e-4)
    force = np.round((np.interp(t, trace.time, trace.spring_force) + 0.5 * count * rng.normal(size=t.size)) / count)
    coarse = Trace.from_arrays(
        "counts", time=t, spring_force=force * count, drive_velocity=SPEED, spring_stiffness=STIFFNESS
    )
    ours, theirs = levels(trace, segment(trace)), levels(coarse, segment(coarse))
    assert theirs.sizes["slip_number"] == ours.sizes["slip_number"]
    np.testing.assert_allclose(theirs.onset, ours.onset, atol=6e-4)


def test_the_level_that_wanders_is_carried_over():
    trace = record(400, 3)
    found = wandering(levels(trace, segment(trace)))
    assert found.window == 31 and 0.03 < found.variation < 0.15
    # by the law: what is left of the wander beside its scatter, less a running mean
    assert 0.2 < found.carried_over < 0.9 and found.with_arrest > 0.3


def test_what_cannot_be_told_is_said(trace):
    still = Trace.from_arrays("still", time=trace.time, displacement=1e-9 * np.sin(trace.time), drive_velocity=SPEED)
    with pytest.raises(InputError, match=r"no slip.*"):
        levels(still, segment(still))
    x = SPEED * (trace.time - trace.time[0]) - trace.spring_force / STIFFNESS
    alone = Trace.from_arrays("alone", time=trace.time, displacement=x)
    with pytest.raises(InputError, match="neither it nor the load point is known"):
        levels(alone, segment(alone))


def test_a_campaign_gives_levels(trace):
    campaign = ss.Campaign.from_traces([trace])
    assert campaign.levels().sizes == levels(trace, segment(trace)).sizes
    with pytest.raises(InputError, match="no run 'other'"):
        campaign.levels("other")


def test_a_diagnosis_says_what_the_level_follows_and_how_far():
    found = wander(ss.Campaign.from_traces([record(400, 3)]))
    assert found is not None and found["slips"] > 350 and found["weights"]["nothing"] < 0.01
    assert "slip path" in found["text"] and found["weights"]["slip path"] > 0.5
    # a rough wander that is shorter than a slip is scatter, so only the two together can be held against the truth
    together = np.hypot(found["scatter"], np.linalg.norm([c["size"] for c in found["law"]]))
    assert together == pytest.approx(np.hypot(LAW.components[0].size[0], LAW.scatter[0]) / MEANS[0], rel=0.5)
    said = wander_sentence(found)
    assert said.startswith("synthetic, ") and f"{100 * found['scatter']:.2g} %" in said


def test_of_few_slips_it_says_nothing():
    assert wander(ss.Campaign.from_traces([record(20, 3)])) is None
