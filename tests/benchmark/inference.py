"""What a user waits for at the command line with data: inspecting long records, static fits, a whole diagnosis."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from ..data.long_record import INSPECT, long_record, numbers
from .measuring import head, keep, last_table, row

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = 10_000_000
PROCESSES = 27  # creep processes, as many as the paper has
EMPTY, KEPT, ALONE = "nothing compiled before", "the same again", "from Python in one process, nothing kept compiled"
DIAGNOSE = """
import resource, sys
import stickslip as ss
ss.load_example().diagnose(jobs=1)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
"""


def inspecting(small: bool = False) -> None:
    """Records of ten million samples by ``stickslip inspect``: processor time, and the largest resident set."""
    samples = SAMPLES // 1000 if small else SAMPLES
    head("file", "processor s", "memory, MiB")
    for ending in ("npy", "csv"):
        with tempfile.TemporaryDirectory() as folder:
            path = long_record(Path(folder), ending, samples)
            size = (Path(folder) / f"a.{ending}").stat().st_size / 1e6
            code, spent, memory = numbers(INSPECT, path)
            assert code == 0, f"inspect ended with {code:.0f}"
        row(f"{ending.upper()}, {size:.0f} MB", f"{spent:.1f}", f"{memory / 2**20:.0f}")
    if not small:
        keep("inspect", "inspect", **last_table(), samples=samples)


def fits(small: bool = False) -> None:
    """Fits of the static model to creep processes with known H and h_rms."""
    from stickslip.inference.fit.static import fit_static
    from stickslip.inference.fit.static_table import static_table

    from ..fit.test_static import RIG, process

    rng = np.random.default_rng(1)
    number = 3 if small else PROCESSES
    drawn = [(rng.uniform(0.1, 0.85), float(np.exp(rng.uniform(np.log(1e-6), np.log(5e-6))))) for _ in range(number)]
    made = [process(hurst, h_rms, number=i) for i, (hurst, h_rms) in enumerate(drawn)]
    static_table()
    head("static fits", "processor s")
    for words in ("the first time, compiling", "again"):
        began = time.process_time()
        fit_static(made, RIG)
        row(f"{number} creep processes, {words}", f"{time.process_time() - began:.2f}")
    if not small:
        keep("fits", "fits", **last_table())


def diagnosis(small: bool = False) -> None:
    """The diagnosis of the shipped campaign, as ``make demo`` does it, and its memory where one process does all."""
    if small:
        return
    program = str(Path(sys.executable).with_name("stickslip"))
    head("diagnosis", "processor s", "wall s", "memory, MiB")
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "XDG_CACHE_HOME": folder}
        command = [program, "diagnose", "scenarios/hidden-effect/campaign.toml", "--out", f"{folder}/out", "--force"]
        for name, words in ((EMPTY, command), (KEPT, command), (ALONE, [sys.executable, "-c", DIAGNOSE])):
            before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            said = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=True).stdout
            wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
            spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            row(name, f"{spent:.0f}", f"{wall:.0f}", f"{float(said) / 2**20:.0f}" if name == ALONE else "")
    keep("diagnosis", "diagnosis", **last_table())


PARTS = {"inspect": inspecting, "fits": fits, "diagnosis": diagnosis}
