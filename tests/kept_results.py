"""Results that the pages draw their tables from: files in docs/results, each part with version, date and command."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from stickslip import __version__
from stickslip.system.runstore import write_aside

RESULTS = Path(__file__).resolve().parents[1] / "docs" / "results"


def kept(name: str) -> dict[str, Any]:
    """A file of results; empty where it has not been written."""
    path = RESULTS / f"{name}.json"
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return found


def dated(command: str, **found: Any) -> dict[str, Any]:
    """What was found, after the version that was measured, the date and the command."""
    return {"version": __version__, "date": date.today().isoformat(), "command": command, **found}


def keep(name: str, command: str, part: str | None = None, **found: Any) -> None:
    """Write what was found as the file ``name``, or as one ``part`` of it beside the others."""
    text = dated(command, **found)
    whole = text if part is None else {**kept(name), part: text}
    write_aside(RESULTS / f"{name}.json", json.dumps(whole, indent=1, ensure_ascii=False) + "\n")


def keep_table(
    name: str, command: str, part: str | None, columns: Sequence[str], rows: Iterable[Sequence[str]], **found: Any
) -> None:
    """Write a table, whose cells are text, as the file ``name`` or a part of it; and print it."""
    lines = [list(row) for row in rows]
    keep(name, command, part, columns=list(columns), rows=lines, **found)
    for line in lines:
        print(" | ".join(line), flush=True)
