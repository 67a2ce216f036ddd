"""What the report's tables show, made from a ``result.json`` whose every key may be missing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ...system.units import shown


def tables(result: Mapping[str, Any]) -> dict[str, Any]:
    """Variables of the template: what the result has, and what follows from its ladder."""
    found = {key: value for key, value in result.items() if value is not None}
    ladder = found.get("ladder", ())
    phases = dict.fromkeys(p for step in ladder for p in step.get("by_phase") or ())
    return {**found, "ladder_phases": list(phases), "free_simulated": any(step.get("free") for step in ladder)}


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
