"""Where a search ends no step leads further down, short ones included."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.inference.force.descent import DAMPING
from stickslip.inference.force.fit import fit
from stickslip.inference.force.linearised import moved

from .conftest import made, seen


@pytest.fixture(scope="module")
def lacking(tmp_path_factory):
    """The base, on data in which a sensor's low-pass makes errors of the position look large."""
    effect = seen("sensor-low-pass", "first order", 10.0)
    case = made(tmp_path_factory.mktemp("late") / "case", 1, [effect], spring_known=True, virgin=False)
    return fit(case.problem, case.point)


def test_no_part_of_a_step_leads_down_from_the_end_of_a_search(lacking):
    """What events have of their own is not damped: a whole step may lead up where a tenth of it leads far down."""
    system, point = lacking._system, lacking.point
    change, events, _ = system.step(DAMPING)
    parts = [
        moved(point, part * change, point.events + part * (events - point.events)) for part in np.geomspace(1e-3, 1, 7)
    ]
    lowest = min(system.objective(part, lacking.problem.forces(part)) for part in parts)
    assert lowest > system.objective(point, lacking.forces) - 5.0
