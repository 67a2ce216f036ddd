"""What the pages of the catalogue show: a trace with each effect beside one without."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.physics.effects import catalogue
from stickslip.simulation.scenario.demonstration import typical_amplitude, with_and_without


@pytest.mark.long
@pytest.mark.timeout(300)
@pytest.mark.parametrize("tag", catalogue.tags())
def test_the_trace_with_an_effect_differs_from_the_one_without(tag):
    without, with_it, values = with_and_without(catalogue.get(tag))
    assert list(values.values()) == [pytest.approx(typical_amplitude(catalogue.get(tag)), rel=0.01)]
    for name in ("reading", "spring_force"):
        assert np.isfinite(with_it[name]).all()
    n = min(without.sizes["time"], with_it.sizes["time"])
    apart = np.abs(with_it["reading"].values[:n] - without["reading"].values[:n])
    assert apart.max() > 1e-8  # m; one count of a vibrometer
