"""What commands show while they work and when they are done."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..system.units import shown

if TYPE_CHECKING:
    from pathlib import Path


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
