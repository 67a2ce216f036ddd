"""Measure static curve, solvers at equal accuracy, cost against size, many runs, inference, workbench.

The tables are printed; docs/results/performance.json, from which docs/performance.md draws them, is written as well.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from .measuring import head, keep, last_table, row, timed

ROOT = Path(__file__).resolve().parents[2]
SIZES = ("springs", "drive", "holds", "events")
_LAST = ("jacobian", "batches", "many", "writing", "command-line", "inspect", "fits", "diagnosis", "workbench")
PARTS = ("static", "solvers", "step", "sizes", *SIZES, *_LAST)
FACTOR = 3.0  # of tolerance, accurate enough at 256 springs (table of solvers)


def jacobian(small: bool = False) -> None:
    from .case import Case
    from .own import jacobian_runs

    head("Jacobian in 8 parameters", "processor s", "wall s", "in plain runs (processor)")
    plain = 0.0
    for name, work in jacobian_runs(Case(), FACTOR).items():
        work()
        _, cpu, wall = timed(work)
        plain = plain or cpu
        row(name, f"{cpu:.3f}", f"{wall:.3f}", f"{cpu / plain:.1f}")
    if not small:
        keep("jacobian", "jacobian", **last_table())


def command_line(small: bool = False) -> None:
    program = str(Path(sys.executable).with_name("stickslip"))
    head("command", "processor s", "wall s")
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "XDG_CACHE_HOME": folder}
        simulate = ["simulate", "scenarios/grzemba2014.toml"]
        kept = [*simulate, "--out", f"{folder}/out", "--force"]
        for name, arguments, repeats in (
            ("python, a sum of 10 million numbers", "sum(range(10_000_000))", 3),
            ("python, importing JAX, equinox and diffrax", "import jax, equinox, diffrax", 5),
            ("python, importing `stickslip.simulate` with them", "import stickslip; stickslip.simulate", 5),
            ("stickslip --help", ["--help"], 5),
            ("stickslip simulate scenarios/grzemba2014.toml, nothing compiled before", simulate, 1),
            ("the same again", simulate, 5),
            ("with --out: pictures, arrays, trace", kept, 5),
        ):
            command = [sys.executable, "-c", arguments] if isinstance(arguments, str) else [program, *arguments]
            cpu, wall = [], []
            for _ in range(repeats):
                before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
                subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, check=True)
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                wall.append(time.perf_counter() - start)
                cpu.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
            row(name, f"{min(cpu):.2f}", f"{min(wall):.2f}")
    if not small:
        keep("command-line", "command-line", **last_table())


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmark", description=__doc__)
    parser.add_argument(
        "--limit",
        type=float,
        default=10.0,
        help="processor seconds for each run of a peer among the solvers, or 100 times the own solver's, 60 s at most",
    )
    parser.add_argument("--springs", type=int, nargs="+", help="numbers of springs of the solvers")
    parser.add_argument("--sets", type=int, default=1000, help="parameter sets of the batches")
    parser.add_argument("--chunk", type=int, default=10, help="runs of one vmap among the batches")
    parser.add_argument("--vmap", action="store_true", help="of the batches one chunk alone, as for a GPU; not kept")
    parser.add_argument("--small", action="store_true", help="small sizes, to see that it runs; writes no files")
    parser.add_argument("--only", choices=PARTS, help="sizes: springs, drive, holds and events")
    arguments = parser.parse_args()
    only, small = arguments.only, arguments.small
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"{os.cpu_count()} processors, load {load} (processor time tells more than wall time where others work too)")
    # first, before anything else has taken memory
    if only in (None, "static"):
        from . import static

        static.report(small)
    if only in (None, "solvers"):
        from . import solvers

        solvers.report(arguments.limit, small, arguments.springs or solvers.SPRINGS)
    if only in (None, "step"):
        from . import step

        step.report(small)
    sizes_wanted = [part for part in SIZES if only in (None, "sizes", part)]
    if sizes_wanted:
        from . import sizes

        sizes.report(small, sizes_wanted)
    if only in (None, "jacobian"):
        jacobian(small)
    if only in (None, "batches"):
        from . import batches

        if arguments.vmap:
            batches.vmap_alone(FACTOR, arguments.chunk)
        else:
            batches.report(FACTOR, 8 if small else arguments.sets, arguments.chunk, kept=not small)
    if only in (None, "many"):
        from . import many

        many.sweeps(small)
    if only in (None, "writing"):
        from . import many

        many.writing(small)
    if only in (None, "command-line"):
        command_line(small)
    if only in (None, "inspect", "fits", "diagnosis"):
        from . import inference

        for part, measure in inference.PARTS.items():
            if only in (None, part):
                measure(small)
    if only in (None, "workbench"):
        from . import workbench

        workbench.report(small)


if __name__ == "__main__":
    main()
