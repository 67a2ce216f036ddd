"""Negative controls: data that cannot be explained get no name."""

from __future__ import annotations

import random
import re
import shutil
from pathlib import Path

import pytest

from stickslip.blind.generator import Run, make_campaign
from stickslip.errors import InputError
from stickslip.objects.diagnosis import diagnose_campaign

CAMPAIGN = Path(__file__).parents[2] / "scenarios" / "hidden-effect"
ORDERS = {"reversed": [3, 2, 1, 0], "slowest-two": [1, 0, 2, 3], "random": random.Random(1).sample(range(4), 4)}


HOLDS = ((4.3, 1e-4), (5.3, 0.0), (7.6, 1e-4), (12.6, 0.0), (15.2, 1e-4))
CLOSE = (*(Run(f"v{v}", v * 1e-6) for v in (199, 200, 201, 202)), Run("holds", 1e-4, pieces=HOLDS))


def shuffled(folder: Path, order: list[int], campaign: Path = CAMPAIGN) -> Path:
    """A campaign, by default the shipped one, with the velocities of its steady runs, the slowest first, in another
    order."""
    shutil.copytree(campaign, folder)
    path = folder / "campaign.toml"
    text = path.read_text(encoding="utf-8")
    speeds = re.findall(r'^drive_velocity = "(.*)"$', text, re.MULTILINE)
    assert len(set(speeds)) == len(speeds) == len(order)
    turned = iter([speeds[i] for i in order])
    path.write_text(re.sub(r'(?m)^drive_velocity = ".*"$', lambda m: f'drive_velocity = "{next(turned)}"', text))
    return path


def test_the_orders_are_different_and_none_is_the_true_one():
    orders = [tuple(order) for order in ORDERS.values()]
    assert len({*orders, (0, 1, 2, 3)}) == len(orders) + 1


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("order", ORDERS.values(), ids=ORDERS)
def test_velocities_shuffled_between_traces_give_no_name(tmp_path, order):
    path = shuffled(tmp_path / "campaign", order)
    try:
        verdict = diagnose_campaign(path, tmp_path / "out", jobs=2)["verdict"]
    except InputError as refused:
        assert refused.key == "trace.drive_velocity"
        return
    assert verdict["kind"] == "unknown"
    assert verdict["effects"] == []
    assert verdict["set"] == []


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_nor_do_velocities_so_close_that_the_base_can_be_fitted_and_effects_are_ranked(tmp_path):
    """Half a per cent from run to run, the slowest now the fastest: 1.5 %."""
    make_campaign(tmp_path / "right", 3, runs=CLOSE, spring_known=True)
    path = shuffled(tmp_path / "campaign", [1, 2, 3, 0], tmp_path / "right")
    result = diagnose_campaign(path, tmp_path / "out", jobs=2)
    assert result["verdict"]["kind"] == "unknown"
    assert result["verdict"]["effects"] == []
    assert result["verdict"]["set"] == []
    assert sum(c["refit"] for c in result["ranking"]) > 20
