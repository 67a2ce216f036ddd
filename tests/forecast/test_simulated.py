"""Of slips that the solver simulates, with friction that wanders by a known law, intervals hold what they should."""

import numpy as np
import pytest

from .simulated import FORMS, one, tally

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
