"""Tables in text: comma, semicolon, tab or blanks, decimal point or comma, with or without a header."""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from .base import HEAD_BYTES, Columns, need_columns, plain_unit, split_unit, unique

_COMMENTS = ("#", "%", "//", "!")
_NOTHING = {"", "nan", "na", "n/a", "null", "none", "-", "--", "---", "#n/a", "overflow", "ovl"}
_UNIT_WORD = re.compile(r"^[\[(]?\s*[A-Za-zµμ%°\-][\w µμ%°/*^.\-]{0,11}\s*[\])]?$")
_THOUSAND = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_UNITS = {"s", "ms", "us", "m", "mm", "um", "nm", "v", "mv", "n", "mn", "un", "kn", "m/s", "mm/s", "um/s", "-", "1"}


@dataclass(frozen=True)
class _Layout:
    encoding: str
    delimiter: str | None  # None: any run of blanks
    decimal: str
    skip: int  # lines before the first row of data
    names: list[str]
    units: dict[str, str]
    numeric: list[int]
    ignored: dict[str, str]
    trailing: bool  # rows end with a delimiter
    doubts: list[str]  # whether it was understood


class TextReader:
    """CSV, TSV and the like."""

    name = "text"
    suffixes: tuple[str, ...] = (".csv", ".tsv", ".txt", ".dat", ".asc", ".t", ".tab", ".prn")
    description = "text table (CSV, TSV, semicolons or blanks; decimal point or comma; header optional)"

    def sniff(self, path: Path, head: bytes) -> bool:
        if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
            return True
        if b"\x00" in head or head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"<", b"[[", b"[{", b"%PDF")):
            return False  # binary, or JSON, XML and their like
        odd = sum(byte < 9 or 13 < byte < 32 for byte in head)
        return odd <= len(head) // 1000

    def read(self, path: Path) -> Columns:
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
        layout = _layout(path, head, whole=len(head) < HEAD_BYTES)
        notes: list[str] = []
        try:
            table = _fast(path, layout)
        except ValueError:
            table, notes = _careful(path, layout)
        if layout.decimal == ",":
            between = {";": "a semicolon", "\t": "a tab", None: "blanks"}[layout.delimiter]
            notes.append(f"decimal comma, {between} between the columns")
            notes += layout.doubts
        data = {layout.names[c]: np.ascontiguousarray(table[:, k]) for k, c in enumerate(layout.numeric)}
        columns = Columns(data, layout.units, layout.ignored, notes, layout.skip + 1, order=layout.names)
        return need_columns(columns, path)


def _encoding(head: bytes) -> str:
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    try:
        # the head may end within a character
        head[: len(head) - 4 if len(head) >= HEAD_BYTES else None].decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _layout(path: Path, head: bytes, *, whole: bool) -> _Layout:
    encoding = _encoding(head)
    lines = head.decode(encoding, errors="replace").splitlines()
    if not whole and len(lines) > 1:
        lines.pop()
    sample = [line for line in lines if line.strip() and not line.lstrip().startswith(_COMMENTS)][-200:]
    if not sample:
        raise InputError("the file holds no rows of numbers", file=path, hint="is it the right file?")
    delimiter, decimal = _separators(sample)
    rows = [_split(line, delimiter) for line in sample]
    widths = [len(row) for row in rows]
    width = max(set(widths), key=widths.count)
    told = ((i, line) for i, line in enumerate(lines) if not line.lstrip().startswith(_COMMENTS))
    first = next((i for i, line in told if _is_data(_row(line, delimiter, width), width, decimal)), None)
    if first is None:
        hint = "is it the right file?"
        raise InputError("the file holds no rows of numbers", file=path, key="line 1", value=lines[0][:60], hint=hint)
    rows = [row for line in sample if _is_data(row := _row(line, delimiter, width), width, decimal)]
    ends = [len(_fields(line, delimiter)) for line in sample if delimiter and line.rstrip().endswith(delimiter)]
    numeric = [
        c
        for c, column in enumerate(zip(*rows, strict=True))
        if any(_number(field, decimal) for field in column)
        and sum(_number(field, decimal) or _empty(field) for field in column) > len(rows) / 2
    ]
    names, units = _header(lines[:first], delimiter, width)
    doubts = _thousands(path, rows, [names[c] for c in numeric], numeric) if decimal == "," else []
    ignored = {names[c]: f"it holds text such as '{rows[0][c]}'" for c in range(width) if c not in numeric}
    return _Layout(encoding, delimiter, decimal, first, names, units, numeric, ignored, width + 1 in ends, doubts)


def _separators(sample: list[str]) -> tuple[str | None, str]:
    """Delimiter and decimal mark that turn most fields into numbers."""
    best: tuple[float, float, str | None, str] = (-1.0, 0.0, None, ".")
    for delimiter in (";", "\t", ",", None):
        for decimal in ".," if delimiter != "," else ".":
            if delimiter and sum(delimiter in line for line in sample) < 0.5 * len(sample):
                continue
            rows = [_split(line, delimiter) for line in sample[-50:]]
            lines = len(rows)
            rows = [row for row in rows if any(_number(f, decimal) for f in row)]
            fields = sum(map(len, rows))
            good = sum(_number(f, decimal) for row in rows for f in row)
            blank = sum(_empty(f) for row in rows for f in row)
            share = good / max(fields - blank, 1) * len(rows) / lines
            if delimiter is None and decimal == "," and fields == len(rows):
                share *= 0.5  # "1,5" alone in its line is rather two columns
            if (share, good) > best[:2]:
                best = (share, good, delimiter, decimal)
    return best[2], best[3]


def _fields(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    line = line.rstrip("\r\n")
    quoted = '"' in line
    parts = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True)) if quoted else line.split(delimiter)
    return [part.strip().strip('"').strip() for part in parts]


def _split(line: str, delimiter: str | None) -> list[str]:
    """Fields of a line, where nothing is known of the others."""
    fields = _fields(line, delimiter)
    if delimiter and len(fields) > 1 and fields[-1] == "":  # a delimiter at the end of the line
        fields.pop()
    return fields


def _row(line: str, delimiter: str | None, width: int) -> list[str]:
    """Fields of a line of a table this wide, in which the last field may be empty and a last delimiter end the line."""
    fields = _fields(line, delimiter)
    if len(fields) == width + 1 and fields[-1] == "":
        fields.pop()
    return fields


def _number(field: str, decimal: str) -> bool:
    try:
        float(field.replace(",", ".") if decimal == "," else field)
    except ValueError:
        return False
    return "_" not in field


def _empty(field: str) -> bool:
    return field.strip().lower() in _NOTHING


def _is_data(row: list[str], width: int, decimal: str) -> bool:
    """Whether a line of fields has a number, and little else."""
    known = [field for field in row if _number(field, decimal) or _empty(field)]
    return len(row) == width and any(_number(field, decimal) for field in known) and 2 * len(known) >= width


def _thousands(path: Path, rows: list[list[str]], names: list[str], numeric: list[int]) -> list[str]:
    """Doubts about commas that may stand between thousands.

    Raises:
        InputError: points are decimal in some column, so that commas in another cannot be.
    """
    marks = [{mark for row in rows for mark in ".," if mark in row[c]} for c in numeric]
    commas = [name for name, found in zip(names, marks, strict=True) if found == {","}]
    if commas and len(commas) < len(names) and {"."} in marks:
        hint = "commas between thousands are to be left out; decimal marks must be the same in all columns"
        raise InputError(f"column '{commas[0]}' has commas and another one decimal points", file=path, hint=hint)
    said = []
    for name, c in zip(names, numeric, strict=True):
        fields = [row[c] for row in rows if "," in row[c]]
        if len(fields) > 1 and all(_THOUSAND.fullmatch(field) for field in fields):
            said.append(
                f"'{name}' has three digits behind every comma, as in {fields[0]}: it was read as a decimal comma, and "
                "commas between thousands are to be left out"
            )
    return said


def _header(before: list[str], delimiter: str | None, width: int) -> tuple[list[str], dict[str, str]]:
    candidates = []
    for line in before[-4:]:
        text = line.strip().lstrip("#%!/").strip().lstrip("\ufeff")
        row = _split(text, delimiter)
        if delimiter is None and len(row) != width:
            row = re.findall(r'"[^"]*"', text) or [part.strip() for part in re.split(r"\t|\s{2,}|,", text)]
            if len(row) != width:  # "time [s] force [N]": blanks before a bracket do not divide
                row = re.sub(r"\s+([\[(])", r"\1", text).split()
        if len(row) != width and delimiter:  # a trailing delimiter was taken off, or a first name is empty
            row = [part.strip().strip('"') for part in text.split(delimiter)]
        if len(row) == width:
            candidates.append([field.strip().strip('"').strip() for field in row])
    if not candidates:
        return [f"column {c}" for c in range(1, width + 1)], {}
    row, unit_row = candidates[-1], None
    if len(candidates) > 1 and _are_units(row):
        row, unit_row = candidates[-2], row
    split = [split_unit(field) for field in row]
    names = unique(name or f"column {c}" for c, (name, _) in enumerate(split, start=1))
    units = {name: unit for name, (_, unit) in zip(names, split, strict=True) if unit}
    if unit_row:
        for name, text in zip(names, unit_row, strict=True):
            unit = plain_unit(text.strip("[]() "))
            if unit and unit != "-":
                units.setdefault(name, unit)
    return names, units


def _are_units(row: list[str]) -> bool:
    bracketed = all(field.startswith(("[", "(")) for field in row if field)
    known = all(plain_unit(field.strip("[]() ")).lower() in _UNITS for field in row if field)
    return any(row) and (bracketed or known) and all(_UNIT_WORD.match(field) for field in row if field and field != "1")


def _lines(path: Path, layout: _Layout) -> Iterator[str]:
    with path.open(encoding=layout.encoding, errors="replace") as stream:
        for line in islice(stream, layout.skip, None):
            yield line.replace(",", ".") if layout.decimal == "," else line


def _fast(path: Path, layout: _Layout) -> np.ndarray:
    chosen = layout.trailing or len(layout.numeric) < len(layout.names)
    if chosen and layout.delimiter:
        _check_lengths(path, layout)
    options: dict[str, Any] = {
        "delimiter": layout.delimiter,
        "comments": "#",  # more than one mark makes numpy five times slower; others are met in _careful
        "usecols": layout.numeric if chosen else None,  # without a choice numpy sees rows that are too long
        "ndmin": 2,
        "quotechar": '"',
    }
    plain = layout.decimal == "." and layout.encoding != "utf-16" and path.suffix not in (".gz", ".bz2", ".xz")
    if plain:
        return np.loadtxt(path, skiprows=layout.skip, encoding=layout.encoding, **options)
    return np.loadtxt(_lines(path, layout), **options)


def _check_lengths(path: Path, layout: _Layout) -> None:
    """`ValueError` where some row is longer than the others."""
    most = len(layout.names) - (not layout.trailing)
    assert layout.delimiter is not None
    with path.open(encoding=layout.encoding, errors="replace") as stream:
        for line in islice(stream, layout.skip, None):
            if line.count(layout.delimiter) > most:
                raise ValueError(line)


def _careful(path: Path, layout: _Layout) -> tuple[np.ndarray, list[str]]:
    """Row by row: empty fields become NaN, and a fault is named with its line."""
    values, empties, short = array("d"), 0, None
    needed = max(layout.numeric) + 1
    for number, line in enumerate(_lines(path, layout), start=layout.skip + 1):
        stripped = line.strip()
        if not stripped or stripped.startswith(_COMMENTS):
            continue
        if short is not None:
            raise _wrong_length(path, *short, layout)
        row = _row(line, layout.delimiter, len(layout.names))
        if len(row) < needed:
            short = (number, len(row), stripped[:60])
            continue
        if len(row) > len(layout.names):
            raise _wrong_length(path, number, len(row), stripped, layout)
        for c in layout.numeric:
            try:
                values.append(float(row[c] if "_" not in row[c] else "no number"))
            except ValueError:
                if not _empty(row[c]):
                    key = f"line {number}, column '{layout.names[c]}'"
                    hint = "correct or delete the line; a missing value is left empty or written NaN"
                    what = "a field is not a number"
                    raise InputError(what, file=path, key=key, value=row[c][:40], hint=hint) from None
                values.append(np.nan)
                empties += 1
    notes = [f"{empties} empty fields read as NaN"] if empties else []
    if short is not None:
        notes.append(
            f"line {short[0]}, the last, is cut short ({short[1]} of {len(layout.names)} fields) and was left out"
        )
    return np.frombuffer(values, float).reshape(-1, len(layout.numeric)), notes


def _wrong_length(path: Path, line: int, fields: int, text: str, layout: _Layout) -> InputError:
    what = f"a row has {fields} fields where {len(layout.names)} are expected"
    return InputError(what, file=path, key=f"line {line}", value=text[:60], hint="delete or complete the line")
