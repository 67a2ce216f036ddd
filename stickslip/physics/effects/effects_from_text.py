"""Effects from words such as ``machine-compliance:where=series:compliance=1e-8``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...errors import InputError
from ..params import variants
from . import catalogue
from .base import Effect

STATIC, INERTIA = "static", "inertia"
EXAMPLE = "--model static,inertia,contact-ageing"
_OPTION = "--model"


def effects_of(words: Sequence[str]) -> tuple[list[Effect], bool]:
    """The effects of a model, and whether it has inertia.

    Args:
        words: ``"static"`` and tags, each with ``:name=value`` for every form or parameter that is not the default;
            values in SI, or with their unit. The first bare ``"inertia"`` is that of the block, which every model of
            slips has; a second one, or one with a value, is the effect: mass that moves with it.

    Raises:
        InputError: nothing named, an unknown name (names the nearest), one named twice, a wrong value, or effects
            without inertia.
    """
    split = [[part.strip() for part in word.split(":")] for word in words if word.strip()]
    tags = [tag for tag, *_ in split]
    inertial = INERTIA in tags
    if [INERTIA] in split:
        split.remove([INERTIA])
    added = [tag for tag, *_ in split]
    if not tags:
        raise InputError("no model is named", key=_OPTION, hint=EXAMPLE)
    for tag in tags:
        if tag != STATIC and tag not in catalogue.all():
            raise InputError(f"there is no effect '{tag}'", key=_OPTION, hint=catalogue.unknown(tag, [STATIC]))
        if added.count(tag) > 1:
            raise InputError(f"'{tag}' is named twice", key=_OPTION)
    if not inertial and any(tag != STATIC for tag in tags):
        raise InputError(
            "the model without inertia has constant friction and no effects; all other models include inertia",
            key=_OPTION,
            value=",".join(tags),
            hint=f"--model {','.join([STATIC, INERTIA, *(tag for tag in tags if tag != STATIC)])}",
        )
    return [_made(tag, options) for tag, *options in split if tag != STATIC or options], inertial


def _made(tag: str, options: Sequence[str]) -> Effect:
    if tag == STATIC:
        raise InputError("'static' has no forms or parameters to choose", key=_OPTION, value=":".join([tag, *options]))
    cls, values = catalogue.get(tag), {}
    for option in options:
        name, equals, value = (part.strip() for part in option.partition("="))
        if not (name and equals and value):
            raise InputError(
                "not a choice",
                key=_OPTION,
                value=f"{tag}:{option}",
                allowed=f"{tag}:name=value, such as {_example(cls)}",
            )
        if name in values:
            raise InputError(f"'{name}' is given twice", key=_OPTION, value=f"{tag}:{option}")
        values[name] = value if name in variants(cls) else _number(value)
    return catalogue.make(tag, **values)


def with_form(effect: Effect) -> str:
    """Tag of an effect with the form of its law, ``tag:name=value,name=value``; the tag alone for the usual form."""
    usual = type(effect)()
    own = {name: getattr(effect, name) for name in variants(effect)}
    form = ",".join(f"{name}={value}" for name, value in own.items() if value != getattr(usual, name))
    return f"{effect.tag}:{form}" if form else effect.tag


def _number(text: str) -> Any:
    """A number in SI as such; a quantity with its unit as text."""
    try:
        return float(text)
    except ValueError:
        return text


def _example(cls: type[Effect]) -> str:
    forms = variants(cls)
    return next((f"{name}={choices[-1]}" for name, choices in forms.items()), f"{cls.amplitude}=0.01")
