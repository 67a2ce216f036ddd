"""A campaign in Python: its runs by name, and what goes to another process."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.objects import example

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"
NAMES = ["v050", "v100", "v200", "v400", "holds"]


@pytest.fixture(scope="module")
def campaign():
    return ss.load_campaign(SHIPPED)


def test_the_shipped_one_is_had_from_everywhere(campaign, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert ss.load_example().inputs() == campaign.inputs()
    monkeypatch.setattr(example, "example", lambda: None)
    with pytest.raises(InputError, match="from the repository"):
        ss.load_example()


def test_its_runs_are_had_as_from_a_dictionary(campaign):
    assert list(campaign) == list(campaign.keys()) == NAMES and len(campaign) == 5
    assert dict(campaign)["v100"] is campaign["v100"] is campaign.traces[1]
    assert [trace.name for trace in campaign.values()] == NAMES
    assert "holds" in campaign and "hold" not in campaign and 0 not in campaign
    assert campaign.get("v100") is campaign["v100"] and campaign.get("hold") is None


@pytest.mark.parametrize(("name", "said"), [("hold", "did you mean 'holds'"), (0, r"campaign\.traces\[0\]")])
def test_a_run_that_is_not_there_is_refused_in_words(campaign, name, said):
    with pytest.raises(InputError, match=said):
        campaign[name]


def test_it_is_equal_to_itself_alone(campaign):
    """As a key it is found at once; samples are not compared."""
    other = ss.load_campaign(SHIPPED)
    assert campaign == campaign and campaign != other
    assert {campaign: 1}[campaign] == 1


def test_a_worker_gets_it_whole(campaign):
    there = pickle.loads(pickle.dumps(campaign))  # noqa: S301  (bytes of its own)
    assert list(there) == NAMES and there.rig == campaign.rig and there.inputs() == campaign.inputs()
    assert np.array_equal(there["holds"].displacement, campaign["holds"].displacement)
