"""A level of friction that wanders is named with whatever else is found on top of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stickslip.effects import make
from stickslip.inference.diagnose import wandering_level as module
from stickslip.inference.diagnose.decide import DISPERSION
from stickslip.inference.diagnose.stepwise_selection import Verdict, with_level
from stickslip.inference.diagnose.wandering_level import FORMS, TAG, Level, level_of
from stickslip.inference.force.problem import ALONG
from stickslip.inference.force.scatter import WANDER, Follows

LEVEL = Level("slip path", (), 0.07, 6.3e-4, 0.01, 1600.0)
EVENTS = 24


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (Verdict("complete"), Verdict("missing", (TAG,), (TAG,))),
        (Verdict("missing", ("wear",), ("wear",)), Verdict("missing", (TAG, "wear"), (TAG, "wear"))),
        (Verdict("ambiguous", ("wear",), ("wear", "tilt")), Verdict("ambiguous", (TAG, "wear"), ("wear", "tilt"))),
        (Verdict("unknown"), Verdict("unknown")),
    ],
)
def test_it_is_one_effect_more(before, after):
    assert with_level(before, LEVEL) == after
    assert with_level(before, None) is before


def test_every_coordinate_is_a_form_of_the_effect():
    assert set(FORMS) == set(ALONG)
    for coordinate in ALONG:
        found = Level(coordinate, (), 0.07, 6.3e-4, 0.01, 1600.0)
        assert make(TAG, **found.form).along == found.form["along"]
        assert make(TAG, **found.form).of == "both" and "the strength wanders" in found.text
        for of in ("static", "sliding"):
            alone = replace(found, of=of)
            assert make(TAG, **alone.form).of == of and f"{of} friction wanders" in alone.text


def test_what_cannot_be_told_has_an_experiment():
    assert LEVEL.experiment is None
    for one in ALONG:
        for other in set(ALONG) - {one}:
            found = Level(one, (other,), 0.07, 6.3e-4, 0.01, 1600.0)
            assert found.experiment["separates"] == [f"{TAG} along {one}", f"{TAG} along {other}"]
            assert f"(or {other}: these data cannot distinguish them)" in found.text


def fit(level: float, follows: Any = Follows("time", 1.0)) -> Any:
    sizes = {"level": level, "length": 4.0, "strength": 1e-4}
    return SimpleNamespace(
        scatter=SimpleNamespace(follows=follows, named=lambda: sizes), cost=0.0, problem=SimpleNamespace(events=EVENTS)
    )


@pytest.mark.parametrize("times", [0.99, 1.01])
def test_it_has_to_pay_for_its_parameters(monkeypatch, times):
    cost = times * DISPERSION * len(WANDER) * np.log(EVENTS)
    monkeypatch.setattr(module, "independent", lambda found: SimpleNamespace(cost=cost))
    found = level_of(fit(0.01))
    assert (found is not None) == (times > 1.0)
    assert found is None or found.gain == cost


def test_none_is_claimed_where_an_effect_has_taken_its_place(monkeypatch):
    monkeypatch.setattr(module, "independent", lambda found: SimpleNamespace(cost=1e3))
    assert level_of(fit(0.01)) is not None
    assert level_of(fit(5e-5)) is None
    assert level_of(fit(0.01, None)) is None
