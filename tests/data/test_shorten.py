"""Long records by their first cycles."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.data.drive import Drive
from stickslip.data.first_cycles import first_cycles, shares
from stickslip.data.segment import segment
from stickslip.data.trace import Trace


@pytest.mark.parametrize(
    ("counts", "most", "expected"),
    [([7, 7, 10], 200, [7, 7, 10]), ([70, 689], 200, [70, 130]), ([500, 3, 500], 200, [98, 3, 99]), ([5], 3, [3])],
)
def test_what_the_modest_leave_is_shared(counts, most, expected):
    assert shares(counts, most) == expected


def test_a_run_ends_amid_the_stick_after_its_last_slip(stick_slip):
    model = stick_slip(ring=100e-9)
    t = np.arange(0.0, model.stop, 1e-4)
    trace = Trace("a", t, displacement=model.position(t), drive=Drive.constant(model.v0, 0.0, model.stop))
    found = segment(trace)
    assert len(found.events) > 2
    short, cut = first_cycles(trace, found, 2)
    assert cut.events == found.events[:2]
    assert found.events[1].t_arrest < short.time[-1] < found.events[2].t_onset
    np.testing.assert_array_equal(short.displacement, trace.displacement[: short.time.size])
    again = segment(short)  # what is left is a record of its own
    assert len(again.events) == 2
    assert again.events[1].t_onset == pytest.approx(found.events[1].t_onset, abs=2.0 / trace.sampling_rate)
    assert first_cycles(trace, found, len(found.events)) == (trace, found)
