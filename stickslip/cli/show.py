"""What commands show while they work and when they are done."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ..system.units import shown

if TYPE_CHECKING:
    from pathlib import Path

    from ..simulation.scenario import Progress

PATIENCE = 1.0  # s before a progress bar appears


@contextmanager
def progress_bar(title: str = "simulating") -> Iterator[Callable[[Progress], None]]:
    """A bar with simulated time and events so far, on stderr, only on a terminal and only after a second."""
    if not sys.stderr.isatty():
        yield lambda progress: None
        return
    from rich import progress as bars
    from rich.console import Console

    bar = bars.Progress(
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.TextColumn("{task.fields[text]}"),
        bars.TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task(title, total=1.0, text="")
    began, visible = time.monotonic(), False

    def watch(progress: Progress) -> None:
        nonlocal visible
        if not visible and time.monotonic() - began > PATIENCE:
            bar.start()
            visible = True
        share = progress.time / progress.end if progress.end > 0 else 1.0
        text = f"{progress.time:.4g} of {progress.end:.4g} s simulated, {progress.events} events"
        bar.update(task, completed=share, text=text)

    try:
        yield watch
    finally:
        if visible:
            bar.stop()


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """``4.3e-05, "m"`` as ``43 µm``; a dash where there is no number."""
    if value is None or value != value:
        return "-"
    if value in (float("inf"), float("-inf")):
        return "unlimited" if value > 0 else "-unlimited"
    return shown(value, unit, digits)


def table(header: list[str], rows: list[list[str]]) -> str:
    """Plain text columns, right aligned."""
    widths = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
    return "\n".join("  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in [header, *rows])


def told(result: Mapping[str, Any]) -> list[str]:
    """What was noticed, read in a certain way, and repaired, trace by trace."""
    return [
        f"{word}: {t['name']}: {text}"
        for key, word in (("warnings", "warning"), ("notes", "read"), ("repairs", "repaired"))
        for t in result.get("traces", ())
        for text in t[key]
    ]


def kept(out: Path | None) -> str:
    """Where the result lies."""
    if out is None:
        return "not saved: use --out FOLDER, which also writes a report with pictures"
    return f"written to {out}: report.html, result.json, arrays.nc"


def warn(text: str) -> None:
    """A warning on stderr."""
    print(f"stickslip: warning: {text}", file=sys.stderr)
