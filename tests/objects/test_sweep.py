"""Many rigs side by side: the numbers of single runs, kept as they come, and gone on with after an interruption."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray

import stickslip as ss
from stickslip.errors import InputError, RunFolderError
from stickslip.objects import sweep as module
from stickslip.physics.effects import catalogue
from stickslip.simulation.conformance import load_effects
from stickslip.simulation.scenario.series import numbers
from tests.scenario.conftest import rig

OWN = """
from jax import Array
from stickslip.effects import Threshold, parameter

class Own(Threshold):
    tag = "sweep-own"
    summary = "stronger friction"
    equation = r"\\mu \\to \\mu\\,(1 + s)"
    amplitude = "size"
    size: Array = parameter(0.0, unit="1", lower=-0.5, upper=0.5, null=0.0, symbol="s", doc="relative change")

    def strength(self, state, motion, contact):
        return 1.0 + self.size
"""

VELOCITIES = (1e-4, 1.5e-4, 2e-4, 2.5e-4, 3e-4)
DROPS = (0.85, 0.8, 0.85, 0.8, 0.9)
TABLE: dict[str, Any] = {"drive.velocity": VELOCITIES, "weakening.ratio": DROPS}


@pytest.fixture(scope="module")
def scenario():
    return ss.make_scenario(rig())


def same(found: xarray.Dataset, scenario: Any) -> None:
    """Every run is the one that is simulated by itself, to the last bit."""
    for i, row in enumerate(zip(VELOCITIES, DROPS, strict=True)):
        alone = numbers(ss.simulate(scenario.with_changes(list(zip(TABLE, row, strict=True)))))
        assert {name: float(found[name][i]) for name in alone} == alone
    assert found["drive.velocity"].values.tolist() == list(VELOCITIES)
    assert found["slip"].attrs["units"] == found["creep_before_slip_std"].attrs["units"] == "m"


def interrupted(monkeypatch: pytest.MonkeyPatch, at: int) -> list[int]:
    """Have one of the runs interrupted; what is counted are all that were begun."""
    real, calls = module.simulate, []

    def simulate(*args, **kwargs):
        calls.append(1)
        if len(calls) == at:
            raise KeyboardInterrupt
        return real(*args, **kwargs)

    monkeypatch.setattr(module, "simulate", simulate)
    return calls


@pytest.mark.slow
def test_what_is_finished_is_kept_and_gone_on_with(scenario, tmp_path, monkeypatch):
    calls = interrupted(monkeypatch, 4)
    with pytest.raises(KeyboardInterrupt, match="3 of 5 parts are kept"):
        ss.sweep(scenario, TABLE, out=tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()
    found = ss.sweep(scenario, TABLE, out=tmp_path / "out", workers=1)
    assert len(calls) == 4 + 2  # the first three are not run again
    same(found, scenario)
    with xarray.open_dataset(tmp_path / "out" / "arrays.nc") as kept:
        xarray.testing.assert_identical(kept.load().drop_vars("note"), found.drop_vars("note"))
    with pytest.raises(RunFolderError):
        ss.sweep(scenario, TABLE, out=tmp_path / "out", workers=1)


@pytest.mark.slow
def test_other_changes_are_not_gone_on_with(scenario, tmp_path, monkeypatch):
    calls = interrupted(monkeypatch, 2)
    with pytest.raises(KeyboardInterrupt):
        ss.sweep(scenario, {"drive.velocity": [1e-4, 2e-4]}, out=tmp_path / "out", workers=1)
    found = ss.sweep(scenario, {"drive.velocity": ["100 um/s", 3e-4]}, out=tmp_path / "out", workers=1)
    assert len(calls) == 2 + 2
    np.testing.assert_allclose(found["drive.velocity"], [1e-4, 3e-4], rtol=1e-15)


@pytest.mark.slow
def test_processes_have_the_same_numbers(scenario):
    told: list[float] = []
    same(ss.sweep(scenario, TABLE, workers=2, progress=lambda _, share: told.append(share)), scenario)
    assert told[-1] == 1.0 and len(told) >= len(VELOCITIES)
    ((_, alone),) = module.one_by_one([scenario], 1)
    found = dict(module.one_by_one([scenario, scenario], 2))
    assert sorted(found) == [0, 1]
    for run in found.values():
        assert run.time.size == alone.time.size and (run.displacement.values == alone.displacement.values).all()


@pytest.mark.slow
def test_an_effect_of_ones_own_is_known_to_the_processes(tmp_path, monkeypatch):
    """Keys of effects and of pieces of a drive are read where they were set."""
    monkeypatch.setattr(catalogue, "_user", {})
    (tmp_path / "own.py").write_text(OWN)
    load_effects([tmp_path / "own.py"])
    made = ss.make_scenario(rig(effect=[{"type": "sweep-own", "size": 0.0}]))
    found = ss.sweep(made, {"effect.sweep-own.size": [0.0, 0.05]}, workers=2)
    assert found["effect.sweep-own.size"].values.tolist() == [0.0, 0.05]
    assert found["slip"].values[1] > found["slip"].values[0]
    pieces = [{"velocity": "100 um/s", "duration": "1 s"}, {"velocity": "200 um/s", "duration": "1 s"}]
    stepped = ss.make_scenario(rig(drive={"piece": pieces}))
    found = ss.sweep(stepped, {"drive.piece.1.velocity": ["120 um/s"]}, workers=1)
    np.testing.assert_allclose(found["drive.piece.1.velocity"], [1.2e-4], rtol=1e-15)


@pytest.mark.slow
def test_a_run_that_fails_spoils_nothing(scenario, monkeypatch):
    real = module.simulate

    def failing(member, *more):
        if member.file.drive.velocity == 2e-4:
            raise ss.SolveError("it did not work")
        return real(member, *more)

    monkeypatch.setattr(module, "simulate", failing)
    found = ss.sweep(scenario, {"drive.velocity": [1e-4, 2e-4]}, workers=1)
    assert found["note"].values.tolist()[0] == "" and "it did not work" in str(found["note"].values[1])
    assert np.isfinite(found["slip"].values[0]) and np.isnan(found["slip"].values[1])


def test_bad_tables_are_refused_before_anything_runs(scenario, monkeypatch):
    monkeypatch.setattr(module, "simulate", None)
    with pytest.raises(InputError, match="do not make a table"):
        ss.sweep(scenario, {"drive.velocity": [1e-4], "contact.p": [2.0, 3.0]})
    with pytest.raises(InputError, match="do not make a table"):
        ss.sweep(scenario, {})
    for values in ("50 um/s", 1e-4):
        with pytest.raises(InputError, match="not a list of values"):
            ss.sweep(scenario, {"drive.velocity": values})
    with pytest.raises(InputError, match="velocity"):
        ss.sweep(scenario, {"drive.velocity": [1e-4, "5 kg"]})
    with pytest.raises(InputError, match="jobs"):
        list(module.one_by_one([scenario], 0))
