"""Field types of campaign files: quantities with units, and quantities nobody measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from ...errors import InputError, nearest
from ...system.units import to_si


@dataclass(frozen=True)
class Unmeasured:
    """A quantity known only by a guess and bounds, SI; it is fitted."""

    guess: float
    lower: float
    upper: float


@contextmanager
def faults() -> Iterator[None]:
    """For a validator: its `InputError` as pydantic wants it, so that the loader can put the place to it."""
    try:
        yield
    except InputError as error:
        raise PydanticCustomError("input", "{text}", {"text": error.what, "error": error}) from None


def quantity(
    unit: str,
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    below: float | None = None,
    unmeasured: bool = False,
) -> BeforeValidator:
    """For `Annotated`: reads a number in SI or text with a unit, within bounds.

    With ``unmeasured`` a table of guess and bounds is read too.
    """

    @faults()
    def read(value: Any) -> float | Unmeasured:
        return _unmeasured(value, single) if unmeasured and isinstance(value, dict) else single(value)

    def single(value: Any) -> float:
        number = to_si(value, unit)
        inside = (
            (above is None or number > above)
            and (least is None or number >= least)
            and (most is None or number <= most)
            and (below is None or number < below)
        )
        if not inside:
            bare = unit != "1" and not isinstance(value, str)
            hint = f"a number alone is in {unit}; write the unit with it if it is another" if bare else None
            raise InputError("out of range", value=value, allowed=_range(unit, above, least, most, below), hint=hint)
        return number

    return BeforeValidator(read)


def _range(unit: str, above: float | None, least: float | None, most: float | None, below: float | None) -> str:
    shown = "" if unit == "1" else f" {unit}"
    bounds = {"above": above, "at least": least, "at most": most, "below": below}
    return ", ".join(f"{word} {bound:g}{shown}" for word, bound in bounds.items() if bound is not None)


def _unmeasured(value: dict[str, Any], single: Callable[[Any], float]) -> Unmeasured:
    names = ("guess", "lower", "upper")
    for key in value:
        if key not in names:
            raise InputError(f"unknown key '{key}' of an unmeasured quantity", hint=nearest(str(key), names))
    absent = [name for name in names if name not in value]
    if absent:
        allowed = '{ guess = "...", lower = "...", upper = "..." }'
        raise InputError(f"an unmeasured quantity lacks '{absent[0]}'", allowed=allowed)
    guess, lower, upper = (single(value[name]) for name in names)
    if not lower < upper or not lower <= guess <= upper:
        what = "the guess of an unmeasured quantity must lie between its bounds"
        written = f"guess {guess:g}, lower {lower:g}, upper {upper:g}"
        raise InputError(what, value=written, allowed="lower <= guess <= upper, lower < upper")
    return Unmeasured(guess, lower, upper)
