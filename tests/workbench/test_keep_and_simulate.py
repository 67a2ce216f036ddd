"""The pages *Keep* and *Simulate*, without a browser."""

from __future__ import annotations

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.runstore import read_result
from stickslip.workbench import keep_page, simulate_page
from stickslip.workbench.session import Session


@pytest.fixture(scope="module")
def own(tmp_path_factory, campaign):
    """The shipped campaign in a folder of its own, and a session with its base."""
    folder = tmp_path_factory.mktemp("own")
    for path in campaign.description.folder.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())
    made = ss.load_campaign(folder / "campaign.toml")
    session = Session(campaign=made)
    session.first(made.fit())
    return session


@pytest.mark.parametrize("name", ["../out", "a/b", "", ".hidden", "x" * 90, "a\\b", "end.", "<b>"])
def test_a_run_folder_lies_beside_the_campaign_and_nowhere_else(own, name):
    with pytest.raises(InputError, match="not a name"):
        keep_page.target(own, name)
    assert "not a name" in keep_page.save(own, name, "model", False)


def test_what_is_saved_is_what_the_object_saves(own, tmp_path):
    assert "written" in keep_page.save(own, "mine", "model", False)
    assert "exists" in keep_page.save(own, "mine", "model", False)
    assert "there is no diagnosis" in keep_page.save(own, "other", "diagnosis", False)
    own.fit.save(tmp_path / "direct")
    kept, direct = (read_result(p) for p in (own.campaign.description.folder / "mine", tmp_path / "direct"))
    assert kept["ladder"] == direct["ladder"] and kept["parameters"] == direct["parameters"]
    (row,) = keep_page.kept(own.campaign.description.folder)
    assert row["name"] == "mine" and row["unseen"] == pytest.approx(own.fit.unseen_error)


def test_a_model_moved_by_hand_is_not_kept_as_a_fit(own):
    own.by_hand({"weakening.drop": 0.21})
    assert "by hand" in keep_page.save(own, "moved", "model", False)
    own.undo()


def test_the_lines_of_python_lead_to_the_same_model(own, monkeypatch):
    own.by_hand({"weakening.drop": 0.2})
    monkeypatch.chdir(own.campaign.description.folder)
    names: dict = {}
    exec(own.code(), names)  # noqa: S102
    assert names["fit"].error == pytest.approx(own.fit.error, rel=1e-6)
    own.undo()


def test_settings_become_changes_of_a_scenario():
    asked = simulate_page.changes({"velocity": "80 um/s", "mass": " ", "spring": "500 N/m"})
    assert asked == ["drive.velocity=8e-05", "block.spring_stiffness=500"]
    for bad in ({"velocity": "-3 um/s"}, {"mass": "3 m"}, {"spring": "soft"}):
        with pytest.raises(InputError):
            simulate_page.changes({"velocity": "", "mass": "", "spring": "", **bad})


def test_a_faster_drive_shortens_the_recurrence_and_a_softer_spring_lengthens_the_slip(own):
    slow = simulate_page.freely(own.fit, ["drive.velocity=1e-4"], None)
    fast = simulate_page.freely(own.fit, ["drive.velocity=2e-4"], None)
    soft = simulate_page.freely(own.fit, ["drive.velocity=1e-4", "block.spring_stiffness=500.0"], None)
    assert fast["recurrence"][-1] == pytest.approx(0.5 * slow["recurrence"][-1], rel=0.15)
    # a block on a damped spring: the drop of the force over the stiffness, and the overshoot of half a swing
    damping, mass = own.fit.values["rig.damping"], own.fit.values["rig.mass"]

    def reach(stiffness: float) -> float:
        share = damping / (2.0 * np.sqrt(stiffness * mass))
        return (1.0 + np.exp(-np.pi * share / np.sqrt(1.0 - share**2))) / stiffness

    expected = slow["slip"][-1] * reach(500.0) / reach(own.fit.values["rig.spring_stiffness"])
    assert soft["slip"][-1] == pytest.approx(expected, rel=0.03)
    assert slow["time"].size <= simulate_page.LONGEST * 2 and np.isfinite(slow["displacement"]).all()


def test_the_pages_are_made_and_a_click_goes_to_a_step(own):
    assert keep_page.page(own) is not None and simulate_page.page(own) is not None
    own.by_hand({"weakening.drop": 0.2})
    own.show(0)
    assert own.at == 0 and not own.fit.by_hand
