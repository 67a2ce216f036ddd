"""Workers of a process that was killed do not stay."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

# as the trials of a diagnosis do it: each job says which process does it, and takes long
SWEEP = """
import os, sys, time
from pathlib import Path
from joblib import Parallel, delayed
from stickslip.system.parent_watch import end_with
def job(parent, folder):
    end_with(parent)
    Path(folder, str(os.getpid())).touch()
    time.sleep(60)
list(Parallel(n_jobs=2)(delayed(job)(os.getpid(), sys.argv[1]) for _ in range(4)))
"""


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits to be collected does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up as Linux lists them")
def test_workers_of_a_killed_sweep_end(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", SWEEP, str(tmp_path)])
    try:
        until = time.monotonic() + 60.0
        while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < until:
            time.sleep(0.1)
        workers = [int(p.name) for p in tmp_path.iterdir()]
        assert len(workers) == 2
        assert all(alive(pid) for pid in workers)
        process.kill()
        process.wait()
        until = time.monotonic() + 20.0
        while any(alive(pid) for pid in workers) and time.monotonic() < until:
            time.sleep(0.1)
        assert not any(alive(pid) for pid in workers)
    finally:
        process.kill()
        process.wait()
        for path in tmp_path.iterdir():
            with suppress(OSError):
                os.kill(int(path.name), signal.SIGKILL)


def test_a_trial_in_a_worker_ends_with_the_diagnosis(monkeypatch, tmp_path):
    from cloudpickle import dumps, loads

    from stickslip.inference.diagnose import parallel_refits
    from stickslip.system import cache

    ends = []
    monkeypatch.setattr(parallel_refits, "end_with", ends.append)
    monkeypatch.setattr(cache, "keep_compiled", lambda: None)
    monkeypatch.setattr(parallel_refits, "Explained", lambda base: f"explained {base}")
    monkeypatch.setattr(parallel_refits, "try_effect", lambda *arguments: arguments)
    (tmp_path / "base").write_bytes(dumps("base"))
    made = loads(parallel_refits._in_worker(tmp_path / "base", "wear", [{"course": "linear"}], (), 4321))
    assert made == ["base", "explained base", "wear", [{"course": "linear"}]]
    assert ends == [4321]
