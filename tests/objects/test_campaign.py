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


def test_some_of_its_runs_are_a_campaign_with_the_same_rig(campaign):
    some = campaign.only("holds", "v100")
    assert some.names == ["v100", "holds"] == campaign.without("v050", "v200", "v400").names
    assert campaign.only(["holds", "v100"]).names == campaign.without(["v050", "v200"], "v400").names == some.names
    assert some["v100"] is campaign["v100"] and some.rig is campaign.rig and some.title == campaign.title
    assert some.description.rig_of("holds") == campaign.description.rig_of("holds")
    np.testing.assert_array_equal(some.levels("v100").onset, campaign.levels("v100").onset)
    for make, said in (
        (lambda: campaign.only("v10"), "did you mean 'v100'"),
        (lambda: campaign.without("hold"), "did you mean 'holds'"),
        (lambda: campaign.only(), "at least one run"),
        (lambda: campaign.without(*NAMES), "no run is left"),
        (lambda: some["v050"], "there is no run 'v050'"),
    ):
        with pytest.raises(InputError, match=said):
            make()


def test_a_run_keeps_what_the_file_says_of_its_rig_alone(tmp_path):
    (tmp_path / "a.csv").write_text("time,x\n" + "".join(f"{0.01 * n},{n % 7}\n" for n in range(50)))
    columns = 'time = { column = "time", unit = "s" }\ndisplacement = { column = "x", unit = "nm" }'
    run = f'[[trace]]\nfile = "a.csv"\n{columns}\ndrive_velocity = "1 um/s"\n'
    file = tmp_path / "c.toml"
    file.write_text(f'schema = 1\n[rig]\ncontacts = 3\n{run}name = "a"\n{run}name = "b"\nnormal_force = "2 N"\n')
    whole = ss.load_campaign(file)
    for made in (whole.only("b"), whole.map(lambda t: t.coarsened(50.0)).without("a")):
        assert made.description.rig_of("b").normal_force == 2.0 and made.rig.contacts == 3
    a, b = whole.only("a").inputs(), whole.only("b").inputs()  # of the same samples
    assert a[0]["sha256"] != b[0]["sha256"]


def test_changed_runs_take_the_place_of_others_and_count_as_other_data(campaign):
    coarse = campaign.map(lambda trace: trace.coarsened("2 kHz"))
    assert coarse.names == NAMES and all(t.sampling_rate == pytest.approx(2000.0, rel=1e-4) for t in coarse.values())
    assert len(coarse.events[0].events) == len(campaign.events[0].events)
    same = campaign.map(lambda trace: trace)
    digests = [[row["sha256"] for row in c.inputs()] for c in (campaign, coarse, same, same.without("holds"))]
    assert digests[2] != digests[1] != digests[0] and digests[2][:4] == digests[3]
    for change, said in ((lambda trace: trace.time, "ndarray"), (lambda trace: trace.replace(name="x"), "same name")):
        with pytest.raises(InputError, match=said):
            campaign.map(change)
