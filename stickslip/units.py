"""Units at the border: text with a unit in, SI floats inside. Nothing below this module sees a unit."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Any

from .errors import InputError

if TYPE_CHECKING:
    import pint


@cache
def unit_registry() -> pint.UnitRegistry:
    """The one pint registry of the program (building it takes half a second, so only when needed)."""
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True, cache_folder=":auto:")


def to_si(value: float | int | str, unit: str, *, key: str | None = None, file: object = None) -> float:
    """Read a quantity as an SI float.

    Args:
        value: a number (taken as SI) or text such as ``"0.05 mm/s"``.
        unit: the SI unit it must be compatible with (``"m/s"``, ``"1"`` for a pure number).
        key, file: where it stands, for the message.

    Raises:
        InputError: text without a unit, an unknown unit, a wrong dimension, or not a finite number.
    """
    where = {"key": key, "file": str(file) if file else None}
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        allowed = f"a number in {unit} or text such as '1 {unit}'"
        raise InputError("not a quantity", value=value, allowed=allowed, **where)
    if isinstance(value, str):
        number = _parse(value, unit, where)
    else:
        number = float(value)
    if not math.isfinite(number):
        raise InputError("not a finite number", value=value, **where)
    return number


def factor_to_si(text: str, unit: str, *, key: str | None = None, file: object = None) -> float:
    """The factor that turns a column written in the unit ``text`` (``"um"``, ``"0.3012 N"``) into SI ``unit``."""
    where = {"key": key, "file": str(file) if file else None}
    number = _parse(text if any(c.isdigit() for c in text.split("/")[0].split("*")[0]) else f"1 {text}", unit, where)
    if not math.isfinite(number) or number == 0:
        raise InputError("a unit must be a finite factor other than zero", value=text, **where)
    return number


def _parse(text: str, unit: str, where: dict) -> float:
    import pint

    registry: Any = unit_registry()
    example = f"a number in {unit}, or text such as '1 {unit}'"
    if len(text) > 100:
        raise InputError("not a quantity", value=text[:40] + "...", allowed=example, **where)
    try:
        quantity = registry.Quantity(text)
    except (pint.UndefinedUnitError, pint.DefinitionSyntaxError) as error:
        raise InputError(f"cannot read the quantity: {error}", value=text, allowed=example, **where) from None
    except Exception as error:  # pint's parser raises whatever its tokenizer raises on garbage
        what = f"cannot read the quantity ({type(error).__name__})"
        raise InputError(what, value=text, allowed=example, **where) from None
    if quantity.unitless and unit not in ("1", ""):
        raise InputError("the unit is missing", value=text, allowed=example, hint=f"write '{text} {unit}'", **where)
    try:
        return float(quantity.to(unit if unit not in ("1", "") else "dimensionless").magnitude)
    except pint.DimensionalityError:
        raise InputError(
            f"the unit '{quantity.units:~}' is not one of {unit}", value=text, allowed=example, **where
        ) from None
    except (TypeError, ValueError):
        raise InputError("not a quantity", value=text, allowed=example, **where) from None
