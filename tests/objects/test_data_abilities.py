"""What is said of a campaign before anything is fitted."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from stickslip.data.drive import Drive
from stickslip.data.segment import segment
from stickslip.data.trace import Trace
from stickslip.objects.data_abilities import _slow_noise, abilities


def test_slow_noise_is_asked_for_where_it_is_not_stated():
    def trace(name, walk=0.0, hum=0.0, displacement=True):
        return SimpleNamespace(name=name, walk=walk, hum=hum, displacement=np.zeros(3) if displacement else None), None

    silent, stated, force = trace("a"), trace("b", 2e-9, 3e-9), trace("c", displacement=False)
    good, bad = _slow_noise([], [silent, stated, force])
    assert good == ["Slow noise of the sensor is known in b: 2 nm/s^0.5 at random, 3 nm of hum."]
    assert len(bad) == 1
    assert "not stated in a:" in bad[0]
    assert _slow_noise([], [stated]) == (good, [])
    assert _slow_noise([], [force]) == ([], [])


def test_counts_are_coarse_where_creep_passes_few_of_them_and_no_noise_tells_what_is_between():
    """Creep of 2 um between slips of 40 um, read in counts of 8 and 80 nm, and of 80 nm with noise."""
    time = np.arange(0.0, 8.0, 1e-4)
    phase, number = np.modf(time)
    creep = 2e-6 * np.clip(phase / 0.98, 0.0, 1.0) ** 8
    position = 40e-6 * (number + np.clip((phase - 0.98) / 0.02, 0.0, 1.0)) + creep

    def said(count, noise=0.0):
        wandering = noise * np.random.default_rng(3).normal(size=time.size)
        read = count * np.round((position + wandering) / count)
        trace = Trace(
            "run", time, displacement=read, drive=Drive.constant(42e-6, 0.0, 8.0), resolution=count, noise=None
        )
        return [line for line in abilities([trace], [segment(trace)]).cannot if line.startswith("Counts are coarse")]

    assert said(8e-9) == [] and said(80e-9, 60e-9) == []
    (line,) = said(80e-9)
    assert "run (80 nm" in line and "half a count" in line
