"""Shares of models in the mixture that predicts best."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.objects.compare import stacked


def test_of_two_normal_densities_the_mixture_has_the_shares_of_the_data():
    """3 of 10 draws are of one model: its share, to what 20 000 draws allow; an em step changes nothing any more."""
    rng = np.random.default_rng(0)
    of = rng.random(20_000) < 0.3
    y = rng.normal(np.where(of, -1.5, 1.5), 1.0)
    densities = np.stack([-0.5 * (y + 1.5) ** 2, -0.5 * (y - 1.5) ** 2])
    found = stacked(densities)
    assert found[0] == pytest.approx(0.3, abs=0.01)
    likely = np.exp(densities)
    again = (found[:, None] * likely / (found @ likely)).mean(axis=1)
    np.testing.assert_allclose(again, found, atol=1e-6)


def test_a_model_that_adds_nothing_has_no_share():
    """One that is worse everywhere, however improbable both are; what is no number gives none."""
    rng = np.random.default_rng(1)
    good = -400.0 + rng.normal(size=40)
    assert stacked(np.stack([good, good - 0.5])).tolist() == [1.0, 0.0]
    assert stacked(np.stack([good, good, good - 3.0]))[2] == 0.0
    assert stacked(good[None]).tolist() == [1.0]
    assert np.isnan(stacked(np.stack([good, np.append(good[1:], np.nan)]))).all()
