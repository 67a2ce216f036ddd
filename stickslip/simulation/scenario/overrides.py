"""Changes to a scenario from the command line: ``contact.H=0.5``, and series ``drive.velocity=20um/s:1mm/s:8``."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from copy import deepcopy
from numbers import Real
from typing import Any

from ...errors import InputError


def parse_assignment(text: str) -> tuple[str, Any]:
    """``"contact.H=0.5"`` as key and value; the value is read as TOML where it is that, else as text.

    Raises:
        InputError: no equals sign, no key, no value.
    """
    key, equals, value = text.partition("=")
    key, value = key.strip(), value.strip()
    if not equals or not key or not value or not all(key.split(".")):
        allowed = "table.key=value, such as contact.H=0.5"
        raise InputError("not an assignment", file="--set", value=text, allowed=allowed)
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


def with_overrides(content: dict[str, Any], changes: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """A copy of a file's content with keys such as ``contact.H`` or ``effect.contact-ageing.beta`` set.

    A table that is not there is made; an entry of a list is named by its number from 1 or, among effects, by its type.

    Raises:
        InputError: the way to a key leads through something that is not a table, or past the end of a list.
    """
    content = deepcopy(content)
    for key, value in changes:
        parts = key.split(".")
        place: Any = content
        for part in parts[:-1]:
            place = _step(place, part, key)
        if isinstance(place, list):
            raise InputError("the key names a list", file="--set", key=key, hint="name one entry: effect.1.key")
        place[parts[-1]] = value
    return content


def _step(place: Any, part: str, key: str) -> Any:
    if isinstance(place, dict):
        inner = place.setdefault(part, [] if part == "effect" else {})
    else:
        inner = _entry(place, part, key)
    if not isinstance(inner, (dict, list)):
        raise InputError(f"'{part}' is not a table", file="--set", key=key)
    return inner


def _entry(entries: list[Any], part: str, key: str) -> Any:
    if part.isdigit():
        if not 1 <= int(part) <= len(entries):
            allowed = f"1 to {len(entries)}"
            raise InputError("there is no such entry", file="--set", key=key, value=part, allowed=allowed)
        return entries[int(part) - 1]
    for entry in entries:
        if isinstance(entry, dict) and entry.get("type") == part:
            return entry
    if key.startswith("effect."):
        entries.append({"type": part})
        return entries[-1]
    raise InputError("the entry of a list is named by its number", file="--set", key=key, value=part)


def parse_sweep(text: str) -> dict[str, Any]:
    """``"drive.velocity=20um/s:1mm/s:8"`` or ``"...=20um/s,50um/s"`` as the content of a ``[sweep]`` table.

    Raises:
        InputError: not of either form.
    """
    key, equals, value = text.partition("=")
    allowed = "table.key=start:stop:points or table.key=value,value,..."
    parts = [part.strip() for part in value.split(":")]
    if not equals or not key.strip() or not value.strip():
        raise InputError("not a series", file="--sweep", value=text, allowed=allowed)
    if len(parts) == 1:
        return {"key": key.strip(), "values": [part.strip() for part in value.split(",") if part.strip()]}
    if len(parts) != 3 or not parts[2].isdigit():
        raise InputError("not a series", file="--sweep", value=text, allowed=allowed)
    return {"key": key.strip(), "start": parts[0], "stop": parts[1], "points": int(parts[2])}


def series(start: float, stop: float, points: int) -> list[float]:
    """Evenly spaced values; on a logarithmic scale where both ends are above zero."""
    share = [i / (points - 1) for i in range(points)]
    if start > 0 and stop > 0:
        return [math.exp(math.log(start) * (1 - s) + math.log(stop) * s) for s in share]
    return [start * (1 - s) + stop * s for s in share]


def si_value(value: Real | float | str, key: str) -> float:
    """A value of a series in SI base units, whatever its dimension; the schema checks that afterwards.

    Raises:
        InputError: not a quantity.
    """
    if isinstance(value, Real):
        return float(value)
    from ...system.units import unit_registry

    try:
        found: Any = unit_registry().Quantity(value)
        return float(found.to_base_units().magnitude)
    except Exception:  # pint's parser raises whatever its tokenizer raises on garbage
        raise InputError("cannot read the quantity", file="--sweep", key=key, value=value) from None


def sweep_values(key: str, start: Any, stop: Any, points: int | None, values: Sequence[Any] | None) -> list[float]:
    """The values of a series in SI."""
    if values is not None:
        return [si_value(value, key) for value in values]
    ends = si_value(start, key), si_value(stop, key)
    if isinstance(start, str) and isinstance(stop, str) and (is_bare(start) != is_bare(stop)):
        raise InputError("one end of the series has a unit and the other has none", file="--sweep", key=key)
    return series(*ends, points or 2)


def is_bare(text: str) -> bool:
    """Whether a text is a number without a unit."""
    try:
        float(text)
    except ValueError:
        return False
    return True
