"""Units at the border: text with a unit in, SI floats inside. Nothing below this module sees a unit."""

from __future__ import annotations

import math
import re
from functools import cache
from numbers import Real
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .cache import folder_for

if TYPE_CHECKING:
    import pint


@cache
def unit_registry() -> pint.UnitRegistry:
    """The one pint registry of the program (building it takes half a second, so only when needed).

    What pint keeps of it names files of its installation. So each installation has a folder of its own; pint's common
    one would stop working for all others once one of them is removed.
    """
    import hashlib

    import pint

    place = hashlib.sha256(f"{pint.__file__} {pint.__version__}".encode()).hexdigest()[:16]
    folder = folder_for(f"units/{place}")
    try:
        return pint.UnitRegistry(autoconvert_offset_to_baseunit=True, cache_folder=folder)
    except Exception:  # whatever a damaged cache makes pint raise
        return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


_SIMPLE = re.compile(r"([+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?) ?([^\d\s].*)")
_FIRST = re.compile(r"[a-zA-Z]+(?=[ /]|$)")  # a unit whose first factor stands in the first power
_READ = {"": 1.0, "p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}  # by power of ten, as they are shown


def _simple(text: str, unit: str) -> float | None:
    """A number with the very unit that is asked for, or that with a prefix; None for all that is left to pint.

    Importing pint takes longer than all else that loading a file does.
    """
    found = _SIMPLE.fullmatch(text)
    if found is None:
        return None
    number, written = float(found[1]), found[2]
    if written == unit:
        return number
    if unit == "kg":
        return number * 1e-3 if written == "g" else None
    prefix = written.removesuffix(unit)
    if prefix == written or unit.startswith("kg") or not _FIRST.match(unit) or prefix not in _READ:
        return None
    return number * _READ[prefix]


def to_si(value: Real | float | str, unit: str, *, key: str | None = None, file: object = None) -> float:
    """Read a quantity as an SI float.

    Args:
        value: a number of Python or NumPy (taken as SI) or text such as ``"0.05 mm/s"``.
        unit: the SI unit it must be compatible with (``"m/s"``, ``"1"`` for a pure number).
        key, file: where it stands, for the message.

    Raises:
        InputError: text without a unit, an unknown unit, a wrong dimension, or not a finite number.
    """
    where = {"key": key, "file": str(file) if file else None}
    if isinstance(value, bool) or not isinstance(value, (Real, str)):
        raise InputError("not a quantity", value=value, allowed=_allowed(unit), **where)
    if isinstance(value, str):
        number = _parse(value, unit, where)
    else:
        number = float(value)
    if not math.isfinite(number):
        raise InputError("not a finite number", value=value, allowed=f"finite: {_allowed(unit)}", **where)
    return number


def factor_to_si(text: str, unit: str, *, key: str | None = None, file: object = None) -> float:
    """The factor that turns a column written in the unit ``text`` (``"um"``, ``"0.3012 N"``) into SI ``unit``."""
    where = {"key": key, "file": str(file) if file else None}
    number = _parse(text if any(c.isdigit() for c in text.split("/")[0].split("*")[0]) else f"1 {text}", unit, where)
    if not math.isfinite(number) or number == 0:
        raise InputError("a unit must be a finite factor other than zero", value=text, **where)
    return number


def takes_prefix(unit: str) -> bool:
    """Whether a prefix may stand before a unit: not before a number, nor where it would belong to one factor only."""
    return unit[:1] not in ("", "1") and " " not in unit.split("/")[0]


def power_for(value: float, digits: int = 4, most: int = 9) -> int:
    """The power of ten, a multiple of three, by which a value other than zero is shown between 1 and 1000."""
    return max(-12, min(most, 3 * math.floor(math.log10(abs(value) * (1 + 10.0**-digits)) / 3)))


def shown(value: float, unit: str, digits: int = 4) -> str:
    """A quantity in SI as people write it: ``4.3e-05, "m"`` as ``43 µm``, ``0.0894, "kg"`` as ``89.4 g``."""
    if value == 0 or not math.isfinite(value) or not takes_prefix(unit):
        return f"{_digits(value, digits)} {unit if unit != '1' else ''}".strip()
    if unit == "kg":
        value, unit = 1e3 * value, "g"
    power = power_for(value, digits)
    return f"{_digits(value / 10.0**power, digits)} {PREFIXES[power]}{unit}"


def ends(values: Any, unit: str) -> str:
    """The least and the largest of an array in SI, as people write them; what is rounding beside the other is zero."""
    low, high = float(values.min()), float(values.max())
    rounding = 1e-12 * max(abs(low), abs(high))
    return " to ".join(shown(end if abs(end) > rounding else 0.0, unit) for end in (low, high))


def shown_with(value: float, std: float, unit: str = "1") -> str:
    """A quantity with its standard deviation, in one unit and to the same place: ``1.72 ± 0.10 µm``."""
    if not (math.isfinite(value) and math.isfinite(std) and std > 0.0):
        return shown(value, unit, 3)
    power = 0
    if unit == "kg":
        value, std, unit = 1e3 * value, 1e3 * std, "g"
    largest = max(abs(value), std)
    if takes_prefix(unit):
        power = power_for(largest, 3)
    value, std = value / 10.0**power, std / 10.0**power
    places = 1 - math.floor(math.log10(float(f"{std:.1e}")))  # two digits of the deviation
    if places > 6 or places < -3:
        return f"({_digits(value, 3)} ± {_digits(std, 2)}) {PREFIXES[power]}{unit if unit != '1' else ''}".strip()
    numbers = (f"{round(number, places):.{max(places, 0)}f}" for number in (value, std))
    return f"{' ± '.join(numbers)} {PREFIXES[power]}{unit if unit != '1' else ''}".strip()


def _digits(value: float, digits: int) -> str:
    """So many significant digits, without a power of ten for numbers below a hundred thousand."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e5 else text


_RUN_ON = re.compile(r",|\.\d*\.|[\d.]\s+(?!1\s*/)[\d.]|\d\s*'\s*\d")
_POWER = re.compile(r"\*\*|\^|[⁰¹²³⁴⁵⁶⁷⁸⁹]+|\b(?:squared|cubed|square|cubic|sq)\b")
_EXPONENT = re.compile(r"\s*(?:[-+]?\d{1,2}(?:\.\d+)?|\([-+]?\d{1,2}(?:[./]\d+)?\))(?![\d.eE(])")


def _unbounded(text: str) -> bool:
    """Whether the powers in a text could make a number of unbounded length: pint computes ``9**9**9`` to its end."""
    of_numbers = 0
    for power in _POWER.finditer(text):
        if power[0] in ("**", "^") and not _EXPONENT.match(text, power.end()):
            return True
        of_numbers += bool(re.search(r"[\d)]\s*$", text[: power.start()])) or len(power[0]) > 2
    return of_numbers > 1


def _allowed(unit: str) -> str:
    return "a number without a unit" if unit in ("1", "") else f"a number in {unit}, or text such as '1 {unit}'"


def _parse(text: str, unit: str, where: dict) -> float:
    simple = _simple(text, unit)
    if simple is not None:
        return simple
    import pint

    registry: Any = unit_registry()
    example = _allowed(unit)
    if len(text) > 100:
        raise InputError("not a quantity", value=text[:40] + "...", allowed=example, **where)
    if _unbounded(text):
        raise InputError("cannot read the quantity: powers of powers", value=text, allowed=example, **where)
    if _RUN_ON.search(text):  # pint would take a comma or a blank between digits for a product, or leave it out
        raise InputError(
            "cannot read the quantity: a decimal comma, two points or a blank in a number",
            value=text, allowed=example, hint="write numbers with one point: 0.05 mm/s, 1.5e3 N/m", **where,
        )  # fmt: skip
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
        what = f"the unit '{quantity.units:~}' is not one of {unit}"
        if unit in ("1", ""):
            what = f"a pure number has no unit '{quantity.units:~}'"
        raise InputError(what, value=text, allowed=example, **where) from None
    except (TypeError, ValueError, OverflowError):
        raise InputError("not a quantity", value=text, allowed=example, **where) from None
