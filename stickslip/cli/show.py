"""What commands show while they work and when they are done."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..scenario import Progress

PATIENCE = 1.0  # s before a progress bar appears

_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


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
    began, shown = time.monotonic(), False

    def watch(progress: Progress) -> None:
        nonlocal shown
        if not shown and time.monotonic() - began > PATIENCE:
            bar.start()
            shown = True
        share = progress.time / progress.end if progress.end > 0 else 1.0
        text = f"{progress.time:.4g} of {progress.end:.4g} s simulated, {progress.events} events"
        bar.update(task, completed=share, text=text)

    try:
        yield watch
    finally:
        if shown:
            bar.stop()


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """``4.3e-05, "m"`` as ``43 um``; a dash where there is no number."""
    if value is None or value != value:
        return "-"
    if value in (float("inf"), float("-inf")):
        return "unlimited" if value > 0 else "-unlimited"
    if value == 0 or unit[:1] in ("", "1"):  # no prefix for 1/m
        return f"{value:.{digits}g} {unit if unit != '1' else ''}".strip()
    import math

    power = max(-12, min(9, 3 * math.floor(math.log10(abs(value) * (1 + 10.0**-digits)) / 3)))
    return f"{value / 10.0**power:.{digits}g} {_PREFIXES[power]}{unit}"


def table(header: list[str], rows: list[list[str]]) -> str:
    """Plain text columns, right aligned."""
    widths = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
    return "\n".join("  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in [header, *rows])


def warn(text: str) -> None:
    """A warning on stderr."""
    print(f"stickslip: warning: {text}", file=sys.stderr)
