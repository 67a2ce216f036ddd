"""How often a diagnosis is to be right on campaigns of the independent simulator: hours, in a folder that stays.

``STICKSLIP_DEVELOPMENT=FOLDER pytest -m slow tests/diagnose/test_aims.py`` makes and diagnoses the campaigns under
FOLDER and goes on where it was stopped; docs/diagnosis.md has the figures of what was measured so far.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from .development import PARTS, Tally, cases, measure, visible

FOLDER = "STICKSLIP_DEVELOPMENT"
SEEDS = {"one": 33, "nothing": 34, "two": 35, "left-out": 36, "strong": 37}
NUMBERS = {"nothing": 100, "two": 40}


def test_a_part_has_the_campaigns_that_it_speaks_of():
    assert set(SEEDS) == set(PARTS)
    one = cases("one", SEEDS["one"], 0)
    assert [c.hidden[0].tag for c in one] == [tag for tag in visible() for _ in range(2)]
    assert sum(c.new_lines for c in one) * 2 == len(one)
    assert len(cases("nothing", SEEDS["nothing"], NUMBERS["nothing"])) >= 100
    assert not any(c.hidden for c in cases("nothing", SEEDS["nothing"], 5))
    assert all(len({e.tag for e in c.hidden}) == 2 for c in cases("two", SEEDS["two"], NUMBERS["two"]))
    usual = {c.hidden[0].tag: c.hidden[0].multiple for c in one}
    strong = [c.hidden[0] for c in cases("strong", SEEDS["strong"], 0)]
    assert len(strong) > 10
    assert all(e.multiple > usual[e.tag] for e in strong)


def _measured(part: str) -> Tally:
    folder = os.environ.get(FOLDER)
    if not folder:
        pytest.skip(f"takes hours: set {FOLDER} to a folder in which campaigns and diagnoses may stay")
    found = measure(Path(folder) / part, part, SEEDS[part], NUMBERS.get(part, 0))
    print(found.table)
    assert found.answered == len(cases(part, SEEDS[part], NUMBERS.get(part, 0)))
    return found


@pytest.mark.slow
@pytest.mark.timeout(0)
@pytest.mark.parametrize("part", ["one", "strong"])
def test_one_effect_is_named_or_in_a_set_of_three(part):
    found = _measured(part)
    assert found.right >= 0.90 * found.answered
    assert found.exact >= 0.75 * found.answered


@pytest.mark.slow
@pytest.mark.timeout(0)
def test_nothing_missing_is_complete():
    found = _measured("nothing")
    assert found.exact >= 0.95 * found.answered


@pytest.mark.slow
@pytest.mark.timeout(0)
def test_two_effects_are_both_named():
    found = _measured("two")
    assert found.exact >= 0.60 * found.answered


@pytest.mark.slow
@pytest.mark.timeout(0)
def test_an_effect_that_is_left_out_is_unknown():
    found = _measured("left-out")
    assert found.exact >= 0.60 * found.answered
