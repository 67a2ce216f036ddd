"""Timing, printing and keeping, shared by all parts of the benchmark."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import Any

from tests import kept_results

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
SLOWER = 1.5  # times what plain Python became, from which it is said
_printed: list[list[str]] = []  # the rows of the last table, its head first


def timed(work: Callable[[], Any], repeats: int = 3) -> tuple[Any, float, float]:
    """Result, and the least processor and wall time (s) of some repeats; two where it takes above five seconds.

    The first one may compile.
    """
    cpu, wall, result = [], [], None
    for _ in range(repeats):
        c, w = time.process_time(), time.perf_counter()
        result = work()
        cpu.append(time.process_time() - c)
        wall.append(time.perf_counter() - w)
        if wall[-1] > 5.0 and len(wall) > 1:
            break
    return result, min(cpu), min(wall)


def row(*cells: object) -> None:
    _printed.append([str(c) for c in cells])
    print("| " + " | ".join(_printed[-1]) + " |", flush=True)


def head(*cells: str) -> None:
    _printed.clear()
    print()
    row(*cells)
    print("| " + " | ".join("---" for _ in cells) + " |", flush=True)


def last_table() -> dict[str, Any]:
    """Columns and rows of the table that was printed last."""
    columns, *rows = _printed
    return {"columns": columns, "rows": [list(r) for r in rows]}


def keep(part: str, only: str, **found: Any) -> None:
    """Write a part among the results that docs/performance draws from, with version, date and processors.

    What was kept before stays as bare times, under ``earlier``.
    """
    before = kept_results.kept("performance").get(part, {})
    found = {**found, "yardstick_s": yardstick()}
    for line in slower(before, found):
        print(line, flush=True)
    kept_results.keep(
        "performance",
        f"python -m tests.benchmark --only {only}",
        part,
        commit=commit(),
        machine=f"{os.cpu_count()} processors",
        **found,
        earlier=[*before.get("earlier", []), *former(before)],
    )


def commit() -> str | None:
    """The commit that is measured, with a plus where files were changed since; None without git."""
    try:
        found = subprocess.run(
            ["git", "describe", "--always", "--dirty=+"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return found.stdout.strip()


def former(part: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The times of a part that is measured anew, with version and date; empty where there is none."""
    kept = {key: part.get(key) for key in ("version", "commit", "date", "yardstick_s")}
    return [{**kept, "times": times(part)}] if part else []


def yardstick() -> float:
    """Processor time (s) of plain Python: how fast the machine is at the moment."""
    return timed(lambda: sum(range(10_000_000)), 5)[1]


def slower(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What takes longer than it did in the results of an earlier version, or is no longer finished, a line each.

    Against the time of plain Python, so that a slower machine does not count; where that was not kept, against the
    median of the part.
    """
    old, new = times(before), times(now)
    ratios = {name: new[name] / old[name] for name in new if old.get(name, 0.0) > 0.0 and new[name] > 0.0}
    lost = [name for name, seconds in new.items() if seconds == 0.0 and old.get(name, 0.0) > 0.0]
    lines = [f"no longer finished: {name}, {old[name]:.3g} s in the kept results" for name in lost]
    lines += [f"no longer measured under this name: {name}" for name in old if name not in new]
    if not ratios:
        return lines
    was, among = before.get("yardstick_s"), "plain Python"
    if was and now.get("yardstick_s"):
        usual = now["yardstick_s"] / was
    else:
        usual, among = median(ratios.values()), "the others"
    return lines + [
        f"slower than in the kept results: {name}, {old[name]:.3g} -> {new[name]:.3g} s "
        f"({ratio / usual:.1f} times what {among} became)"
        for name, ratio in ratios.items()
        if ratio > SLOWER * usual
    ]


def times(part: Any, path: str = "") -> dict[str, float]:
    """Name -> seconds of everything in a part of the results that has a time: rows of tables, and runs."""
    if isinstance(part, list):
        return {k: v for item in part for k, v in times(item, path).items()}
    if not isinstance(part, Mapping):
        return {}
    if "processor_s" in part:
        what = [f"{key} {part[key]}" for key in ("solver", "size", "springs", "velocity", "events") if key in part]
        return {" ".join([path, *what]).strip(): float(part["processor_s"] or 0.0)}
    out = {}
    for title, *cells in part["rows"] if "columns" in part else ():
        for column, cell in zip(part["columns"][1:], cells, strict=True):
            value, _, unit = cell.partition(" ")
            size = UNITS.get(unit) or next((UNITS[word] for word in column.split() if word in UNITS), None)
            with suppress(ValueError):
                if size is not None:
                    out[f"{title}, {column}"] = size * float(value)
    for key, item in part.items():
        if key not in ("rows", "columns"):
            out |= times(item, key)
    return out
