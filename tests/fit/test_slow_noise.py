"""Slow noise of a sensor that the campaign states: what it does to every feature, by trial."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.features.measurement import MAINS, Measurement

from . import synthetic
from .scatter_floors import floors

pytestmark = pytest.mark.slow

TRIALS = 40


@pytest.fixture(scope="module")
def traces():
    return synthetic.traces()


def disturbed(traces, walk: float, hum: float, rng: np.random.Generator) -> Measurement:
    """Features of the same runs, read with a walk (m/sqrt(s)) and a hum (m)."""
    out = []
    for trace in traces:
        step = 1.0 / trace.sampling_rate
        wander = np.cumsum(walk * np.sqrt(step) * rng.standard_normal(trace.time.size))
        swing = hum * np.sin(2 * np.pi * MAINS * trace.time + rng.uniform(0, 2 * np.pi))
        out.append(trace.replace(displacement=trace.displacement + wander + swing, walk=walk, hum=hum))
    return synthetic.measured(out)


@pytest.mark.parametrize(("walk", "hum"), [(20e-9, 0.0), (0.0, 5e-9)])
def test_features_scatter_as_stated(traces, walk, hum):
    """Creep, settling and slip size over all events, rms over ``TRIALS`` records with the same slips."""
    plain = synthetic.measured(traces)
    rng = np.random.default_rng(8)
    off = np.stack([disturbed(traces, walk, hum, rng).values - plain.values for _ in range(TRIALS)])
    stated = disturbed(traces, walk, hum, rng).sensor
    quiet = plain.sensor
    slices, used = plain.layout.slices(), np.asarray(plain.cycles.used)
    for name in ("creep", "settle", "size"):
        ok = plain.valid[..., slices[name]] & used[..., None]
        ok[:, 0] = False
        seen = np.sqrt(np.mean(off[..., slices[name]] ** 2, axis=0))[ok]
        told = np.sqrt(stated[..., slices[name]] ** 2 - quiet[..., slices[name]] ** 2)[ok]
        assert 0.7 < np.sqrt(np.mean(seen**2) / np.mean(told**2)) < 1.4, name
        assert np.corrcoef(seen, told)[0, 1] > 0.7 or np.std(told) < 0.15 * np.mean(told), name


def test_floors_widen_by_what_is_stated(traces):
    plain = synthetic.measured(traces)
    loud = synthetic.measured([t.replace(walk=5e-9, hum=3e-9) for t in traces])
    more = floors(loud) ** 2 - floors(plain) ** 2
    assert np.all(more >= -1e-12 * floors(plain) ** 2)
    at = plain.layout.slices()["creep"]
    assert np.all(np.sqrt(more[:, 1:, at][plain.valid[:, 1:, at]]) > 5e-10)
    np.testing.assert_array_equal(
        floors(synthetic.measured([t.replace(walk=0.0, hum=0.0) for t in traces])), floors(plain)
    )
