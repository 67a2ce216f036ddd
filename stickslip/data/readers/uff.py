"""Universal files of vibrometers and modal analysers: data sets 58 (text) and 58b (binary).

Headers and text are parsed by pyuff, which is given marks and identifier lines set out as the standard has them. Binary
numbers are taken here, because writers differ in ways pyuff does not follow: a line end before the closing mark,
abscissas and ordinates each in single or in double precision whatever the header says, and data that happen to hold the
closing mark itself.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from .base import Columns, add_array, need_columns, unique

_MARK = re.compile(  # columns 5 and 6 in the standard; some writers begin at the left margin
    rb"(?:^|(?<=\n)|(?<=\r))([ ]{0,8})-1[ \t]*(?:\r\n|\n|\r)[ ]*(\d+)([bB]?)([^\r\n]*)(?:\r\n|\n|\r)"
)
_CLOSE = re.compile(rb"(?:\r\n|\n|\r)?[ ]{0,8}-1[ \t]*(?:\r\n|\n|\r|\Z)")
_INDENT = b"    "
_NOTHING = re.compile(rb"[\s\0]*\Z")  # some writers leave the closing mark out
_FORTRAN = re.compile(rb"(\d)[dD]([+-]\d)")  # 1.0D+00, as Fortran writes double precision
_HEADER_LINES = 11  # records 1 to 11, after the line with the data set's number
_KINDS = {8: "displacement", 9: "force", 11: "velocity", 12: "acceleration", 13: "force"}
_SINGLE, _DOUBLE = 4, 8
_KNOWN = {15, 18, 55, 58, 82, 151, 164, 1858, *range(2400, 2500)}  # data sets of modal analysis


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
        mark = re.match(rb"\s{0,80}?([ ]*)-1[ \t]*(?:\r\n|\n|\r)[ ]*(\d{1,4})[bB]?", head)
        # elsewhere than in columns 5 and 6 it may be the first number of a plain column
        return mark is not None and (mark[1] == _INDENT or int(mark[2]) in _KNOWN)

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
        kind, binary = int(mark[2]), bool(mark[3])
        if kind != 58:  # may hold lines of a lone -1 elsewhere
            close = _closing(mark[1]).search(raw, mark.end())
            position = close.end() if close else len(raw)
            continue
        try:
            start = _skip_lines(raw, mark.end(), _HEADER_LINES)
            if binary:
                header = _pyuff(_identifier(mark[4]) + raw[mark.end() : start], header_only=True)
                x, y, notes, position = _binary(raw, start, header)
            else:
                close = _closing(rb"[ ]{0,8}").search(raw, start)
                end, position = (close.start(), close.end()) if close else (len(raw), len(raw))
                header = _pyuff(b"    -1\n    58\n" + raw[mark.end() : start] + _FORTRAN.sub(rb"\1E\2", raw[start:end]))
                x, y, notes = header.pop("x"), header.pop("data"), []
                _check_length(y, header)
        except InputError as error:
            raise error.at(file=path, key=f"data set {number}") from None
        except Exception as error:  # pyuff raises bare exceptions
            what = f"data set 58{'b' if binary else ''} cannot be read ({error})"
            hint = "export it again, as text or as CSV"
            raise InputError(what, file=path, key=f"data set {number}", hint=hint) from None
        if int(header["abscissa_spacing"]) == 1:
            notes.append(f"time step {header['abscissa_inc']:g}, which this format rounds to 6 digits")
        yield _Set(header, np.asarray(x), np.asarray(y), notes)
    if number == 0:
        raise InputError("the universal file holds no data set", file=path)


def _closing(indent: bytes) -> re.Pattern[bytes]:
    return re.compile(rb"(?:^|(?<=\n)|(?<=\r))" + indent + rb"-1[ \t]*(?:\r\n|\n|\r|\Z)")


def _identifier(rest: bytes) -> bytes:
    """Opening mark and identifier line of a binary set, from what follows "58b": byte order, kind of numbers, lengths.

    Some writers stop after the two numbers that matter, or do not keep to their columns.
    """
    words = rest.split()
    if len(words) < 2 or not all(word.isdigit() for word in words[:2]):
        what = "the line '58b' does not state the byte order and the kind of numbers"
        value = rest.decode("latin-1").strip() or "nothing"
        allowed = "58b, then 1 (Intel) or 2 (Motorola), then 2 (IEEE)"
        raise InputError(what, value=value, allowed=allowed, hint="export the file again, as text or as CSV")
    order, kind = (int(word) for word in words[:2])
    return f"{-1:6d}\n{58:6d}b{order:6d}{kind:6d}{_HEADER_LINES:12d}{0:12d}{0:6d}{0:6d}{0:12d}{0:12d}\n".encode()


def _pyuff(block: bytes, *, header_only: bool = False) -> dict[str, Any]:
    """What pyuff makes of a data set without its closing mark."""
    import pyuff

    try:
        block.decode()
    except UnicodeDecodeError:  # units like µm and m/s² from writers that know one byte a letter
        block = block.decode("latin-1").encode()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "set.uff"
        file.write_bytes(block + (b"" if block.endswith((b"\n", b"\r")) else b"\n") + b"    -1\n")
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
    readings = []
    for x_size, y_size in _layouts(even, double):
        fields = [("x", f"{order}f{x_size}")] if x_size else []
        fields += [(part, f"{order}f{y_size}") for part in (("re", "im") if cplx else ("re",))]
        layout = np.dtype(fields)
        end = start + count * layout.itemsize
        close = _CLOSE.match(raw, end) or _NOTHING.match(raw, end)
        if close is None or end > len(raw):
            continue
        notes: list[str] = []
        if _CLOSE.match(raw, end) is None:
            notes.append("the mark that closes the data set is missing")
        table = np.frombuffer(raw, layout, count, start)
        if not _sane(table["re"]) and _sane(table["re"].astype(table["re"].dtype).byteswap()):
            table = table.byteswap()
            notes.append("the byte order is not the one its header states; swapped")
        if (y_size == _DOUBLE) != double:
            notes.append(f"the numbers have {y_size} bytes, not what the header states")
        if x_size == _DOUBLE and y_size == _SINGLE:
            notes.append("the abscissas have 8 bytes, the ordinates 4")
        readings.append((table, notes, close.end()))
    if not readings:
        hint = "the file is cut short or was transferred as text"
        raise InputError(f"the binary data do not end where {count} values end", hint=hint)
    # 12 bytes a value are a single and a double in either order: the one that makes sense, else the one declared
    table, notes, position = next((r for r in readings if len(readings) == 1 or _sensible(r[0])), readings[0])
    y = table["re"].astype(float)
    if cplx:
        return np.arange(count, dtype=float), y + 1j * table["im"], notes, position
    if even:
        x = float(header["abscissa_min"]) + float(header["abscissa_inc"]) * np.arange(count)
    else:
        x = table["x"].astype(float)
    return x, y, notes, position


def _layouts(even: bool, double: bool) -> list[tuple[int, int]]:
    """Sizes of abscissa and ordinate to try, the declared ones first."""
    if even:
        return [(0, _DOUBLE), (0, _SINGLE)] if double else [(0, _SINGLE), (0, _DOUBLE)]
    if double:
        return [(_SINGLE, _DOUBLE), (_DOUBLE, _DOUBLE), (_DOUBLE, _SINGLE), (_SINGLE, _SINGLE)]
    return [(_SINGLE, _SINGLE), (_DOUBLE, _SINGLE), (_DOUBLE, _DOUBLE), (_SINGLE, _DOUBLE)]


def _sensible(table: np.ndarray) -> bool:
    """Whether ordinates are numbers of like sizes over abscissas that rise."""
    size = np.abs(table["re"][table["re"] != 0].astype(float))
    if not _sane(table["re"]) or size.size == 0:
        return False
    # pieces of two numbers read as one have exponents all over the place
    if np.diff(np.log10(np.percentile(size, [5, 95])))[0] > 20.0:
        return False
    return "x" not in (table.dtype.names or ()) or bool(np.mean(np.diff(table["x"].astype(float)) > 0) > 0.9)


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
