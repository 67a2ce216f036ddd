"""``stickslip compare``: two runs side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..system.runstore import file_record, json_text, open_run, refuse_existing, versions
from . import show
from .parameters import Force, Json


def compare(first: Path, second: Path, *, out: Path | None = None, json: Json = False, force: Force = False) -> int:
    """Two runs side by side: models, verdicts, errors by phase, parameters and their differences.

    Parameters
    ----------
    first:
        Run folder of a diagnosis or of fit --model inertial.
    second:
        The other one.
    out:
        Folder for result.json and the picture compare.png.
    """
    refuse_existing(out, force)
    from ..show.report.compare import comparison

    found = comparison(first, second)
    if out is not None:
        from ..show.plots import save
        from ..show.report.compare import comparison_figure

        with open_run(out, force=force) as run:
            inputs = [file_record(folder / "result.json") for folder in (first, second)]
            run.json({"schema": 1, "kind": "compare", **found, "inputs": inputs, "versions": versions()})
            save(comparison_figure(found), run.path("compare.png"))
    print(json_text(found) if json else _text(found, out))
    return 0


def _text(found: dict[str, Any], out: Path | None) -> str:
    lines = []
    for number, run in enumerate(found["runs"], start=1):
        lines.append(f"{number}: {run['folder']} ({run['kind']}): {' + '.join(run['model'])}")
        if run["verdict"] is not None:
            lines.append(f"   {run['verdict']}: {run['text']}")
    rows = [[r["phase"], *(_error(e) for e in r["train"]), *(_error(e) for e in r["heldout"])] for r in found["errors"]]
    lines += ["", "residual over floor (1 is as good as the data allow):"]
    lines += [show.table(["phase", "fitted 1", "fitted 2", "unseen 1", "unseen 2"], rows), ""]
    cells = [
        [
            r["name"],
            *(_value(r, k) for k in (0, 1)),
            _value(r),
            "-" if r["deviations"] is None else f"{r['deviations']:+.1f}",
        ]
        for r in found["parameters"]
    ]
    lines.append(show.table(["parameter", "1", "2", "2 - 1", "in std"], cells))
    lines += ["", *(f"- {text}" for text in found["notes"])]
    if out is not None:
        lines.append(f"written to {out}: compare.png, result.json")
    return "\n".join(lines)


def _error(value: float | None) -> str:
    return show.quantity(value, "1", 3)


def _value(row: dict[str, Any], k: int | None = None) -> str:
    """One run's value with its standard deviation, or the difference."""
    value = row["difference"] if k is None else row["value"][k]
    std = None if k is None else row["std"][k]
    shown = show.quantity(value, row["unit"], 3 if k is None else 4)
    return shown if not std else f"{shown} +- {show.quantity(std, row['unit'], 3)}"
