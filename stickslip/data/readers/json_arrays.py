"""JSON: arrays of numbers under names, rows of a table, or a list of records."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from .base import Columns, add_array, need_columns

_DEPTH = 8


class JsonReader:
    """Arrays of JSON; ``null`` is a value that is not a number."""

    name = "json"
    suffixes: tuple[str, ...] = (".json",)
    description = "JSON arrays"

    def sniff(self, path: Path, head: bytes) -> bool:
        return path.suffix.lower() == ".json" and head.lstrip()[:1] in (b"{", b"[")

    def read(self, path: Path) -> Columns:
        try:
            content = json.loads(path.read_bytes())
        except (ValueError, RecursionError) as error:
            raise InputError(f"not a readable JSON file ({error})", file=path, hint="export it again") from None
        columns = Columns({})
        _add(columns, "", content)
        return need_columns(columns, path)


def _add(columns: Columns, name: str, value: Any, depth: int = 0) -> None:
    if isinstance(value, dict) and depth < _DEPTH:
        for part, item in value.items():
            _add(columns, f"{name}.{part}" if name else part, item, depth + 1)
    elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
        for part in dict.fromkeys(key for item in value for key in item):
            _add(columns, f"{name}.{part}" if name else part, [item.get(part) for item in value], depth + 1)
    elif isinstance(value, list):
        try:
            array = np.array(value, np.float64)  # None becomes NaN
        except (TypeError, ValueError):
            columns.ignored[name or "the list"] = "it holds text, or rows of several lengths"
            return
        add_array(columns, name or ("" if array.ndim == 2 else "column 1"), array)
