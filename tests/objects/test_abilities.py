"""What is said of a campaign before anything is fitted."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from stickslip.objects.abilities import _slow_noise


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
