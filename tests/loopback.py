"""A dask cluster on loopback whose scheduler and workers are processes of their own."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any


def spawn(kind: str, *arguments: str) -> subprocess.Popen:
    command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments, "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def worker(address: str, folder: Path) -> subprocess.Popen:
    return spawn("worker", address, "--no-nanny", "--nthreads", "1", "--host", "127.0.0.1", "--local-directory",
                 str(folder))  # fmt: skip


@contextmanager
def loopback_cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen]]]:
    """A scheduler and workers as separate processes; gives its address and the workers."""
    file = folder / "scheduler.json"
    processes = [spawn("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))]
    try:
        address = wait_for(lambda: json.loads(file.read_text())["address"])
        processes += [worker(address, folder / f"worker{i}") for i in range(workers)]
        yield address, processes[1:]
    finally:
        for process in reversed(processes):
            process.kill()
        for process in processes:
            process.wait(10)


def wait_for(what: Callable[[], Any], patience: float = 30.0) -> Any:
    end = time.monotonic() + patience
    while time.monotonic() < end:
        with suppress(OSError, ValueError, KeyError):
            if (found := what()) is not None:
                return found
        time.sleep(0.05)
    raise TimeoutError
