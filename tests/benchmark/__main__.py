"""Print the benchmark's tables: solvers at equal accuracy, cost of a Jacobian, start-up of the command line."""

from __future__ import annotations

import argparse
import functools
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def timed(work: Callable[[], Any], repeats: int = 3) -> tuple[Any, float, float]:
    """Result, and the least processor and wall time (s) of some repeats."""
    cpu, wall, result = [], [], None
    for _ in range(repeats):
        c, w = time.process_time(), time.perf_counter()
        result = work()
        cpu.append(time.process_time() - c)
        wall.append(time.perf_counter() - w)
        if wall[-1] > 5.0:
            break
    return result, min(cpu), min(wall)


def row(*cells: object) -> None:
    print("| " + " | ".join(str(c) for c in cells) + " |", flush=True)


def head(*cells: str) -> None:
    print()
    row(*cells)
    row(*("---" for _ in cells))


def solvers(limit: float) -> float:
    """The table of solvers; the own solver's factor of tolerance that is accurate enough comes back."""
    from . import case, own, peers

    case.leapfrog(5e-5)  # compiles
    reference, cpu, wall = timed(lambda: case.leapfrog(2e-7), 1)
    events = case.measure(reference, reference).events
    print(
        f"{case.SPRINGS} elements, {case.DURATION:g} s of drive, {events} events. Accurate enough: recurrence to "
        f"{case.RECURRENCE:g} of the period, creep to {case.CREEP * 1e9:g} nm, against leapfrog with 0.2 us "
        f"({cpu:.1f} s). Times: least of three; runs above 5 s once."
    )
    head("solver", "setting", "processor s", "wall s", "steps", "recurrence", "creep nm", "accurate enough")

    def report(name: str, setting: str, answer: case.Answer, cpu: float, wall: float, steps: object) -> bool:
        found = case.measure(answer, reference)
        good = found.enough(events)
        row(
            name, setting, f"{cpu:.3f}", f"{wall:.3f}", steps, f"{found.recurrence:.1e}", f"{found.creep * 1e9:.2g}",
            "yes" if good else "no",
        )  # fmt: skip
        return good

    chosen = 10.0
    for factor in (0.3, 1.0, 3.0, 10.0):
        _, cold, _ = timed(lambda f=factor: own.own_answer(f), 1)
        (answer, stats), cpu, wall = timed(lambda f=factor: own.own_answer(f))
        name = f"own solver (first call {cold:.1f} s)" if factor == 0.3 else "own solver"
        if report(name, f"default tolerance/{factor:g}", answer, cpu, wall, stats.steps):
            chosen = factor
            break
    for dt in (4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5, 1e-5, 5e-6, 2.5e-6, 1e-6, 5e-7):
        answer, cpu, wall = timed(lambda dt=dt: case.leapfrog(dt))
        if report("leapfrog, numba", f"{dt * 1e6:g} us", answer, cpu, wall, round(case.DURATION / dt)):
            break
    for method in ("LSODA", "RK45", "Radau"):
        spent = time.process_time()
        for rtol in (1e-4, 1e-6, 1e-8):
            left = limit - (time.process_time() - spent)
            start = time.process_time()
            try:
                work = functools.partial(peers.scipy_answer, method, rtol, start + left)
                (answer, calls), cpu, wall = timed(work, 1)
            except peers.OverTime as why:
                row(f"scipy {method}", f"rtol {rtol:g}", f"over {limit:g} s in all", "", "", "", "", f"no: {why}")
                break
            if report(f"scipy {method}", f"rtol {rtol:g}", answer, cpu, wall, f"{calls} calls"):
                break
    return chosen


def jacobian(factor: float) -> None:
    from .own import jacobian_runs

    head("Jacobian in 8 parameters", "processor s", "wall s", "in plain runs (processor)")
    plain = 0.0
    for name, work in jacobian_runs(factor).items():
        work()
        _, cpu, wall = timed(work)
        plain = plain or cpu
        row(name, f"{cpu:.3f}", f"{wall:.3f}", f"{cpu / plain:.1f}")


def command_line() -> None:
    program = str(Path(sys.executable).with_name("stickslip"))
    head("command", "processor s", "wall s")
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "XDG_CACHE_HOME": folder}
        simulate = ["simulate", "scenarios/grzemba2014.toml", "--out", f"{folder}/out", "--force"]
        for name, arguments, repeats in (
            ("stickslip --help", ["--help"], 5),
            ("stickslip simulate scenarios/grzemba2014.toml, cold", simulate, 1),
            ("the same with the compilation cache", simulate, 3),
        ):
            cpu, wall = [], []
            for _ in range(repeats):
                before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
                subprocess.run([program, *arguments], cwd=ROOT, env=environment, capture_output=True, check=True)
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                wall.append(time.perf_counter() - start)
                cpu.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
            row(name, f"{min(cpu):.2f}", f"{min(wall):.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmark", description=__doc__)
    parser.add_argument("--limit", type=float, default=60.0, help="processor seconds for each solver of scipy")
    parser.add_argument("--only", choices=("solvers", "jacobian", "command-line"))
    arguments = parser.parse_args()
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"{os.cpu_count()} processors, load {load} (processor time tells more than wall time where others work too)")
    factor = 1.0
    if arguments.only in (None, "solvers"):
        factor = solvers(arguments.limit)
    if arguments.only in (None, "jacobian"):
        jacobian(factor)
    if arguments.only in (None, "command-line"):
        command_line()


if __name__ == "__main__":
    main()
