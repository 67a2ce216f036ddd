"""Several starts: the best is kept, and whoever waits is told what goes on until the end."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.errors import FitError
from stickslip.fit import multistart
from stickslip.residual import Misfit

COSTS = {0: 900.0, 1: 400.0, 2: 700.0, 3: 500.0}


@pytest.fixture
def told(monkeypatch):
    """Fits that cost what their start says, and what was told meanwhile."""
    lines: list[tuple[str, float]] = []
    monkeypatch.setattr(multistart, "_starts", lambda problem, most: (np.array([float(i)]) for i in range(most)))
    monkeypatch.setattr(multistart, "_cost", lambda found, *rest: found.cost)
    monkeypatch.setattr(multistart, "errors", lambda *rest: Misfit(9.0, {"slip": 9.0}, {}))

    def fit(problem, floor, *, z, use, stages, progress=None, events=None):
        start = int(z[0])
        if COSTS[start] is None:
            raise FitError("no start")
        if progress is not None:
            progress("iteration 1, error 9")
        again = stages is multistart.FURTHER
        return SimpleNamespace(z=z, events=None, cost=COSTS[start] - (50.0 if again else 0.0))

    monkeypatch.setattr(multistart, "fit", fit)
    monkeypatch.setattr(multistart, "certain", lambda problem, floor, found: found)
    return lines


def best(told, starts=4):
    problem = SimpleNamespace(measurement=None)
    return multistart.best_of(
        problem, np.ones(1), np.ones(1), starts=starts, progress=lambda *told_: told.append(told_)
    )


def test_the_best_of_all_starts_is_kept_and_begun_again_until_it_has_arrived(told):
    found = best(told)
    assert found.z[0] == 1.0
    assert found.cost == 350.0
    words = [text for text, _ in told]
    assert [w.split(",")[0] for w in dict.fromkeys(words)] == [
        "start 1/4", "start 2/4", "start 3/4", "start 4/4", "the best start again (1)", "the best start again (2)",
        "standard deviations",
    ]  # fmt: skip
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[-1] < 1.0


def test_starts_that_fail_are_passed_over_and_none_at_all_is_an_error(told, monkeypatch):
    monkeypatch.setitem(COSTS, 1, None)
    assert best(told).z[0] == 3.0
    for start in COSTS:
        monkeypatch.setitem(COSTS, start, None)
    with pytest.raises(FitError):
        best(told)


def test_no_further_start_where_every_phase_is_described(told, monkeypatch):
    monkeypatch.setattr(multistart, "errors", lambda *rest: Misfit(0.9, {"slip": 1.0}, {}))
    assert best(told).z[0] == 0.0
    assert not any(text.startswith("start 2") for text, _ in told)
