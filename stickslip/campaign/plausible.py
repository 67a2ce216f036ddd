"""Is the run possible at all? Finds units wrong by a thousand before anything is fitted to them."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InputError
from ..trace import Trace
from ..units import factor_to_si
from .models import Rig

_OUTRUN = 30.0
_KNOWN = {
    "displacement": ("m", ["m", "cm", "mm", "um", "nm", "pm"]),
    "velocity": ("m/s", ["m/s", "cm/s", "mm/s", "um/s", "nm/s"]),
    "spring_force": ("N", ["kN", "N", "mN", "uN", "nN"]),
}


def check_travel(trace: Trace, rig: Rig, unit: str | None, key: str) -> list[str]:
    """Warnings about a trace whose block and drive do not go together.

    A spring pulls the block: over a run the block cannot travel much further than the load point (a run cut short
    around one slip may, by what the spring held), and the spring's force cannot change by more than stiffness times
    travel.

    Raises:
        InputError: the block outruns the drive by more than a factor 30.
    """
    drive = trace.drive
    if drive is None:
        return []
    inside = drive.breakpoints[(drive.breakpoints > trace.time[0]) & (drive.breakpoints < trace.time[-1])]
    travel = float(np.ptp(drive.position(np.concatenate([trace.time[[0, -1]], inside]))))
    if _pulls_backwards(trace):
        return [
            "the spring force falls while the load point advances: is its sign opposite? Then write the unit with a "
            'minus, such as  unit = "-1 N"'
        ]
    reach = _reach(trace, rig)
    moved = _moved(trace)
    if moved is None or travel <= 0:
        return [] if travel > 0 else ["the drive does not move during this run"]
    allowance = reach if reach is not None else 2 * travel
    ratio = moved / (travel + 2 * allowance)
    if ratio * (1 if reach is not None else 3) > _OUTRUN:
        raise InputError(
            f"the block outruns the drive: it moves {moved:.3g} m while the load point moves {travel:.3g} m",
            key=key,
            value=unit,
            hint=_likely(trace.leading, unit, moved / travel),
        )
    if trace.leading == "displacement" and moved < travel / _OUTRUN and (reach is None or travel > 10 * reach):
        return [
            f"the block moves {moved:.3g} m while the load point moves {travel:.3g} m: a wrong unit, a counter that "
            "wraps or is cleared ('wrap', 'resets'), or a block that is not pulled?"
        ]
    return []


def _pulls_backwards(trace: Trace, blocks: int = 2000) -> bool:
    """Whether force and load point mostly move in opposite ways while the load point moves."""
    if trace.leading != "spring_force" or trace.spring_force is None or trace.drive is None:
        return False
    stride = max(1, trace.time.size // blocks)
    rises = np.diff(trace.spring_force[::stride])
    runs = np.diff(trace.drive.position(trace.time[::stride]))
    moving = np.abs(runs) > 0.2 * np.quantile(np.abs(runs), 0.9)
    strong = moving & (np.abs(rises) > 6 * (trace.noise or 0.0))
    return bool(strong.sum() > 20 and np.mean(rises[strong] * runs[strong] < 0) > 0.7)


def _reach(trace: Trace, rig: Rig) -> float | None:
    """How far the spring can be stretched before the block slips, m."""
    parts = (rig.friction_coefficient, rig.normal_force, rig.contacts)
    if trace.spring_stiffness is None or not all(isinstance(part, (int, float)) for part in parts):
        return None
    force = 1.0
    for part in parts:
        force *= float(part)  # type: ignore[arg-type]
    return force / trace.spring_stiffness


def _moved(trace: Trace) -> float | None:
    """Travel the leading signal speaks of, m."""
    if trace.displacement is not None:
        return float(np.ptp(trace.displacement))
    if trace.velocity is not None:
        return abs(float(np.trapezoid(trace.velocity, trace.time)))
    if trace.spring_stiffness is None or trace.spring_force is None:
        return None
    return float(np.ptp(trace.spring_force)) / trace.spring_stiffness


def _likely(signal: str, unit: str | None, ratio: float) -> str:
    """Names the unit that would make it right."""
    power = 3 * round(math.log10(ratio) / 3) or 3
    si, names = _KNOWN[signal]
    hint = f"a unit is probably wrong by 10^{power}"
    if unit is not None:
        factor = factor_to_si(unit, si)
        for name in names:
            if math.isclose(factor_to_si(name, si) * 10**power, abs(factor), rel_tol=1e-6):
                return f"{hint}: '{name}' in place of '{unit}', or the drive's velocity is 10^{power} times larger"
    return f"{hint}: check the unit of {signal} and of the drive"
