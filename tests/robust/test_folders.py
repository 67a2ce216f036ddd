"""Results and the disk: never overwritten unasked, never two at once, never half written."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from stickslip.blind.one_case import do_case
from stickslip.cli import run
from stickslip.show.report import write_report
from stickslip.system.runstore import RESULT, open_run, read_result

from .challenges import challenge
from .seeds import beside
from .test_killed import small_campaign

SCENARIO = """\
schema = 1
[block]
mass = 0.1
spring_stiffness = 1e3
[drive]
velocity = "100 um/s"
duration = "0.5 s"
[contact]
kind = "power-law"
normal_force = 0.3
friction_coefficient = 0.2
u_max = "1 um"
p = 3.2
bins = 16
[output]
trace = "trace.csv"
"""
CAMPAIGN = """\
schema = 1
[rig]
mass = 0.1
[[trace]]
file = "a.csv"
time = { column = "time", unit = "s" }
displacement = { column = "x", unit = "um" }
drive_velocity = "50 um/s"
"""


MAIN = "import sys\nfrom stickslip.cli import main\nsys.exit(main())"


@pytest.fixture
def files(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "s.toml").write_text(SCENARIO)
    (folder / "c.toml").write_text(CAMPAIGN)
    for name, content in beside().items():
        (folder / name).write_bytes(content)
    return folder


def commands(files: Path) -> dict[str, list[str]]:
    """Every command that writes a run folder."""
    return {
        "simulate": ["simulate", str(files / "s.toml")],
        "series": ["simulate", str(files / "s.toml"), "--sweep", "drive.velocity=50um/s,100um/s"],
        "creep": ["creep", str(files / "s.toml"), "--points", "20"],
        "inspect": ["inspect", str(files / "c.toml")],
        "fit": ["fit", str(files / "c.toml"), "--model", "static"],
        "fit-inertial": ["fit", str(files / "c.toml"), "--model", "inertial"],
        "diagnose": ["diagnose", str(files / "c.toml")],
        "compare": ["compare", str(files / "one"), str(files / "two")],
    }


NAMES = list(commands(Path()))


@pytest.mark.parametrize("name", NAMES)
def test_an_existing_result_is_never_overwritten(files, tmp_path, capsys, name):
    out = tmp_path / "out"
    with open_run(out) as folder:
        folder.json({"value": 1})
        folder.text("mine", "notes.txt")
    assert run([*commands(files)[name], "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert "exists already" in error
    assert "--force" in error
    assert read_result(out) == {"value": 1}
    assert (out / "notes.txt").read_text() == "mine"
    # what is no run folder is not replaced with --force either
    (out / RESULT).unlink()
    assert run([*commands(files)[name], "--out", str(out), "--force"]) == 2
    assert (out / "notes.txt").read_text() == "mine"
    capsys.readouterr()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["simulate", "series", "creep", "inspect"])
def test_force_replaces_the_whole(files, tmp_path, capsys, name):
    out = tmp_path / "out"
    with open_run(out) as folder:
        folder.json({"value": 1})
        folder.text("old", "old.txt")
    assert run([*commands(files)[name], "--out", str(out), "--force"]) == 0
    assert "value" not in read_result(out)
    assert not (out / "old.txt").exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in", "out"]
    capsys.readouterr()


@pytest.mark.parametrize("name", ["simulate", "creep", "inspect", "fit", "diagnose", "compare"])
def test_the_second_run_into_a_folder_is_refused_while_the_first_is_at_work(files, tmp_path, capsys, name):
    with open_run(tmp_path / "out") as first:
        first.json({"value": 1})
        assert run([*commands(files)[name], "--out", str(tmp_path / "out")]) == 2
        assert "another run is writing this folder" in capsys.readouterr().err
    assert read_result(tmp_path / "out") == {"value": 1}
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [RESULT]


def test_of_many_at_once_exactly_one_writes(tmp_path):
    program = (
        "import sys, time\nfrom stickslip.system.runstore import open_run\n"
        "from stickslip.errors import RunFolderError\n"
        "try:\n  with open_run(sys.argv[1]) as run:\n    run.json({'by': sys.argv[2]}); time.sleep(0.5)\n"
        "except RunFolderError: sys.exit(2)\n"
    )
    many = [subprocess.Popen([sys.executable, "-c", program, str(tmp_path / "out"), str(n)]) for n in range(6)]
    codes = [process.wait() for process in many]
    assert sorted(codes) == [0, 2, 2, 2, 2, 2]
    assert read_result(tmp_path / "out")["by"] == str(codes.index(0))
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_a_challenge_is_not_made_twice_and_its_answers_stay(tmp_path, capsys):
    folder = challenge(tmp_path / "c")
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    assert run(["challenge", "make", str(folder), "--cases", "2"]) == 2
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before
    capsys.readouterr()


@pytest.mark.parametrize("name", ["simulate", "creep", "inspect"])
def test_no_place_to_write(files, tmp_path, capsys, name):
    """A file where the folder's parent should be: nobody can write there, not even root."""
    (tmp_path / "file").write_text("")
    assert run([*commands(files)[name], "--out", str(tmp_path / "file" / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("stickslip: ")
    assert "Traceback" not in error
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "in"]


def as_an_ordinary_user() -> list[str]:
    """What to put before a command so that it may not write everywhere: root has no such right in a namespace."""
    if os.geteuid() != 0:
        return []
    if (
        shutil.which("unshare") is None
        or subprocess.run(["unshare", "-U", "true"], stderr=subprocess.DEVNULL).returncode
    ):
        pytest.skip("root may write everywhere, and the system lets it not be somebody else (unshare -U)")
    return ["unshare", "-U"]


def test_a_read_only_folder(files, tmp_path):
    (tmp_path / "shut").mkdir(mode=0o555)
    out = tmp_path / "shut" / "out"
    command = [
        *as_an_ordinary_user(),
        sys.executable,
        "-m",
        "stickslip.cli",
        *commands(files)["creep"],
        "--out",
        str(out),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert "the run folder cannot be written" in done.stderr
    assert "Permission denied" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_link_in_a_read_only_folder_leads_to_where_one_may_write(files, tmp_path):
    (tmp_path / "open").mkdir()
    (tmp_path / "shut").mkdir()
    (tmp_path / "shut" / "out").symlink_to(tmp_path / "open" / "out")
    (tmp_path / "shut").chmod(0o555)
    command = [*as_an_ordinary_user(), sys.executable, "-m", "stickslip.cli", *commands(files)["creep"]]
    assert subprocess.run([*command, "--out", str(tmp_path / "shut" / "out")], capture_output=True).returncode == 0
    assert (tmp_path / "open" / "out" / RESULT).is_file()


def test_a_read_only_disk(files, tmp_path, capsys, monkeypatch):
    real = Path.mkdir

    def refuse(self, *a, **k):
        if "out" in self.name:
            raise OSError(30, "Read-only file system", str(self))
        return real(self, *a, **k)

    monkeypatch.setattr(Path, "mkdir", refuse)
    assert run([*commands(files)["creep"], "--out", str(tmp_path / "out")]) == 2
    assert "Read-only file system" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def on_a_full_disk(arguments: list[str], out: Path, limit: int) -> bool:
    """Run where no file may grow beyond ``limit``; whether it was refused, in words and with nothing left behind."""
    before = sorted(p.name for p in out.parent.iterdir())
    program = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit},) * 2)\n{MAIN}"
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments, "--out", str(out)],
        capture_output=True, text=True, env={**os.environ, "STICKSLIP_NO_CACHE": "1"},
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    if done.returncode in (0, 3):  # everything fitted
        assert max(p.stat().st_size for p in out.rglob("*")) <= limit
        return False
    assert done.returncode == 2
    assert "stickslip: " in done.stderr
    assert "File too large" in done.stderr or "written" in done.stderr
    left = {p.name for p in out.parent.iterdir()} - set(before)
    assert left <= {f"{out.name}.partial"}  # the finished pieces of a diagnosis
    return True


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "limit"), [("creep", 100), ("creep", 3000), ("inspect", 100), ("inspect", 3000), ("simulate", 60_000)]
)
def test_a_full_disk(files, tmp_path, name, limit):
    """Every kind of file is the first that does not fit, at one of the limits."""
    refused = on_a_full_disk(commands(files)[name], tmp_path / "out", limit)
    assert sorted(p.name for p in tmp_path.iterdir()) == (["in"] if refused else ["in", "out"])


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_a_full_disk_under_long_work(tmp_path):
    """Fits, a diagnosis and a comparison of the shipped campaign: refused in words, and done once there is room."""
    campaign = str(small_campaign(tmp_path))
    tasks = {
        "static": ["fit", campaign, "--model", "static"],
        "inertial": ["fit", campaign, "--model", "inertial"],
        "diagnosis": ["diagnose", campaign, "--jobs", "1", "--candidates", "sensor-drift", "--max-effects", "1"],
        "compared": ["compare", str(tmp_path / "inertial"), str(tmp_path / "diagnosis")],
    }
    for name, arguments in tasks.items():
        assert on_a_full_disk(arguments, tmp_path / name, 100)
        if not on_a_full_disk(arguments, tmp_path / name, 20_000):
            shutil.rmtree(tmp_path / name)  # a comparison is small
        assert run([*arguments, "--out", str(tmp_path / name)]) in (0, 3)
        assert (tmp_path / name / RESULT).is_file()


ON_A_DISK = """
import contextlib, io, json, sys
from stickslip.cli import run
if __name__ == "__main__":
    found = {}
    for name, arguments in json.loads(sys.stdin.read()).items():
        said = io.StringIO()
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            code = run(arguments)
        found[name] = [code, said.getvalue()]
    print(json.dumps(found))
"""


def on_a_disk(disk: Path, make: str, work: dict[str, list[str]]) -> tuple[dict[str, list], list[str]]:
    """Run commands where a small disk is mounted, out of sight of everyone else; what each said, and what is there."""
    disk.mkdir()
    script = f'mount -t tmpfs -o size=1M,mode=777 tmpfs "$0" && {{ {make}; }} && "$1" -c "$2" && ls -A "$0" >&2'
    if subprocess.run(["unshare", "-Urm", "sh", "-c", 'mount -t tmpfs tmpfs "$0"', str(disk)]).returncode:
        pytest.skip("the system lets nobody mount a disk of their own here (unshare -Urm)")
    done = subprocess.run(
        ["unshare", "-Urm", "sh", "-c", script, str(disk), sys.executable, ON_A_DISK], input=json.dumps(work),
        capture_output=True, text=True, env={**os.environ, "STICKSLIP_NO_CACHE": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1]), done.stderr.split("\n")[:-1]


@pytest.fixture
def every_command(files, tmp_path):
    """Everything that writes, into ``tmp_path / "disk"``; what it reads is good, or (``compare``) comes later."""
    disk = tmp_path / "disk"
    measured = tmp_path / "measured"
    measured.mkdir()
    small_campaign(measured)
    given = commands(files)
    for name in ("inspect", "fit", "fit-inertial", "diagnose"):
        given[name][1] = str(measured / "campaign.toml")
    out = {name: [*arguments, "--out", str(disk / name)] for name, arguments in given.items()}
    return {
        **out,
        "new": ["new", "scenario", str(disk / "s.toml")],
        "challenge make": ["challenge", "make", str(disk / "c"), "--cases", "1", "--grouped", "--jobs", "1"],
        "challenge run": ["challenge", "run", str(disk / "made"), "--workers", "1"],
        "effects": ["effects", "contact-ageing", "--picture", str(disk / "e.png")],
    }


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("unshare") is None, reason="needs unshare")
def test_every_command_on_a_read_only_disk(every_command, tmp_path):
    made = challenge(tmp_path / "made", 1, small_campaign)
    found, there = on_a_disk(tmp_path / "disk", f'cp -r {made} "$0" && mount -o remount,ro "$0"', every_command)
    for name, (code, said) in found.items():
        assert code == 2, (name, said)
        assert "Read-only file system" in said, (name, said)
        assert "Traceback" not in said
    assert there == ["made"]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("unshare") is None, reason="needs unshare")
def test_every_command_on_a_disk_that_is_full(every_command, tmp_path):
    """Eight kilobytes are left: enough to begin, and for nothing that a command writes."""
    made = challenge(tmp_path / "made", 1, small_campaign)
    fill = f'cp -r {made} "$0" && dd if=/dev/zero of="$0/filled" bs=4k 2>/dev/null; truncate -s -8k "$0/filled"'
    for name in ("fit", "fit-inertial", "diagnose", "compare"):  # `test_a_full_disk_under_long_work`
        del every_command[name]
    found, there = on_a_disk(tmp_path / "disk", fill, every_command)
    for name, (code, said) in found.items():
        if name != "new" or code:  # the one small file may fit
            assert code == 2, (name, said)
            assert "No space left on device" in said, (name, said)
            assert "Traceback" not in said
    assert {n for n in there if not n.endswith(".partial")} - {"s.toml"} == {"filled", "made"}


CHALLENGE = """
import resource, sys
from stickslip.blind.run import run_challenge
from stickslip.errors import StickslipError
from tests.robust.challenges import piecewise
if __name__ == "__main__":
    limit = int(sys.argv[2])
    if limit:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    try:
        found = run_challenge(sys.argv[1], workers=2, diagnosis=piecewise)
    except StickslipError as error:
        print(error, file=sys.stderr)
        sys.exit(error.exit_code)
    sys.exit(found["open"] + found["failed"] != 0)
"""


def run_piecewise(folder: Path, limit: int = 0) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", CHALLENGE, str(folder), str(limit)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("limit", [4_000, 12_000], ids=["the pieces do not fit", "the result does not fit"])
def test_a_challenge_on_a_full_disk_stops_in_words_and_goes_on(tmp_path, limit):
    """A full disk is no failure of a case: with room again, all are done, as if nothing had been."""
    folder, whole = (challenge(tmp_path / name, 2) for name in ("full", "whole"))
    process = run_piecewise(folder, limit)
    _, said = process.communicate()
    assert process.returncode == 2, said
    assert "File too large" in said
    assert "case-00" in said
    assert "make room" in said
    assert "Traceback" not in said
    assert not list((folder / "runs").glob("*.failures.json"))
    for path in (folder, whole):
        process = run_piecewise(path)
        _, said = process.communicate()
        assert process.returncode == 0, said
    for name in ("case-001", "case-002"):
        totals = [read_result(path / "runs" / name)["total"] for path in (folder, whole)]
        assert totals[0] == totals[1]


def test_a_report_that_does_not_fit_is_no_failure_of_the_case(tmp_path, monkeypatch):
    """The last and largest file of a diagnosis, and the one that is written by another module."""
    runs, real = tmp_path / "runs", Path.replace

    def full(self, target):
        if Path(target).name == "report.html":
            raise OSError(errno.ENOSPC, "No space left on device", str(self))
        return real(self, target)

    def diagnosis(campaign, out):
        with open_run(out, resume=True) as folder:
            folder.json({"schema": 1, "kind": "compare"})
            monkeypatch.setattr("stickslip.show.report.html.render", lambda *a: "<html></html>")
            monkeypatch.setattr("stickslip.show.report.html._arrays", lambda *a: {})
            monkeypatch.setattr("stickslip.show.report.sections.pictures", lambda *a: [])
            write_report(folder.folder)

    runs.mkdir()
    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        told = do_case("c.toml", str(runs), "case-001", diagnosis, "session")
    assert told["state"] == "refused"
    assert "No space left on device" in told["message"]
    assert not list(runs.glob("*.failures.json"))
    assert do_case("c.toml", str(runs), "case-001", diagnosis, "session")["state"] == "done"


@pytest.mark.slow
def test_a_second_run_of_a_challenge_is_refused_while_the_first_is_at_work(tmp_path, capsys):
    folder = challenge(tmp_path / "c", 4)
    first = run_piecewise(folder)
    while not (folder / "runs" / "protocol.json").exists():
        assert first.poll() is None
        time.sleep(0.02)
    assert run(["challenge", "run", str(folder), "--workers", "1"]) == 2
    assert "another run is writing this folder" in capsys.readouterr().err
    _, said = first.communicate()
    assert first.returncode == 0, said
    names = [f"case-00{n}" for n in range(1, 5)]
    assert [p.name for p in sorted((folder / "runs").iterdir()) if p.is_dir()] == names


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("name", ["creep", "inspect"])
def test_a_full_disk_behind_the_standard_output(files, name):
    with open("/dev/full", "w") as full:  # noqa: PTH123
        command = [sys.executable, "-m", "stickslip.cli", *commands(files)[name], *["--json"] * (name == "inspect")]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


def test_a_disk_that_fills_while_pieces_are_kept(tmp_path):
    """What was kept before stays, is whole, and is gone on from."""
    program = (
        "import sys, numpy as np\nfrom stickslip.system.runstore import open_run\n"
        "from stickslip.objects.checkpoints import FinishedParts\n"
        "with open_run(sys.argv[1], resume=True) as run:\n  store = FinishedParts(run, 'i')\n  kept = 0\n"
        "  for n in range(6):\n    if store.load(f'p{n}') is None:\n"
        "      store.save(f'p{n}', {'z': np.arange(10_000.0 * (n + 1))})\n    else: kept += 1\n"
        "  run.json({'kept': kept})\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "out")]
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (250_000, 250_000))\n"
    limited = [sys.executable, "-c", limit + program, str(tmp_path / "out")]
    first = subprocess.run(limited, capture_output=True, text=True)
    assert "RunFolderError" in first.stderr
    assert "File too large" in first.stderr
    assert not (tmp_path / "out").exists()
    for path in (tmp_path / "out.partial").rglob("*.npz"):
        with np.load(path) as file:
            assert file["z"].size
    subprocess.run(command, check=True)
    assert json.loads((tmp_path / "out" / RESULT).read_text()) == {"kept": 3}
