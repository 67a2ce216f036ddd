"""What is said of a campaign before anything is fitted."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.report.abilities import _pace, _slow_noise
from stickslip.trace import Drive


@pytest.mark.parametrize(("said", "warned"), [(50e-6, False), (60e-6, False), (500e-6, True), (5e-6, True)])
def test_a_block_that_does_not_keep_up_with_its_drive_is_pointed_out(said, warned):
    """Slips of 45 um every 0.9 s: 50 um/s, whatever the spring's stiffness may be."""
    time = np.linspace(0.0, 9.0, 9001)
    trace = SimpleNamespace(
        name="v050", time=time, displacement=45e-6 * np.floor(time / 0.9), drive=Drive.constant(said, 0.0, 9.0)
    )
    events = [SimpleNamespace(t_onset=0.9 * k - 0.01) for k in range(1, 10)]
    good, bad = _pace([], [(trace, SimpleNamespace(events=events))])
    assert good == []
    assert bool(bad) == warned
    if warned:
        assert "v050" in bad[0]
        assert "50 µm/s" in bad[0]
        assert f"the drive {said * 1e6:.3g} µm/s" in bad[0]


@pytest.mark.parametrize("turns", [False, True])
def test_a_drive_that_goes_back_is_no_fault(turns):
    """Pulled the other way all along, or forth and back: nothing is to be said of either."""
    time = np.linspace(0.0, 9.0, 9001)
    at = 45e-6 * np.floor(time / 0.9)
    x, nodes = (np.minimum(at, 45e-6 * 9 - at), [0.0, 225e-6, 0.0]) if turns else (-at, [0.0, -225e-6, -450e-6])
    drive = SimpleNamespace(position=lambda t: np.interp(t, [0.0, 4.5, 9.0], nodes))
    trace = SimpleNamespace(name="back", time=time, displacement=x, drive=drive)
    events = [SimpleNamespace(t_onset=0.9 * k - 0.01) for k in range(1, 10)]
    assert _pace([], [(trace, SimpleNamespace(events=events))]) == ([], [])


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
