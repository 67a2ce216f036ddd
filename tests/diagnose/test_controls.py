"""Negative controls: data that cannot be explained get no name."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from stickslip.workflow import diagnose_campaign

CAMPAIGN = Path(__file__).parents[2] / "scenarios" / "hidden-effect"


def shuffled(folder: Path) -> Path:
    """The shipped campaign with the velocities of its steady runs in the opposite order."""
    shutil.copytree(CAMPAIGN, folder)
    path = folder / "campaign.toml"
    text = path.read_text(encoding="utf-8")
    speeds = re.findall(r'^drive_velocity = "(.*)"$', text, re.MULTILINE)
    assert len(set(speeds)) >= 3
    turned = iter(reversed(speeds))
    path.write_text(re.sub(r'(?m)^drive_velocity = ".*"$', lambda m: f'drive_velocity = "{next(turned)}"', text))
    return path


@pytest.mark.slow
def test_velocities_shuffled_between_traces_give_no_name(tmp_path):
    result = diagnose_campaign(shuffled(tmp_path / "campaign"), tmp_path / "out", jobs=2)
    assert result["verdict"]["kind"] == "unknown"
    assert result["verdict"]["effects"] == []
    assert result["verdict"]["set"] == []
