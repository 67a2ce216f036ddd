"""What every reader gives back, and how a header says its unit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, nearest

HEAD_BYTES = 65536
_UNIT = re.compile(r"^(?P<name>.*?)\s*(?:\[\s*(?P<square>[^\[\]]*?)\s*\]|\(\s*(?P<round>[^()]*?)\s*\))\s*$", re.DOTALL)


@dataclass
class Columns:
    """Named columns of one file, as written there (no units applied).

    Args:
        data: name -> 1-d array; names without the unit.
        units: name -> the unit text the file itself gives.
        ignored: columns left out and why (text, wrong shape).
        notes: what the reader mended or guessed, in words.
        first_line: line of the first row of data in a text file (1 = first), else None.
        order: names of all columns as they stand in the file, those left out among them; default: those of ``data``.
    """

    data: dict[str, NDArray[np.float64]]
    units: dict[str, str] = field(default_factory=dict)
    ignored: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    first_line: int | None = None
    reader: str = ""
    order: list[str] = field(default_factory=list)

    def find(self, wanted: str | int, *, file: str | Path | None = None, key: str | None = None) -> str:
        """The name of a column asked for by name (also with its unit, or in other case) or by number from 1.

        Raises:
            InputError: no such column; names the nearest one.
        """
        names = list(self.data)
        if isinstance(wanted, int) and not isinstance(wanted, bool):
            order = self.order or names
            if not 1 <= wanted <= len(order):
                allowed = f"1 to {len(order)}: {', '.join(order)}"
                raise InputError(f"there is no column {wanted}", file=file, key=key, allowed=allowed)
            if order[wanted - 1] in self.data:
                return order[wanted - 1]
            wanted = order[wanted - 1]
        text = str(wanted).strip()
        bare = split_unit(text)[0]
        folded = [name for name in names if name.casefold() == bare.casefold()]
        for hits in ([n for n in names if n == text], [n for n in names if n == bare], folded):
            if len(hits) == 1:
                return hits[0]
        if wanted in self.ignored:
            raise InputError(f"column '{wanted}' cannot be used: {self.ignored[str(wanted)]}", file=file, key=key)
        listed = ", ".join(names[:20]) + (" ..." if len(names) > 20 else "")
        hint = nearest(text, names) if names else None
        raise InputError(f"there is no column '{wanted}'", file=file, key=key, allowed=listed, hint=hint)


class Reader(Protocol):
    """One family of file formats. Registered in the entry point group ``stickslip.readers`` it is found by name."""

    name: str
    suffixes: tuple[str, ...]
    description: str

    def sniff(self, path: Path, head: bytes) -> bool:
        """Whether the first bytes of a file (and, at most, its ending) are of this format."""

    def read(self, path: Path) -> Columns:
        """All numeric columns of a file; `InputError` where it cannot be read."""


PARTS = (*Reader.__annotations__, "sniff", "read")  # what every reader has


@contextmanager
def reading(kind: str, path: Path, hint: str | None = None) -> Iterator[None]:
    """Libraries raise many kinds of exceptions on a damaged file: all become one `InputError`."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        what = f"not a readable {kind} file ({type(error).__name__}: {error})"
        raise InputError(what, file=path, hint=hint) from None


def plain_unit(text: str) -> str:
    """A unit in letters that are on every keyboard."""
    return text.replace("µ", "u").replace("μ", "u")


def split_unit(header: str) -> tuple[str, str | None]:
    """``"displacement [um]"`` -> ``("displacement", "um")``; ``(None)`` where no unit is given."""
    match = _UNIT.match(header.strip())
    if not match or not match["name"]:
        return header.strip(), None
    unit = (match["square"] or match["round"] or "").strip()
    return match["name"].strip(), plain_unit(unit) or None


def unique(names: Iterable[str]) -> list[str]:
    """Names made unique by a number in parentheses."""
    seen: dict[str, int] = {}
    result = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        result.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return result


def add_array(columns: Columns, name: str, values: object, unit: str | None = None) -> None:
    """Put a numeric array of any shape into the columns: 1-d as it is, 2-d one column per series."""
    array = np.asarray(values)
    if array.dtype.names:
        for part in array.dtype.names:
            add_array(columns, f"{name}.{part}" if name else part, array[part], None)
        return
    if array.dtype.kind not in "biuf":
        columns.ignored[name] = f"it holds {_kind(array)}, not real numbers"
        return
    array = np.squeeze(array)
    if array.ndim == 0:
        columns.ignored[name] = "a single number"
    elif array.ndim == 1:
        columns.data[name] = np.asarray(array, np.float64)
        if unit and unit.strip() not in ("", "-"):
            columns.units[name] = plain_unit(unit.strip().strip("[]()"))
    elif array.ndim == 2:
        series = array.T if array.shape[0] >= array.shape[1] else array  # samples run along the longer side
        for number, row in enumerate(series, start=1):
            add_array(columns, f"{name}:{number}" if name else f"column {number}", row, unit)
    else:
        columns.ignored[name] = f"an array of {array.ndim} dimensions"


def _kind(array: np.ndarray) -> str:
    return {"c": "complex numbers", "U": "text", "S": "text", "O": "objects"}.get(array.dtype.kind, str(array.dtype))


def need_columns(columns: Columns, path: Path) -> Columns:
    """The columns, or an error if there are none."""
    if not columns.data:
        found = "; ".join(f"{name}: {why}" for name, why in list(columns.ignored.items())[:8]) or "nothing"
        raise InputError("the file holds no column of numbers", file=path, allowed=f"found: {found}")
    return columns
