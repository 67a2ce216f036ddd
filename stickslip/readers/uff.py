"""Universal files of vibrometers and modal analysers: data sets 58 (text) and 58b (binary).

Headers and text are parsed by pyuff. Binary numbers are taken here, because writers differ in ways pyuff does not
follow: a line end before the closing mark, single-precision abscissas (as the standard has them) or double ones,
doubles under a header that says single, and data that happen to hold the closing mark itself.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .base import Columns, add_array, need_columns, unique

_MARK = re.compile(rb"(?:^|(?<=\n)|(?<=\r))    -1[ \t]*(?:\r\n|\n|\r)[ ]*(\d+)([bB]?)[^\r\n]*(?:\r\n|\n|\r)")
_CLOSE = re.compile(rb"(?:\r\n|\n|\r)?    -1[ \t]*(?:\r\n|\n|\r|\Z)")
_NOTHING = re.compile(rb"[\s\0]*\Z")  # some writers leave the closing mark out
_HEADER_LINES = 11  # records 1 to 11, after the line with the data set's number
_KINDS = {8: "displacement", 9: "force", 11: "velocity", 12: "acceleration", 13: "force"}
_SINGLE, _DOUBLE = 4, 8


@dataclass(eq=False)  # arrays have no single truth value
class _Set:
    header: dict[str, Any]
    x: np.ndarray
    y: np.ndarray
    notes: list[str]


class UffReader:
    """Universal file format."""

    name = "uff"
    suffixes: tuple[str, ...] = (".uff", ".unv", ".uf", ".ufb", ".bunv", ".ufa")
    description = "universal file (data set 58, text and binary)"

    def sniff(self, path: Path, head: bytes) -> bool:
        return re.match(rb"\s{0,80}-1[ \t]*(\r\n|\n|\r)[ ]*\d{1,4}[bB]?", head) is not None

    def read(self, path: Path) -> Columns:
        sets = list(_sets(path))
        times = [s for s in sets if int(s.header.get("abscissa_spec_data_type", 17)) != 18 and np.isrealobj(s.y)]
        columns = Columns({})
        for s in sets:
            if s not in times:
                columns.ignored[_title(s.header)] = "a spectrum or complex, not a time record"
        for name, s in zip(unique(_title(s.header) for s in times), times, strict=True):
            add_array(columns, name, s.y, _unit(s.header, "ordinate"))
            columns.notes.extend(f"{name}: {note}" for note in s.notes)
            first = columns.data.get("time")
            if first is None:
                add_array(columns, "time", s.x, _unit(s.header, "abscissa") or "s")
            elif first.shape != s.x.shape or not np.array_equal(first, s.x):
                add_array(columns, f"{name} time", s.x, _unit(s.header, "abscissa") or "s")
        return need_columns(columns, path)


def _sets(path: Path) -> Iterator[_Set]:
    raw = path.read_bytes()
    position, number = 0, 0
    while (mark := _MARK.search(raw, position)) is not None:
        number += 1
        kind, binary = int(mark[1]), bool(mark[2])
        close = _CLOSE.search(raw, mark.end())
        if kind != 58:
            position = close.end() if close else len(raw)
            continue
        try:
            start = _skip_lines(raw, mark.end(), _HEADER_LINES)
            if binary:
                header = _pyuff(raw[mark.start() : start] + b"    -1\n", header_only=True)
                x, y, notes, position = _binary(raw, start, header)
            else:
                end = close.end() if close else len(raw)
                header = _pyuff(raw[mark.start() : end] + (b"" if close else b"\n    -1\n"))
                x, y, notes, position = header.pop("x"), header.pop("data"), [], end
                _check_length(y, header)
        except InputError as error:
            raise error.at(file=path, key=f"data set {number}") from None
        except Exception as error:  # pyuff raises bare exceptions
            raise InputError(
                f"data set 58{'b' if binary else ''} cannot be read ({error})",
                file=path,
                key=f"data set {number}",
                hint="export it again, as text or as CSV",
            ) from None
        if int(header["abscissa_spacing"]) == 1:
            notes.append(f"time step {header['abscissa_inc']:g}, which this format rounds to 6 digits")
        yield _Set(header, np.asarray(x), np.asarray(y), notes)
    if number == 0:
        raise InputError("the universal file holds no data set", file=path)


def _pyuff(block: bytes, *, header_only: bool = False) -> dict[str, Any]:
    import pyuff

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "set.uff"
        file.write_bytes(block)
        found = pyuff.UFF(str(file)).read_sets(header_only=header_only)
    return found[0] if isinstance(found, list) else found


def _skip_lines(raw: bytes, position: int, count: int) -> int:
    for _ in range(count):
        end = re.compile(rb"\r\n|\n|\r").search(raw, position)
        if end is None:
            raise InputError("the header of a data set is cut short", hint="export the file again")
        position = end.end()
    return position


def _check_length(y: np.ndarray, header: dict[str, Any]) -> None:
    if len(y) != int(header["num_pts"]):
        raise InputError(f"the data set holds {len(y)} values where its header promises {header['num_pts']}")


def _binary(raw: bytes, start: int, header: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, list[str], int]:
    count, declared = int(header["num_pts"]), int(header["ord_data_type"])
    even, cplx, double = int(header["abscissa_spacing"]) == 1, declared in (5, 6), declared in (4, 6)
    if int(header.get("fp_format", 2)) in (1, 3):
        raise InputError("the numbers are in VAX or IBM format", hint="export it in IEEE format")
    order = "<" if int(header["byte_ordering"]) == 1 else ">"
    notes: list[str] = []
    for x_size, y_size in _layouts(even, double):
        fields = [("x", f"{order}f{x_size}")] if x_size else []
        fields += [(part, f"{order}f{y_size}") for part in (("re", "im") if cplx else ("re",))]
        layout = np.dtype(fields)
        end = start + count * layout.itemsize
        close = _CLOSE.match(raw, end) or _NOTHING.match(raw, end)
        if close is None or end > len(raw):
            continue
        if _CLOSE.match(raw, end) is None:
            notes.append("the mark that closes the data set is missing")
        table = np.frombuffer(raw, layout, count, start)
        if not _sane(table["re"]) and _sane(table["re"].astype(table["re"].dtype).byteswap()):
            table = table.byteswap()
            notes.append("the byte order is not the one its header states; swapped")
        if (y_size == _DOUBLE) != double:
            notes.append(f"the numbers have {y_size} bytes, not what the header states")
        y = table["re"].astype(float)
        if cplx:
            return np.arange(count, dtype=float), y + 1j * table["im"], notes, close.end()
        if even:
            x = float(header["abscissa_min"]) + float(header["abscissa_inc"]) * np.arange(count)
        else:
            x = table["x"].astype(float)
        return x, y, notes, close.end()
    raise InputError(
        f"the binary data do not end where {count} values end", hint="the file is cut short or was transferred as text"
    )


def _layouts(even: bool, double: bool) -> list[tuple[int, int]]:
    """Sizes of abscissa and ordinate to try, the declared ones first."""
    if even:
        return [(0, _DOUBLE), (0, _SINGLE)] if double else [(0, _SINGLE), (0, _DOUBLE)]
    if double:
        return [(_SINGLE, _DOUBLE), (_DOUBLE, _DOUBLE)]
    return [(_SINGLE, _SINGLE), (_DOUBLE, _DOUBLE)]


def _sane(values: np.ndarray) -> bool:
    with np.errstate(invalid="ignore"):
        size = np.abs(values[np.isfinite(values) & (values != 0)].astype(float))
    if size.size == 0:
        return bool(np.isfinite(values).all())
    middle = float(np.median(size))
    return bool(np.isfinite(values).mean() > 0.99 and 1e-25 < middle < 1e25)


def _title(header: dict[str, Any]) -> str:
    for key in ("id1", "ordinate_axis_lab"):
        text = str(header.get(key) or "").strip()
        if text and text.upper() != "NONE":
            return text
    return _KINDS.get(int(header.get("ordinate_spec_data_type", 0)), "data")


def _unit(header: dict[str, Any], axis: str) -> str | None:
    text = str(header.get(f"{axis}_axis_units_lab") or "").strip()
    return None if not text or text.upper() == "NONE" else text
