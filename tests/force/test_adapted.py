"""A model with sizes of its own of what is random: it finds them again, and no fit is made worse by them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.inference.force.fit import adapted, fit, refit
from stickslip.inference.force.scatter import NAMES, Scatter

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def fitted(small):
    return fit(small.problem, small.point)


def test_sizes_too_large_are_found_again(fitted):
    wide = Scatter(
        fitted.scatter.sizes + np.where(np.array(NAMES) == "stretch", 2.0, 1.0) * (np.array(NAMES) != "white")
    )
    loose = refit(fitted.problem, fitted.point, replace(fitted, scatter=wide))
    found = adapted(loose)
    assert found.cost < loose.cost - 50.0
    assert found.cost == pytest.approx(fitted.cost, abs=5.0)
    assert found.scatter.named()["stretch"] < 0.5 * wide.named()["stretch"]
    assert found.known.noise is fitted.known.noise  # what carries the noise stays, or costs could not be compared


def test_an_optimum_stays_where_it_is(fitted):
    found = adapted(fitted)
    assert found.cost == pytest.approx(fitted.cost, abs=2.0)
    for name, value in fitted.values.items():
        assert found.values[name] == pytest.approx(value, rel=0.05)
