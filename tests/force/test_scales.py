"""Times of a campaign and of a run: how long the test function is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.inference.force.kernels import kernels
from stickslip.inference.force.scales import COARSE, LOUD, of_run


def test_where_ringing_is_heard_all_runs_have_its_times(small):
    assert small.times.ring > 0.0
    assert of_run(small.times, small.traces[0], small.found[0]) == small.times


def test_a_run_without_ringing_has_the_times_of_its_own_slips(small):
    trace, found = small.traces[0], small.found[0]
    quiet = replace(trace, noise=1e-12)
    own = of_run(replace(small.times, ring=0.0, slip=1.0), quiet, found)
    assert own.slip == pytest.approx(np.median([e.t_arrest - e.t_onset for e in found.events]))
    assert own.half == pytest.approx(own.slip / 12.0)


def test_a_mean_is_taken_over_longer_where_noise_is_loud(small):
    """Drawn noise adds less than the stated share to a slip's acceleration, until inertia would not be resolved."""
    trace, found = small.traces[0], small.found[0]
    deaf = replace(small.times, ring=0.0)
    rng, halves = np.random.default_rng(1), []
    for noise in (1e-8, 1e-7, 1e-6):
        own = of_run(deaf, replace(trace, noise=noise), found)
        second = kernels(own.half, trace.sampling_rate)[2]
        drawn = np.convolve(noise * rng.standard_normal(20_000), second, "valid").std()
        peak = 0.5 * np.median([e.slip for e in found.events]) * (np.pi / own.slip) ** 2
        assert drawn < 1.02 * LOUD * peak or own.half == pytest.approx(COARSE * own.slip)
        halves.append(own.half / own.slip)
    assert halves[0] <= halves[1] < halves[2]
    assert halves[2] == pytest.approx(COARSE)
