"""Of slips that the solver simulates, with friction that wanders by a known law, intervals hold what they should."""

from functools import cache

import numpy as np
import pytest

from stickslip.inference.forecast.predict import METHODS
from stickslip.inference.forecast.rolling import roll
from stickslip.inference.forecast.scoring import crps

from .simulated import FORMS, one, record
from .synthetic import prepare

DRAWS = (3, 4)
LAWS = {"time": "time", "place, there and back": "place"}  # else the slip path, for the block never goes back


# 55 % of the 50 % interval: in the sticks in which the drive turns, a quarter of the time, forecasts lean on few such
BACK = pytest.mark.xfail(strict=False, reason="of a drive that turns the 50 % interval holds 55 %")
WIDE = pytest.mark.xfail(strict=False, reason="of two drives that turn the 90 % interval holds 98 and 83 %")
ROUGH = pytest.mark.xfail(strict=False, reason="0.52 and 0.56: friction is rough over the length of a slip"))
def test_intervals_of_simulated_slips_are_right_within_three_per_cent(form):
    """Of every draw, two thousand slips each; the law is found from the first part."""
    for found in drawn(form):
        assert found["coverage_50"] == pytest.approx(0.5, abs=0.03)


@pytest.mark.long
@pytest.mark.parametrize("form", [pytest.param(f, marks=WIDE if f.endswith("back") else ()) for f in FORMS])
def test_wide_intervals_of_simulated_slips_are_right_within_three_per_cent(form):
    for found in drawn(form):
        assert found["coverage_90"] == pytest.approx(0.9, abs=0.03)


@pytest.mark.slow
def test_over_a_track_that_was_passed_before_the_next_slip_is_known():
    """Friction is that of the place: a block that comes back meets it again, and the drive's turns spoil no other."""
    past, laws = prepare(record("place, there and back", 1000, 5.0), 0.5)
    assert laws[0].law.coordinates == ("place",)
    found = roll(past, laws[0].law)
    way = past.arrays["direction"]
    for turned, least in ((False, 0.2), (True, 0.8)):
        chosen = np.flatnonzero((way[found.slip] != way[found.slip - 1]) == turned)
        assert chosen.size > 100
        own, plain = (
            np.mean([crps(found.members[name][i], found.truth[i]) for i in chosen])
            for name in (METHODS[0], "mean recurrence")
        )
        assert own < least * plain, (turned, own, plain)
