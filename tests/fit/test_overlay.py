"""The model drawn beside the measurement is the model: at the true parameters it lies on what was measured."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.fit.overlay import modelled_runs
from stickslip.fit.problem import Problem
from stickslip.report.inertial_result import overlay
from stickslip.segment import segment

from . import synthetic


@pytest.fixture(scope="module")
def drawn():
    """Traces, and what the report draws of them at the truth and with a weaker contact."""
    traces = synthetic.traces((2e-4,), slips=3.6)
    segmentations = [segment(t) for t in traces]
    m = synthetic.measured(traces)
    problem = Problem(synthetic.composition(), m)
    none = np.zeros((*m.values.shape[:2], 2))
    weaker = synthetic.truth()
    weaker[list(synthetic.TRUTH).index("weakening.drop")] += np.log(1.1)
    return traces, [
        overlay(problem, modelled_runs(problem, z, none), traces, segmentations) for z in (synthetic.truth(), weaker)
    ]


def off(variables, piece):
    """Largest distance of the model from the measurement (m)."""
    position, model = (variables[f"trace0_{piece}_{name}"][1] for name in ("position", "model"))
    known = np.isfinite(model)
    assert known.mean() > 0.5
    return float(np.abs(np.asarray(position) - model)[known].max())


def test_at_the_truth_it_lies_on_the_measurement(drawn):
    _, (right, weaker) = drawn
    # creep to the last moment before the slip, whose onset is off by some 0.1 ms at the tolerance of a fit
    assert off(right, "slip") < 0.5e-6
    assert off(weaker, "slip") > 3e-6  # slips a tenth larger
    assert off(right, "slip") < 0.1 * off(weaker, "slip")


def test_the_whole_trace_is_there_in_order_of_time(drawn):
    (trace,), (right, _) = drawn
    t, y = (np.asarray(right[f"trace0_model_{name}"][1]) for name in ("time", "position"))
    assert np.all(np.diff(t) >= 0)
    assert t[-1] > 0.7 * trace.time[-1]
    apart = np.abs(y - np.interp(t, trace.time, trace.displacement))
    assert np.median(apart) < 20e-9
    assert apart.max() < 1e-6
