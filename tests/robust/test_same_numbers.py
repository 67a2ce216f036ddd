"""Same seed, same versions, same machine: the same numbers, bit for bit, from one process to the next."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import xarray

from stickslip.system.runstore import read_result

from .test_folders import SCENARIO
from .test_killed import diagnosis, small_campaign, without_time

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SENSOR = '[sensor]\nwhite = "10 pm/Hz**0.5"\nrandom_walk = "0.5 nm/s**0.5"\nflicker = "1 nm"\nseed = 4\n'


def call(*arguments: object, cached: bool = True) -> None:
    environment = os.environ if cached else {**os.environ, "STICKSLIP_NO_CACHE": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "stickslip.cli", *map(str, arguments)], env=environment, capture_output=True, text=True
    )
    assert done.returncode in (0, 3), done.stderr


def same(first: Path, second: Path) -> None:
    one, two = (without_time(read_result(f)) for f in (first, second))
    assert one == two
    a, b = (xarray.load_dataset(folder / "arrays.nc", engine="h5netcdf") for folder in (first, second))
    assert a.identical(b)
    for name in a.variables:
        assert a[name].values.tobytes() == b[name].values.tobytes(), name


@pytest.mark.slow
def test_simulate_twice(tmp_path):
    """Once with what the compilation cache keeps and once compiled anew."""
    (tmp_path / "s.toml").write_text(SCENARIO.replace('"0.5 s"', '"2 s"') + SENSOR)
    for n in (1, 2):
        call("simulate", tmp_path / "s.toml", "--out", tmp_path / f"out{n}", cached=n == 1)
    same(tmp_path / "out1", tmp_path / "out2")
    assert (tmp_path / "out1" / "trace.csv").read_bytes() == (tmp_path / "out2" / "trace.csv").read_bytes()
    # and another seed gives another record of the same motion
    call("simulate", tmp_path / "s.toml", "--out", tmp_path / "out3", "--set", "sensor.seed=5")
    assert (tmp_path / "out1" / "trace.csv").read_bytes() != (tmp_path / "out3" / "trace.csv").read_bytes()
    assert read_result(tmp_path / "out1")["events"] == read_result(tmp_path / "out3")["events"]


@pytest.mark.slow
def test_fit_static_twice(tmp_path):
    small_campaign(tmp_path)
    for n in (1, 2):
        call("fit", tmp_path / "campaign.toml", "--model", "static", "--out", tmp_path / f"out{n}")
    same(tmp_path / "out1", tmp_path / "out2")


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_fit_inertial_twice(tmp_path):
    """Once with what the compilation cache keeps and once compiled anew."""
    small_campaign(tmp_path)
    for n in (1, 2):
        call("fit", tmp_path / "campaign.toml", "--model", "inertial", "--out", tmp_path / f"out{n}", cached=n == 1)
    same(tmp_path / "out1", tmp_path / "out2")


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_diagnose_twice(tmp_path):
    small_campaign(tmp_path)
    for n in (1, 2):
        assert subprocess.run(diagnosis(tmp_path, tmp_path / f"out{n}", 2), capture_output=True).returncode in (0, 3)
    same(tmp_path / "out1", tmp_path / "out2")
