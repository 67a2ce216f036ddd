"""Many rigs side by side: the numbers of single runs, kept as they come, and gone on with after an interruption."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray

import stickslip as ss
from stickslip.errors import InputError, RunFolderError
from stickslip.objects import sweep as module
from stickslip.simulation.scenario.series import numbers
from tests.scenario.conftest import rig

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


@pytest.mark.slow
def test_what_is_finished_is_kept_and_gone_on_with(scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "CHUNK", 2)
    real, calls = module.simulate, []

    def third(*args, **kwargs):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return real(*args, **kwargs)

    monkeypatch.setattr(module, "simulate", third)
    with pytest.raises(KeyboardInterrupt, match="1 of 3 parts are kept"):
        ss.sweep(scenario, TABLE, out=tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()
    found = ss.sweep(scenario, TABLE, out=tmp_path / "out", workers=1)
    assert len(calls) == 4 + 3  # the first two are not run again
    same(found, scenario)
    with xarray.open_dataset(tmp_path / "out" / "arrays.nc") as kept:
        xarray.testing.assert_identical(kept.load().drop_vars("note"), found.drop_vars("note"))
    with pytest.raises(RunFolderError):
        ss.sweep(scenario, TABLE, out=tmp_path / "out", workers=1)


@pytest.mark.slow
def test_other_changes_are_not_gone_on_with(scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "CHUNK", 1)
    real, calls = module.simulate, []

    def second(*args, **kwargs):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(*args, **kwargs)

    monkeypatch.setattr(module, "simulate", second)
    with pytest.raises(KeyboardInterrupt):
        ss.sweep(scenario, {"drive.velocity": [1e-4, 2e-4]}, out=tmp_path / "out", workers=1)
    found = ss.sweep(scenario, {"drive.velocity": ["100 um/s", 3e-4]}, out=tmp_path / "out", workers=1)
    assert len(calls) == 2 + 2
    np.testing.assert_allclose(found["drive.velocity"], [1e-4, 3e-4], rtol=1e-15)


@pytest.mark.slow
def test_processes_have_the_same_numbers(scenario):
    told: list[float] = []
    same(ss.sweep(scenario, TABLE, workers=2, progress=lambda _, share: told.append(share)), scenario)
    assert told[-1] == 1.0


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
    with pytest.raises(InputError, match="velocity"):
        ss.sweep(scenario, {"drive.velocity": [1e-4, "5 kg"]})
    with pytest.raises(InputError, match="jobs"):
        list(module.one_by_one([scenario], 0))
