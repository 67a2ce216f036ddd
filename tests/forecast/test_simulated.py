"""Of slips that the solver simulates, with friction that wanders by a known law, intervals hold what they should."""

import numpy as np
import pytest

from stickslip.inference.forecast.predict import METHODS
from stickslip.inference.forecast.rolling import roll
from stickslip.inference.forecast.scoring import crps

from .simulated import FORMS, one, record, tally
from .synthetic import prepare

DRAWS = (3, 4, 5)
LAWS = {"time": "time", "place, there and back": "place"}  # else the slip path, for the block never goes back


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
def test_intervals_of_simulated_slips_are_right_within_three_per_cent(form):
    """Of three draws of two thousand slips; the law is found from the first part of each."""
    draws = [one(f"{form} {draw}") for draw in DRAWS]
    for found in draws:
        assert found["slips"] > 1500
        assert LAWS.get(form, "slip path") in found["law"]
        assert found["crps"] < 0.5 * found["crps_mean_recurrence"]
    found = tally(draws)
    assert found["coverage_50"] == pytest.approx(0.5, abs=0.03)
    assert found["coverage_90"] == pytest.approx(0.9, abs=0.03)
    assert np.all(np.diff(found["held"]) > 0.0)


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
