"""Over what a variable is folded, so that a phase is shown: a period as it is written, or of an effect in the model."""

from __future__ import annotations

from contextlib import suppress

from ..errors import InputError
from ..objects.fit import Fit
from ..physics.effects import catalogue
from ..system.units import to_si

PHASE = "phase of the drive"
WAYS = ("time", "place", "slip path", "load point")  # along which something may come back
FREQUENCY = "frequency"  # the parameter of an effect that is the inverse of its period
_OVER = {"time": "time", "load point": "load point", "displacement": "place"}  # what effects name -> what is drawn
_WRITTEN = (("m", "load point", 1.0), ("s", "time", 1.0), ("Hz", "time", -1.0))  # unit, what it folds, power


def period(text: str, unit: str) -> float:
    """A period as it is written (SI).

    Raises:
        InputError: it cannot be read in that unit, or is not larger than zero.
    """
    found = to_si(text, unit, key="period")
    if not found > 0.0:
        raise InputError("out of range", key="period", value=text, allowed="more than zero")
    return found


def drive(text: str, fit: Fit) -> tuple[str, float]:
    """What the phase of the drive is taken of, and its period (SI).

    Args:
        text: a length of the load point's way, a time or a frequency; "" for that of an effect in the model.
        fit: the model.

    Raises:
        InputError: the text is none of them, or is empty and no effect in the model is periodic.
    """
    if not text:
        return _of_model(fit)
    for unit, over, power in _WRITTEN:
        with suppress(InputError):
            return over, period(text, unit) ** power
    raise InputError("cannot be read", key="period", value=text, allowed="such as 100 um, 20 ms or 50 Hz")


def _of_model(fit: Fit) -> tuple[str, float]:
    for effect in fit.force_fit.problem.composition.effects:
        periodic = catalogue.get(effect.tag).periodic if effect.tag in catalogue.tags() else None
        if periodic is not None and f"{effect.tag}.{periodic[0]}" in fit.values:
            value = fit.values[f"{effect.tag}.{periodic[0]}"]
            return _OVER[periodic[1]], 1.0 / value if periodic[0] == FREQUENCY else value
    raise InputError(
        "no effect in the model is periodic", key="period", hint="write a period or a frequency: 100 um, 20 ms or 50 Hz"
    )
