"""Studies and sweeps on a scheduler that runs already. That a study has a fit's numbers, test_study has."""

from __future__ import annotations

from pathlib import Path

import pytest

import stickslip as ss
from stickslip.simulation.scenario.series import numbers
from tests.loopback import loopback_cluster
from tests.scenario.conftest import rig

pytestmark = pytest.mark.slow

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect" / "campaign.toml"


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """The address of a scheduler with one worker, both processes of their own, and the worker."""
    with loopback_cluster(tmp_path_factory.mktemp("cluster"), 1) as (address, (worker,)):
        yield address, worker


def test_a_sweep_on_a_scheduler(running, tmp_path):
    address, worker = running
    scenario, velocities = ss.make_scenario(rig()), [1e-4, 2e-4]
    found = ss.sweep(scenario, {"drive.velocity": velocities}, scheduler=address, out=tmp_path / "out")
    for i, velocity in enumerate(velocities):
        alone = numbers(ss.simulate(scenario.with_changes([("drive.velocity", velocity)])))
        assert {name: float(found[name][i]) for name in alone} == alone
    assert found.note.values.tolist() == ["", ""] and (tmp_path / "out" / "arrays.nc").exists()
    assert worker.poll() is None, "a worker of one's own goes on when the sweep is done"


def test_a_study_on_a_scheduler(running):
    address, worker = running
    told: list[str] = []
    found = ss.study({"shipped": SHIPPED}, scheduler=address, progress=lambda text, _: told.append(text))
    assert found.note.values.tolist() == [""] and told == ["shipped"]
    assert found.campaign.values.tolist() == ["shipped"] and found.cycles.values.tolist() == [38]
    assert float(found.value.sel(parameter="contact.strength")[0]) > 0.0
    assert float(found.unseen_error[0]) > 1.0  # in floors of this fit, which lacks the hidden effect
    assert worker.poll() is None


def test_a_running_scheduler_has_workers_of_its_own(running):
    address, _ = running
    with pytest.raises(ss.InputError, match=r"^workers: .* own workers"):
        ss.study({"shipped": SHIPPED}, scheduler=address, workers=2)
    with pytest.raises(ss.InputError, match=r"^workers: .* own workers"):
        ss.sweep(ss.make_scenario(rig()), {"drive.velocity": [1e-4, 2e-4]}, scheduler=address, workers=2)
