"""The fields of a trace from arrays, without a file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..system.units import factor_to_si, to_si
from .channels import SIGNALS
from .drive import Drive
from .provenance import Provenance
from .resolution import estimate_resolution, noise_level

Array = NDArray[np.float64]


def trace_fields(
    name: str, time: Any, given: Mapping[str, Any], drive_velocity: float | str | None, drive_position: Any,
    drive: Sequence[tuple[float | str, float | str]] | None, resolution: float | str | None,
    noise: float | str | None, spring_stiffness: float | str | None,
) -> dict[str, Any]:  # fmt: skip
    """Fields of a trace from arrays: ``given`` are the signals by name, the rest as of ``Trace.from_arrays``."""
    arrays: dict[str, Any] = {
        key: _si_array(v, SIGNALS[key], f"{name}: {key}") for key, v in given.items() if v is not None
    }
    t = _si_array(_times(given) if time is None else time, "s", f"{name}: time")
    if sum(way is not None for way in (drive_velocity, drive_position, drive)) > 1:
        hint = "keep one of drive_velocity, drive_position, drive"
        raise InputError(f"trace '{name}': the drive is given more than once", hint=hint)
    if not arrays:
        raise InputError(f"trace '{name}' has no signal", allowed="displacement, velocity or spring_force")
    leading = next(key for key in SIGNALS if key in arrays)

    def known(value: float | str | None, unit: str, key: str) -> float | None:
        return None if value is None else to_si(value, unit, key=f"{name}: {key}")

    count = known(resolution, SIGNALS[leading], "resolution")
    count = estimate_resolution(arrays[leading]) if count is None else count
    level = known(noise, SIGNALS[leading], "noise")
    level = noise_level(arrays[leading], count) if level is None else level
    speed = known(drive_velocity, "m/s", "drive_velocity")
    motion = None if speed is None else Drive.constant(speed, float(t[0]), float(t[-1]))
    if drive is not None:
        until = [to_si(end, "s", key=f"{name}: drive") for end, _ in drive]
        motion = Drive.from_pieces(until, [to_si(v, "m/s", key=f"{name}: drive") for _, v in drive], float(t[0]))
    if drive_position is not None:
        arrays["drive_position"] = position = _si_array(drive_position, "m", f"{name}: drive_position")
        motion = Drive.sampled(t, position)
    digest = hashlib.sha256(t.tobytes())
    for key, values in arrays.items():
        digest.update(key.encode() + values.tobytes())
    return {
        "time": t, **arrays, "drive": motion, "resolution": count, "noise": level,
        "spring_stiffness": known(spring_stiffness, "N/m", "spring_stiffness"),
        "provenance": Provenance("", digest.hexdigest(), "arrays"),
    }  # fmt: skip


def _times(signals: Mapping[str, Any]) -> Any:
    """Times that the first of the signals carries: of dates the seconds since the first one."""
    first: Any = next((values for values in signals.values() if values is not None), None)
    found: Any = None
    if hasattr(first, "coords"):
        found = next((first.coords[dim] for dim in first.dims if dim in first.coords), None)
    elif hasattr(first, "index") and hasattr(first, "iloc") and type(first.index).__name__ != "RangeIndex":
        found = first.index
    if found is None:
        hint = "give time, a Series with times as its index, or a DataArray with a coordinate of times"
        raise InputError("no times are given", key="time", hint=hint)
    if found.dtype.kind in "mM":
        moments = np.asarray(found)
        found = (moments - moments[0]) / np.timedelta64(1, "s")
    return found


def _si_array(values: Any, unit: str, what: str) -> Array:
    """Values as an array of its own in the SI ``unit``; text in ``attrs["units"]`` says another unit of theirs."""
    written = getattr(values, "attrs", {}).get("units")
    factor = 1.0 if written is None else factor_to_si(str(written), unit, key=what)
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} holds no numbers ({error})") from None
    return array * factor
