"""Is the run possible at all? Finds units wrong by a thousand before anything is fitted to them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...system.units import factor_to_si, shown
from ..trace import Trace
from .models import Rig

_OUTRUN = 30.0
_ODD = 2.0  # from which a warning is due
_KNOWN = {
    "displacement": ("m", ["m", "cm", "mm", "um", "nm", "pm"]),
    "velocity": ("m/s", ["m/s", "cm/s", "mm/s", "um/s", "nm/s"]),
    "spring_force": ("N", ["kN", "N", "mN", "uN", "nN"]),
}


def check_size(time: NDArray[np.float64], data: Mapping[str, NDArray[np.float64]]) -> None:
    """Refuse what no instrument measures, such as the 9.9e37 by which some mark an overload.

    Raises:
        InputError: a time beyond 1e12 s, samples closer than 1e-12 s, or a value of a channel (SI) beyond 1e30.
    """
    for name, values, most in (("time", time, 1e12), *((name, values, 1e30) for name, values in data.items())):
        low, high = float(np.min(values)), float(np.max(values))
        if max(-low, high) > most:
            worst = low if -low > high else high
            row = int(np.argmin(values) if -low > high else np.argmax(values)) + 1
            what = f"{name} holds an impossible value: {worst:.3g} in SI units"
            hint = "a mark of an overload? Delete these rows, leave the field empty, or check the unit"
            raise InputError(what, key=f"sample {row}", hint=hint)
    if time[-1] - time[0] < 1e-12 * time.size:
        hint = "check the unit of time, or the sampling rate"
        raise InputError(f"{time.size} samples lie within {time[-1] - time[0]:.3g} s, closer than 1e-12 s", hint=hint)


def doubtful_resolution(channel: str, si: str, stated: float, seen: float | None, noise: float) -> str | None:
    """What is odd about a resolution that the campaign states.

    Args:
        channel: name of the channel.
        si: its SI unit.
        stated: the resolution in the campaign, SI.
        seen: the step found in the values, or None where they lie on no grid.
        noise: standard deviation of one sample, as its scatter has it, SI.
    """
    if seen is not None and not 1 / _ODD < stated / seen < _ODD:
        found = f"the values step by {shown(seen, si, 3)}"
    elif seen is None and noise < stated / _OUTRUN:
        found = f"the values scatter by {shown(noise, si, 2)} only"
    else:
        return None
    said = f"{channel}: the campaign states a resolution of {shown(stated, si, 3)}"
    return f"{said}, but {found}; the campaign was followed"


def check_travel(trace: Trace, rig: Rig, unit: str | None, key: str) -> list[str]:
    """Warnings about a trace whose block and drive do not go together.

    A spring pulls the block: over a run the block cannot travel much further than the load point (a run cut short
    around one slip may, by what the spring held), and the spring's force cannot change by more than stiffness times
    travel.

    Raises:
        InputError: the block outruns the drive by more than a factor 30, or stays behind it by more than 30 times what
            the spring can be stretched before the block slips.
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
    moves = f"moves {shown(moved, 'm', 3)} while the load point moves {shown(travel, 'm', 3)}"
    outruns = moved / (travel + 2 * reach) if reach is not None else 3 * moved / (5 * travel)
    if outruns > _OUTRUN:
        what = f"the block outruns the drive: it {moves}"
        raise InputError(what, key=key, value=unit, hint=_likely(trace.leading, unit, moved / travel))
    most = _reach(trace, rig, upper=True)
    if trace.leading != "spring_force" and most is not None and travel - moved > _OUTRUN * most:
        held = f"the spring can pull no further than {shown(most, 'm', 3)} before the block slips"
        hint = _likely(trace.leading, unit, moved / travel) if moved > 0 else "is it the right column?"
        raise InputError(f"the block stays behind the drive: it {moves}, and {held}", key=key, value=unit, hint=hint)
    behind = trace.leading != "spring_force" and most is not None and travel - moved > _ODD * most
    if outruns > _ODD or behind:
        why = "is the velocity of the drive that of another run, or a unit wrong?"
        return [f"the block {moves}, which no spring allows: {why}"]
    if trace.leading == "displacement" and moved < travel / _OUTRUN and (reach is None or travel > 10 * reach):
        why = "a wrong unit, a counter that wraps or is cleared ('wrap', 'resets'), or a block that is not pulled?"
        return [f"the block {moves}: {why}"]
    return []


def _pulls_backwards(trace: Trace, blocks: int = 2000) -> bool:
    """Whether force and load point mostly move in opposite ways while the load point moves.

    In most of the time, and not only in the largest steps: with much noise those are the slips alone.
    """
    if trace.leading != "spring_force" or trace.spring_force is None or trace.drive is None:
        return False
    stride = max(1, trace.time.size // blocks)
    rises = np.diff(trace.spring_force[::stride])
    runs = np.diff(trace.drive.position(trace.time[::stride]))
    moving = np.abs(runs) > 0.2 * np.quantile(np.abs(runs), 0.9)
    opposite = rises * runs < 0
    strong = moving & (np.abs(rises) > 6 * (trace.noise or 0.0))
    return bool(strong.sum() > 20 and np.mean(opposite[strong]) > 0.7 and np.mean(opposite[moving]) > 0.5)


def _reach(trace: Trace, rig: Rig, *, upper: bool = False) -> float | None:
    """How far the spring can be stretched before the block slips, m; ``upper``: with the bounds of what is guessed."""
    parts: list[object] = [rig.friction_coefficient, rig.normal_force, rig.contacts]
    if upper:
        parts = [getattr(part, "upper", part) for part in parts]
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
    si, names = _KNOWN[signal]
    if not 1e-30 < ratio < 1e30:
        return f"check the unit of {signal} and of the drive"
    power = 3 * round(math.log10(ratio) / 3) or (3 if ratio > 1 else -3)
    hint = f"a unit is probably wrong by 10^{power}"
    if unit is not None:
        factor = factor_to_si(unit, si)
        for name in names:
            if math.isclose(factor_to_si(name, si) * 10**power, abs(factor), rel_tol=1e-6):
                return f"{hint}: '{name}' in place of '{unit}', or the drive's velocity is to be multiplied by as much"
    return f"{hint}: check the unit of {signal} and of the drive"
