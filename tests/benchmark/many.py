"""Ten thousand rigs by `ss.sweep`, and a million samples written: time, memory and size on disk."""

from __future__ import annotations

import resource
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

import stickslip as ss
from stickslip.simulation.scenario.writers import write_trace
from tests.scenario.conftest import rig

from .measuring import head, keep, last_table, row, timed

RIGS, SAMPLES = 10_000, 1_000_000


def sweeps(small: bool = False) -> None:
    """Velocity, drop of friction and damping drawn for every rig; a tenth in this process, all by two."""
    scenario = ss.make_scenario(rig())
    ss.simulate(scenario)
    head("ss.sweep", "rigs", "wall ms a rig", "events a rig", "calling process grown MiB", "largest folder MiB")
    for name, workers, rigs in (("one process", 1, RIGS // 10), ("two processes", 2, RIGS)):
        rigs, before = 40 if small else rigs, _memory()
        rng = np.random.default_rng(0)
        changes = {
            "drive.velocity": rng.uniform(1e-4, 3e-4, rigs),
            "weakening.ratio": rng.uniform(0.8, 0.9, rigs),
            "block.damping": rng.uniform(8.0, 12.0, rigs),
        }
        with tempfile.TemporaryDirectory() as folder:
            sizes, ended = [0], threading.Event()
            watch = threading.Thread(target=_watch, args=(Path(folder), sizes, ended))
            watch.start()
            start = time.perf_counter()
            try:
                found = ss.sweep(scenario, changes, out=Path(folder) / "out", workers=workers)
            finally:
                ended.set()
                watch.join()
            wall = time.perf_counter() - start
        row(name, rigs, f"{1e3 * wall / rigs:.1f}", f"{float(found.events.mean()):.1f}", f"{_memory() - before:.0f}",
            f"{max(sizes) / 2**20:.1f}")  # fmt: skip
    if not small:
        keep("many", "many", **last_table())


def _memory() -> float:
    """MiB that this process has held at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _watch(folder: Path, sizes: list[int], ended: threading.Event) -> None:
    """What lies in a folder (bytes), a look a second."""
    while not ended.wait(1.0):
        size = 0
        for path in folder.rglob("*"):
            try:
                size += path.stat().st_size
            except OSError:  # renamed in the meantime
                continue
        sizes.append(size)


def writing(small: bool = False) -> None:
    """A trace of a million samples in every format."""
    n = 1000 if small else SAMPLES
    t = np.arange(n) / 5e4
    x = np.cumsum(np.random.default_rng(0).normal(size=n)) * 1e-3
    one = {"time": (t, "s"), "displacement": (x, "um")}
    four = {**one, "velocity": (x, "mm/s"), "spring_force": (x, "mN")}
    head(f"{n} samples", "processor s", "wall s", "MiB")
    with tempfile.TemporaryDirectory() as folder:
        for name, ending, columns in (
            ("CSV, time and displacement", "csv", one),
            ("CSV, four columns", "csv", four),
            ("UFF", "uff", one),
            ("MAT", "mat", one),
            ("NetCDF", "nc", one),
        ):
            path = Path(folder) / f"trace.{ending}"
            _, cpu, wall = timed(lambda p=path, c=columns: write_trace(p, c))
            row(name, f"{cpu:.2f}", f"{wall:.2f}", f"{path.stat().st_size / 2**20:.0f}")
    if not small:
        keep("writing", "writing", **last_table())
