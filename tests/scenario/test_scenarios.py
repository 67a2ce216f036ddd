"""Every shipped scenario runs through the command line, shortened, and shows what it is there to show."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
import xarray

from stickslip.cli import run
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.simulation.scenario import load_scenario

FOLDER = Path(__file__).parents[2] / "scenarios"
SHORT = ["contact.bins=32", "output.sampling_rate=2000"]
RUNS = {
    "grzemba2014": ["drive.events=2", "contact.springs=512"],
    "velocity_sweep": ["drive.events=2", "sweep.start=100um/s", "sweep.points=3", "contact.springs=512"],
    "static_vs_inertial": ["sweep.values=[5e-5, 2e-4]", "contact.springs=512", "contact.lines=20"],
    "slide_hold_slide": ["drive.piece.4.duration=5", "drive.piece.6.duration=50", "contact.springs=512"],
    "paper_slider": ["drive.duration=20"],
    "paper_slider_wandering": ["drive.duration=20"],
    "sphere": ["drive.events=2", "contact.springs=1024"],
}


def test_every_scenario_is_here():
    assert {path.stem for path in FOLDER.glob("*.toml")} == set(RUNS)


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    """Folder and result of every scenario, run once."""
    made: dict[str, tuple[Path, dict]] = {}

    def get(name: str) -> tuple[Path, dict]:
        if name not in made:
            out = tmp_path_factory.mktemp(name) / "run"
            os.environ["STICKSLIP_NO_CACHE"] = "1"  # tests leave the user's cache alone
            changes = [part for text in (*SHORT, *RUNS[name]) for part in ("--set", text)]
            assert run(["simulate", str(FOLDER / f"{name}.toml"), "--out", str(out), *changes]) == 0
            made[name] = out, json.loads((out / "result.json").read_text())
        return made[name]

    return get


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_it_runs_and_writes_a_whole_folder(outcome, name):
    out, result = outcome(name)
    assert result["schema"] == 1
    assert result["inputs"][0]["file"].endswith(f"{name}.toml")
    assert len(result["inputs"][0]["sha256"]) == 64
    assert result["versions"]["stickslip"]
    with xarray.open_dataset(out / "arrays.nc", engine="h5netcdf") as data:
        assert data.sizes
    pictures = list(out.glob("*.png"))
    assert len(pictures) == 2
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)
    assert not list(out.glob("*.part"))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RUNS if load_scenario(FOLDER / f"{name}.toml").file.output.trace])
def test_what_it_measures_can_be_read_back(outcome, name):
    out, _ = outcome(name)
    traces = load_traces(load_campaign(out / "campaign.toml"))
    assert traces
    assert all(trace.time.size > 100 for trace in traces)


def test_the_paper_rig_has_its_numbers(outcome):
    _, result = outcome("grzemba2014")
    facts = result["facts"]
    assert facts["friction_force"] == pytest.approx(0.2604, rel=1e-3)
    assert 385 < facts["contact_resonance"] < 1030
    assert 3e-5 < result["events"][1]["slip"] < 8e-5
    assert result["scenario"]["block"]["mass"] == pytest.approx(0.0894)
    assert result["seeds"] == {"lines": 2014, "sensor": 1}


@pytest.mark.slow
def test_recurrence_falls_with_velocity(outcome):
    _, result = outcome("velocity_sweep")
    recurrence = result["table"]["recurrence"]
    assert recurrence[0] > 2 * recurrence[1] > 0
    assert (outcome("velocity_sweep")[0] / "series.csv").read_text().startswith("value [m/s],events [1]")


@pytest.mark.slow
def test_inertia_and_weakening_matter_more_at_speed(outcome):
    _, result = outcome("static_vs_inertial")
    creep = [run["events"][0]["creep_before_slip"] for run in result["runs"]]
    assert creep[1] > 1.02 * creep[0]


@pytest.mark.slow
def test_slips_grow_with_the_logarithm_of_the_hold(outcome):
    _, result = outcome("slide_hold_slide")
    slips = {round(event["recurrence"] or 0): event["slip"] for event in result["events"]}
    usual = slips[1]
    after = [slip for wait, slip in sorted(slips.items()) if wait >= 2]
    assert len(after) == 3
    assert usual < after[0] < after[1] < after[2]
    # equal factors of the hold add equal slip: 1, 5, 50 s
    assert (after[2] - after[1]) > 0.8 * (after[1] - after[0])


@pytest.mark.slow
def test_paper_slider_has_the_published_size(outcome):
    _, result = outcome("paper_slider")
    later = result["events"][1:]
    assert len(later) >= 2
    assert all(1e-5 < event["slip"] < 1e-4 and 1.0 < event["recurrence"] < 2.2 for event in later)


def test_spheres_creep_by_nanometres(outcome):
    _, result = outcome("sphere")
    assert result["facts"]["u_max"] == pytest.approx(2.38e-8, rel=0.01)
    assert result["warnings"] == []
