"""Killed at any moment and started again: the same result, and nothing that is half written."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
import xarray

from stickslip.system.runstore import RESULT, open_run, read_result

from .challenges import challenge

SHIPPED = Path(__file__).parents[2] / "scenarios" / "hidden-effect"

# writes pieces as a diagnosis does, each of them worth a moment of work, and a result that depends on all of them
PIECEWISE = """
import sys, time
import numpy as np
from stickslip.system.runstore import open_run
from stickslip.objects.checkpoints import FinishedParts
with open_run(sys.argv[1], resume=True, force="--force" in sys.argv) as run:
    store, total = FinishedParts(run, "inputs"), np.zeros(40_000)
    for n in range(12):
        kept = store.load(f"piece{n}")
        if kept is None:
            time.sleep(0.02)
            store.save(f"piece{n}", {"z": np.random.default_rng(n).normal(size=40_000)})
            kept = store.load(f"piece{n}")
        total += kept["z"]
    run.json({"total": total, "seconds": time.time()})
    run.text("x" * 300_000, "report.html")
"""


def without_time(result: Any) -> Any:
    """A result less what depends on the clock."""
    if isinstance(result, dict):
        return {k: without_time(v) for k, v in result.items() if k not in ("seconds", "date", "started")}
    return [without_time(v) for v in result] if isinstance(result, list) else result


def killed(command: list[str], moment: float, **options: Any) -> bool:
    """Start a process and kill it after so many seconds; whether it was still at work."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **options)
    try:
        process.wait(moment)
        return False
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return True


def all_sound(folder: Path) -> None:
    """Whatever stands under its own name can be read; half-written files are called ``.part``."""
    for path in folder.rglob("*"):
        if path.suffix == ".json":
            json.loads(path.read_text(encoding="utf-8"))
        elif path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as file:
                assert all(np.size(file[name]) for name in file.files)
        elif path.suffix == ".nc":
            with xarray.open_dataset(path, engine="h5netcdf") as data:
                data.load()
        elif path.suffix == ".png":
            assert np.isfinite(matplotlib.image.imread(path)).all()
        elif path.suffix == ".html":
            assert path.read_text(encoding="utf-8").rstrip().endswith("</html>")
        elif path.suffix == ".toml":
            tomllib.loads(path.read_text(encoding="utf-8"))
        else:
            assert path.is_dir() or path.suffix in (".part", ".lock"), f"{path.name}: nobody says whether it is whole"


@pytest.mark.slow
@pytest.mark.parametrize("force", [False, True], ids=["new", "replacing"])
def test_piecewise_work_killed_again_and_again(tmp_path, force):
    """Kills at seeded moments, until it comes to its end."""
    command = [sys.executable, "-c", PIECEWISE]
    whole, out = tmp_path / "whole", tmp_path / "out"
    began = time.monotonic()
    subprocess.run([*command, str(whole)], check=True)
    length = time.monotonic() - began
    if force:
        with open_run(out) as run:
            run.json({"total": "of an older run"})
    rng, kills, older = random.Random(6), 0, read_result(out) if force else None
    want = without_time(read_result(whole))
    more = ["--force"] if force else []
    while kills < 4:
        if not force:
            shutil.rmtree(out, ignore_errors=True)
        kills += killed([*command, str(out), *more], rng.uniform(0.3, 0.95) * length)
        if (out / RESULT).exists():
            assert without_time(read_result(out)) in (older, want)
        elif force:  # died between the two renames: the next run brings it back
            assert (tmp_path / ".out.replaced" / RESULT).exists()
        if (tmp_path / "out.partial").exists():
            all_sound(tmp_path / "out.partial")
    if not out.exists() or force:
        subprocess.run([*command, str(out), *more], check=True)
    assert without_time(read_result(out)) == want
    assert sorted(p.name for p in tmp_path.iterdir() if not p.name.endswith(".lock")) == ["out", "whole"]


def test_a_run_that_died_while_replacing_gives_the_older_one_back(tmp_path):
    with open_run(tmp_path / "run") as run:
        run.json({"value": 1})
    (tmp_path / "run").rename(tmp_path / ".run.replaced")
    with pytest.raises(Exception, match="exists already"), open_run(tmp_path / "run"):
        pass
    assert read_result(tmp_path / "run") == {"value": 1}


def test_a_folder_of_the_users_with_a_like_name_is_left_alone(tmp_path):
    for value in (1, 2):
        with open_run(tmp_path / "run", force=True) as run:
            run.json({"value": value})
        if value == 1:
            (tmp_path / "run.old").mkdir()
            (tmp_path / "run.old" / "result.json").write_text("{}")
    assert (tmp_path / "run.old" / "result.json").read_text() == "{}"


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["cut", "zeroed", "empty"])
def test_a_damaged_piece_is_made_again(tmp_path, damage):
    """As a power failure may leave it, which writing aside does not help against."""
    command = [sys.executable, "-c", PIECEWISE, str(tmp_path / "out")]
    subprocess.run([*command[:-1], str(tmp_path / "whole")], check=True)
    shutil.copytree(tmp_path / "whole", tmp_path / "out.partial")
    (tmp_path / "out.partial" / RESULT).unlink()
    for n, path in enumerate(sorted((tmp_path / "out.partial" / "pieces").glob("*.npz"))):
        content = path.read_bytes()
        if n % 2:
            half = content[: len(content) // 2]
            path.write_bytes({"cut": half, "zeroed": half + bytes(len(content) - len(half)), "empty": b""}[damage])
    subprocess.run(command, check=True)
    assert without_time(read_result(tmp_path / "out")) == without_time(read_result(tmp_path / "whole"))


def small_campaign(folder: Path) -> Path:
    """The two fast runs of the shipped campaign."""
    head, *traces = (SHIPPED / "campaign.toml").read_text(encoding="utf-8").split("[[trace]]")
    kept = [t for t in traces if "v200.csv" in t or "v400.csv" in t]
    for name in ("v200.csv", "v400.csv"):
        shutil.copy(SHIPPED / name, folder / name)
    (folder / "campaign.toml").write_text("[[trace]]".join([head, *kept]), encoding="utf-8")
    return folder / "campaign.toml"


def diagnosis(folder: Path, out: Path, jobs: int) -> list[str]:
    return [
        sys.executable, "-m", "stickslip.cli", "diagnose", str(folder / "campaign.toml"), "--out", str(out),
        "--jobs", str(jobs), "--candidates", "contact-ageing,viscous-drag", "--max-effects", "1",
    ]  # fmt: skip


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_diagnosis_killed_at_twenty_random_moments(tmp_path, jobs):
    """`stickslip diagnose` of two runs; it ends between kills where all is done, and is begun anew then.

    With two jobs the processes of the candidates outlive the kill for a moment and find out by themselves.
    """
    small_campaign(tmp_path)
    began = time.monotonic()
    assert subprocess.run(diagnosis(tmp_path, tmp_path / "whole", jobs)).returncode in (0, 3)
    length = time.monotonic() - began
    whole = without_time(read_result(tmp_path / "whole"))
    rng, kills = random.Random(20), 0
    while kills < 20:
        kills += killed(diagnosis(tmp_path, tmp_path / "out", jobs), rng.uniform(0.05, 0.6) * length)
        if (tmp_path / "out.partial").exists():
            all_sound(tmp_path / "out.partial")
        if (tmp_path / "out").exists():
            assert without_time(read_result(tmp_path / "out")) == whole
            shutil.rmtree(tmp_path / "out")
    assert subprocess.run(diagnosis(tmp_path, tmp_path / "out", jobs)).returncode in (0, 3)
    assert without_time(read_result(tmp_path / "out")) == whole
    all_sound(tmp_path / "out")
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000


CHALLENGE = """
import sys
from stickslip.blind.run import run_challenge
from tests.robust.challenges import piecewise
if __name__ == "__main__":
    if sys.argv[2] == "real":
        found = run_challenge(sys.argv[1], workers=1, candidates=["sensor-drift"], max_effects=1)
    else:
        found = run_challenge(sys.argv[1], workers=1, diagnosis=piecewise)
    sys.exit(found["open"] + found["failed"] != 0)
"""


def _start(folder: Path, diagnosis: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", CHALLENGE, str(folder), diagnosis], start_new_session=True, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip


def _answers(folder: Path) -> dict[str, Any]:
    assert not list((folder / "runs").glob("*.failures.json"))
    assert not list((folder / "runs").glob("*.partial"))
    found = {p.name: without_time(read_result(p)) for p in sorted((folder / "runs").iterdir()) if p.is_dir()}
    return json.loads(json.dumps(found).replace(str(folder), "challenge"))  # where it lies is no answer


def _check_challenge(whole: Path, cut: Path, cases: int, diagnosis: str, kills: int) -> None:
    """Kill ``challenge run`` at random moments; where it came to its end before, it is begun anew."""
    began = time.monotonic()
    assert _start(whole, diagnosis).wait() == 0
    length, want = time.monotonic() - began, _answers(whole)
    assert len(want) == cases
    rng, done = random.Random(3), 0
    while done < kills:
        process = _start(cut, diagnosis)
        try:
            process.wait(rng.uniform(0.2, 0.9) * length)
        except subprocess.TimeoutExpired:
            process.kill()
            if done % 2:  # every second time the workers are left to find out by themselves
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            done += 1
        else:
            assert process.returncode == 0
            assert _answers(cut) == want
            shutil.rmtree(cut / "runs")
        for name in cut.glob("runs/*.json"):
            json.loads(name.read_text(encoding="utf-8"))
    assert _start(cut, diagnosis).wait() == 0
    assert _answers(cut) == want


@pytest.mark.slow
def test_a_challenge_killed_with_its_workers_goes_on(tmp_path):
    _check_challenge(challenge(tmp_path / "whole"), challenge(tmp_path / "cut"), 4, "invented", 2)


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_a_challenge_killed_at_twenty_random_moments(tmp_path):
    _check_challenge(challenge(tmp_path / "whole"), challenge(tmp_path / "cut"), 4, "invented", 20)


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_a_challenge_of_real_diagnoses_killed_at_twenty_random_moments(tmp_path):
    whole, cut = (challenge(tmp_path / name, 2, small_campaign) for name in ("whole", "cut"))
    _check_challenge(whole, cut, 2, "real", 20)
