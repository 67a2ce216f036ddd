"""Intervals of parameters by their profile likelihoods."""

import pytest
from scipy.stats import chi2

import stickslip as ss
from stickslip.errors import InputError
from stickslip.inference.diagnose.decide import DISPERSION
from stickslip.inference.force.profile_deviations import held

NAME = "weakening.slip_distance"


@pytest.mark.slow
def test_at_the_ends_of_an_interval_the_best_fit_is_worse_by_what_95_percent_allow():
    fit = ss.load_example().fit()
    rows = fit.intervals(NAME)
    assert rows["low / std"].iloc[0] < 0.0 < rows["high / std"].iloc[0]
    place, free = next((k, f) for k, f in enumerate(fit.free) if f.name == NAME)
    best = held(fit.force_fit, NAME, float(fit.force_fit.point.z[place]))[1]
    for end in rows[["low", "high"]].iloc[0]:
        worse = held(fit.force_fit, NAME, free.inward(end))[1] - best
        assert worse / DISPERSION == pytest.approx(chi2.ppf(0.95, 1), rel=0.1)
    with pytest.raises(InputError, match=r"weakening\.dorp"):
        fit.intervals("weakening.dorp")
