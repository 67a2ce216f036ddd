"""Timing, printing and keeping, shared by all parts of the benchmark."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

from stickslip import __version__

RESULTS = Path(__file__).resolve().parents[2] / "docs" / "results" / "performance.json"
_printed: list[list[str]] = []  # the rows of the last table, its head first


def timed(work: Callable[[], Any], repeats: int = 3) -> tuple[Any, float, float]:
    """Result, and the least processor and wall time (s) of some repeats; one where it takes above five seconds."""
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
    """Write a part among the results that docs/performance draws from, with version, date and processors."""
    known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
    known[part] = {
        "version": __version__,
        "date": date.today().isoformat(),
        "machine": f"{os.cpu_count()} processors",
        "command": f"python -m tests.benchmark --only {only}",
        **found,
    }
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
