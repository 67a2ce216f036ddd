"""Periodic motion while the block sticks, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...data.trace import Trace
from ...system.units import shown


def ripple_text(lines: Sequence[Mapping[str, float]], trace: Trace, unit: str) -> str:
    """The lines that :func:`stickslip.data.segment.stick_ripple.stick_ripple` found, in words."""
    if not lines:
        return "no ripple stands out while the block sticks"
    parts = []
    for line in lines:
        part = f"period {line['period']:.4g} s"
        mains = next((f for f in (50, 60) if abs(1 / line["period"] - f) < 0.01 * f), None)
        if mains:
            part += f" (mains, {mains} Hz)"
        elif trace.drive_velocity:
            part += f" ({shown(line['period'] * trace.drive_velocity, 'm', 3)} of drive)"
        size = f"{line['amplitude'] * 1e9:.3g} nm" if unit == "m" else f"{line['amplitude']:.3g} {unit}"
        parts.append(f"{part}, amplitude {size}")
    return "ripple while the block sticks: " + "; ".join(parts)
