"""From a pydantic error to one message with file, line, key and how to fix it."""

from __future__ import annotations

import re
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ...errors import InputError, nearest

_KEY = re.compile(r"""^\s*((?:"[^"]*"|'[^']*'|[\w-]+)(?:\s*\.\s*(?:"[^"]*"|'[^']*'|[\w-]+))*)\s*=""")
_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?$")
Place = tuple[str | int, ...]


def key_lines(text: str) -> dict[Place, int]:
    """Line (from 1) of every table header and key of a TOML text, by place such as ``("trace", 0, "file")``."""
    lines: dict[Place, int] = {}
    table: Place = ()
    counts: dict[Place, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if head := _TABLE.match(line):
            parts: Place = ()
            names = [part.strip().strip("\"'") for part in head[2].split(".")]
            for i, name in enumerate(names):
                parts = (*parts, name)
                if head[1] == "[[" and i == len(names) - 1:
                    counts[parts] = counts.get(parts, -1) + 1
                if parts in counts:
                    parts = (*parts, counts[parts])
            table = parts
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            lines.setdefault((*table, *(part.strip().strip("\"'") for part in key[1].split("."))), number)
    return lines


def readable(error: ValidationError, model: type[BaseModel], text: str, file: Path | None) -> InputError:
    """The first fault of a validation as an `InputError`; the number of further ones is said."""
    faults = error.errors()
    # an unknown key explains a missing one, so it comes first
    faults.sort(key=lambda fault: fault["type"] != "extra_forbidden")
    fault = faults[0]
    place = tuple(part for part in fault["loc"] if not _is_tag(part))
    shown = shown_place(place)
    lines = key_lines(text)
    line = next((lines[place[:n]] for n in range(len(place), 0, -1) if place[:n] in lines), None)
    key = f"line {line}: {shown}" if line and shown else shown or (f"line {line}" if line else None)
    own = (fault.get("ctx") or {}).get("error")
    value: object = None
    allowed: str | None = None
    hint: str | None = None
    if isinstance(own, InputError):
        what, value, allowed, hint = own.what, own.value, own.allowed, own.hint
    elif fault["type"] == "extra_forbidden":
        what = f"unknown key '{place[-1]}'"
        hint = nearest(str(place[-1]), _keys(model, place[:-1]))
    elif fault["type"] == "missing":
        what, hint = f"the key '{place[-1]}' is missing", "add it"
        if place == ("schema",):
            hint = "write  schema = 1  as the first line"
        elif place == ("trace",):
            hint = "add a [[trace]] table for every run"
    else:
        what, value = fault["msg"][0].lower() + fault["msg"][1:], fault.get("input")
        value = value if isinstance(value, (str, int, float, bool)) else None
    more = len(faults) - 1
    if more:
        hint = f"{hint}; " if hint else ""
        hint += f"{more} more fault{'s' if more > 1 else ''} after this one"
    return InputError(what, file=file, key=key, value=value, allowed=allowed, hint=hint)


def _is_tag(part: str | int) -> bool:
    """Names pydantic puts into a place for the member of a union it tried."""
    return isinstance(part, str) and ("[" in part or part in {"float", "int", "str", "bool"})


def shown_place(place: Sequence[str | int]) -> str:
    """A place as messages show it: ``("effect", 0, "beta")`` as ``effect[1].beta``."""
    text = ""
    for part in place:
        text += f"[{part + 1}]" if isinstance(part, int) else (f".{part}" if text else part)
    return text


def _keys(model: Any, place: Sequence[str | int]) -> list[str]:
    """Valid keys of the table at a place."""
    for part in place:
        if isinstance(part, int):
            continue
        fields = model.model_fields
        field = fields.get(part) or next((f for f in fields.values() if f.alias == part), None)
        found = _model_in(field.annotation) if field else None
        if found is None:
            return []
        model = found
    return [field.alias or name for name, field in model.model_fields.items()]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_model_in, typing.get_args(annotation))), None)
