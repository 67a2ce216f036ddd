"""What the report's tables show, made from a ``result.json`` whose every key may be missing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..units import shown

_KNOWN: dict[str, Any] = {
    "verdict": {}, "ladder": [], "ranking": [], "parameters": {}, "equations": [], "identifiability": [], "traces": [],
    "dropped": [], "inputs": [], "versions": {}, "static": None, "misfit": None, "next_experiment": None, "can": [],
    "cannot": [], "effective": None, "profiles": [], "ramps": None, "notes": [], "title": "", "kind": "run",
    "seconds": None, "summary": "", "caution": [], "ranking_base": None, "later_rounds": [],
    "visible": {}, "structure": None, "backbone": None,
}  # fmt: skip


def tables(result: Mapping[str, Any]) -> dict[str, Any]:
    """Variables of the template: every key it knows, with an empty value where the result has none."""
    found = {key: _or(result.get(key), empty) for key, empty in _KNOWN.items()}
    found["misfit_rows"] = _misfit_rows(found["misfit"])
    found["ladder_phases"] = list(dict.fromkeys(p for step in found["ladder"] for p in _or(step.get("by_phase"), {})))
    found["free_simulated"] = any(step.get("free") for step in found["ladder"])
    return found


def _or(value: Any, empty: Any) -> Any:
    return empty if value is None else value


def show(value: Any, unit: str = "1", digits: int = 4) -> str:
    """``4.3e-05, "m"`` as ``43 µm``; a dash where there is no number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value) or "–" if isinstance(value, str) else "–"
    return shown(value, unit or "1", digits) if math.isfinite(value) else "–"


def lasting(seconds: Any) -> str:
    """A duration for a person: seconds up to five minutes, then minutes."""
    if not isinstance(seconds, (int, float)):
        return ""
    return f"{seconds:.3g} s" if seconds < 300 else f"{seconds / 60:.0f} min"


def percent(value: Any, digits: int = 2) -> str:
    """A share as a percentage."""
    return f"{show(100.0 * value, '1', digits)} %" if isinstance(value, (int, float)) else "–"


def deviation(part: Any) -> str:
    """Error of a free simulation: per cent, and in brackets in units of the scatter."""
    if not isinstance(part, Mapping):
        return "–"
    scatters = part.get("scatters")
    return percent(part.get("relative")) + (f" ({show(scatters, digits=2)})" if scatters is not None else "")


def _misfit_rows(misfit: Any) -> list[dict[str, Any]]:
    """Rows of the table phase by velocity, with a shade for every cell."""
    table = misfit.get("table") if isinstance(misfit, Mapping) else None
    if not table:
        return []
    rows = []
    for run, velocity, errors in zip(table["runs"], table["velocities"], table["errors"], strict=True):
        cells = [{"text": show(e, digits=3), "shade": _shade(e)} for e in errors]
        rows.append({"run": run, "velocity": show(velocity, "m/s", 3), "cells": cells})
    return rows


def _shade(error: float | None) -> str:
    """A background between white (at the floor) and orange (30 floors off)."""
    if error is None or not math.isfinite(error):
        return "#f3f4f6"
    share = min(max(math.log(max(error, 1.0)) / math.log(30.0), 0.0), 1.0)
    mix = [round(255 + share * (c - 255)) for c in (232, 128, 96)]
    return "#{:02x}{:02x}{:02x}".format(*mix)
