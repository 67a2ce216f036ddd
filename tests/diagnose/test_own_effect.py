"""An effect in a user's own file, or of an installed package, is fitted and diagnosed like those of the catalogue, also
by other processes."""

from __future__ import annotations

import importlib
import sys

import pytest

from stickslip.cli import run
from stickslip.physics.effects import catalogue
from stickslip.simulation.scenario import make_scenario, simulate
from stickslip.simulation.scenario.demonstration import RIG
from stickslip.simulation.scenario.writers import write_campaign
from stickslip.system.runstore import read_result

SIZE = 0.05
EFFECT = """
from jax import Array
from stickslip.effects import Threshold
from stickslip.effects import parameter

class Finish(Threshold):
    tag = "surface-finish"
    summary = "the finish of the track becomes rougher along it"
    equation = r"\\mu \\to \\mu\\,[1 + \\varepsilon x/\\ell]"
    amplitude = "size"
    size: Array = parameter(0.0, unit="1", lower=-0.2, upper=0.2, null=0.0, doc="relative change of friction over 1 mm")

    def strength(self, state, motion, contact):
        return 1.0 + self.size * motion.x / 1e-3
"""


@pytest.fixture(params=["file", "package"])
def files(tmp_path, monkeypatch, request):
    """Arguments that name the effect's file, none where a package offers it, and a campaign of two short runs that were
    simulated with it."""
    monkeypatch.setattr(catalogue, "_user", {})
    path = tmp_path / "surface_finish.py"
    path.write_text(EFFECT, encoding="utf-8")
    if request.param == "package":
        info = tmp_path / "surface_finish-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: surface-finish\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text("[stickslip.physics.effects]\nsurface-finish = surface_finish:Finish\n")
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.setattr(catalogue.EFFECTS, "_plugged", None)
        importlib.invalidate_caches()
    else:
        catalogue.load_file(path)
    hidden = {"effect": [{"type": "surface-finish", "size": SIZE}], "sensor": {"white": 1e-11}}
    runs = [make_scenario({**RIG, **hidden, "drive": {"velocity": v, "events": 6}}) for v in (2e-4, 4e-4)]
    campaign = write_campaign(tmp_path, runs, [simulate(scenario) for scenario in runs])
    catalogue._user.clear()  # the commands are to load it themselves
    yield ["--effect", str(path)] if request.param == "file" else [], str(campaign)
    sys.modules.pop("surface_finish", None)


@pytest.mark.long
def test_it_is_fitted(files, tmp_path):
    own, campaign = files
    out = tmp_path / "fit"
    command = ["fit", campaign, *own, "--add", "surface-finish", "--out", str(out)]
    assert run(command) == 0
    result = read_result(out)
    without, with_it = result["ladder"][-2:]
    assert with_it["model"] == ["static", "inertia", "surface-finish"]
    assert with_it["cost"] < 0.5 * without["cost"]
    size = result["parameters"]["surface-finish.size"]
    assert size["std"] < 0.3 * SIZE
    assert abs(size["value"] - SIZE) < 4 * size["std"]


@pytest.mark.long
def test_it_is_fitted_beside_another(files, tmp_path):
    own, campaign = files
    out = tmp_path / "fit"
    added = ["--add", "surface-finish", "--add", "contact-ageing"]
    assert run(["fit", campaign, *own, *added, "--out", str(out)]) == 0
    result = read_result(out)
    assert result["ladder"][-1]["model"] == ["static", "inertia", "surface-finish", "contact-ageing"]
    size, rate = (result["parameters"][name] for name in ("surface-finish.size", "contact-ageing.rate"))
    assert abs(size["value"] - SIZE) < 4 * size["std"]
    assert abs(rate["value"]) < 4 * rate["std"]  # which is not in the data


@pytest.mark.long
def test_it_is_diagnosed_by_other_processes(files, tmp_path):
    own, campaign = files
    out = tmp_path / "diagnosis"
    command = [
        "diagnose", campaign, *own, "--candidates", "surface-finish,contact-ageing", "--jobs", "2",
        "--max-effects", "1", "--out", str(out),
    ]  # fmt: skip
    assert run(command) == 0
    result = read_result(out)
    assert result["verdict"]["effects"] == ["surface-finish"]
    (found,) = [c for c in result["ranking"] if c["effect"] == "surface-finish"]
    assert found["refit"]
    assert found["cost"] < 0.5 * result["ranking_base"]["cost"]
    assert abs(found["amplitude"]["value"] - SIZE) < 4 * found["amplitude"]["std"]
