"""Effects of a scenario: catalogue classes with the parameters as written."""

from __future__ import annotations

from ...errors import InputError
from ...physics.effects.base import Effect
from ...physics.effects.catalogue import make
from .schema import ScenarioFile


def make_effects(file: ScenarioFile) -> tuple[Effect, ...]:
    """The effects of ``[[effect]]``, in order.

    Raises:
        InputError: unknown type or parameter (names the nearest), a wrong unit, a value outside its range.
    """
    made = []
    for number, entry in enumerate(file.effect, start=1):
        place = f"effect.{number}"
        try:
            made.append(make(entry.type, **entry.parameters))
        except InputError as error:
            name = (error.key or "").partition(".")[2]
            raise error.but(key=f"{place}.{name or 'type'}") from None
        except TypeError as error:  # a parameter that is a table or a list
            raise InputError(f"not a parameter of effect '{entry.type}' ({error})", key=place) from None
    return tuple(made)
