"""Universal files as pyuff writes them and as other writers do."""

import struct

import numpy as np
import pytest
import pyuff

from stickslip.data.readers import read_columns

T = np.arange(40) * 2.5e-4
X = np.cos(T * 300) * 1e-6


def data_set(**changes):
    base = {
        "type": 58, "func_type": 1, "id1": "Vib Displacement", "rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1,
        "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s", "abscissa_spacing": 1,
        "ordinate_spec_data_type": 8, "ordinate_axis_units_lab": "um", "orddenom_spec_data_type": 0, "x": T, "data": X,
    }  # fmt: skip
    return base | changes


def header(order, kind, spacing, count, *, total, start=0.0, step=2.5e-4, fmt=2):
    """A 58b header as the published format has it, not by pyuff."""
    return [
        f"{'-1':>6}",
        f"{'58':>6}b{order:6d}{fmt:6d}{11:12d}{total:12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        "Vib Displacement", "NONE", "NONE", "NONE", "NONE",
        f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':>10}{1:10d}{1:4d} {'NONE':>10}{1:10d}{1:4d}",
        f"{kind:10d}{count:10d}{spacing:10d}{start:13.5e}{step:13.5e}{0.0:13.5e}",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':<20} {'s':<20}",
        f"{8:10d}{0:5d}{0:5d}{0:5d} {'Displacement':<20} {'um':<20}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}",
    ]  # fmt: skip


def write(path, lines, payload, end=b"    -1\n", newline="\n"):
    path.write_bytes((newline.join(lines) + newline).encode() + payload + end)
    return path


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("spacing", [0, 1])
def test_as_pyuff_writes(tmp_path, binary, spacing):
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(data_set(binary=binary, abscissa_spacing=spacing))
    columns = read_columns(path)
    assert columns.reader == "uff"
    assert columns.units == {"time": "s", "Vib Displacement": "um"}
    assert columns.data["time"] == pytest.approx(T, rel=1e-5, abs=1e-12)
    assert columns.data["Vib Displacement"] == pytest.approx(X, rel=1e-11, abs=1e-18)


def test_doubles_under_a_header_that_says_single(tmp_path):
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(data_set(binary=1, ord_data_type=2), force_double=False)
    columns = read_columns(path)
    assert np.array_equal(columns.data["Vib Displacement"], X)
    assert any("not what the header states" in note for note in columns.notes)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    "end", [b"    -1\n", b"\n    -1\n", b"\r\n    -1\r\n", b"    -1", b"\n    -1" + b" " * 74 + b"\r\n"]
)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("kind", [2, 4])
@pytest.mark.parametrize("spacing", [0, 1])
def test_binary_as_other_writers_have_it(tmp_path, kind, spacing, newline, end, order):
    mark, letter = ("<" if order == 1 else ">"), ("f" if kind == 2 else "d")
    if spacing:
        payload = struct.pack(f"{mark}{X.size}{letter}", *X)
    else:  # abscissas are single precision whatever the ordinates are
        payload = b"".join(struct.pack(f"{mark}f{letter}", t, x) for t, x in zip(T, X, strict=True))
    path = write(tmp_path / "a.uff", header(order, kind, spacing, X.size, total=len(payload)), payload, end, newline)
    columns = read_columns(path)
    exact = X.astype(np.float32) if kind == 2 else X
    assert np.array_equal(columns.data["Vib Displacement"], exact.astype(float))
    assert columns.data["time"] == pytest.approx(T, rel=1e-6, abs=1e-9)


def test_closing_mark_inside_the_data(tmp_path):
    payload = bytearray(struct.pack(f"<{X.size}d", *X))
    payload[80:88] = b"\n    -1\n"
    values = np.frombuffer(bytes(payload), "<f8")
    path = write(tmp_path / "a.uff", header(1, 4, 1, X.size, total=len(payload)), bytes(payload))
    assert np.array_equal(read_columns(path).data["Vib Displacement"], values)


def test_wrong_byte_order_in_the_header(tmp_path):
    path = write(tmp_path / "a.uff", header(2, 4, 1, X.size, total=320), struct.pack(f"<{X.size}d", *X))
    columns = read_columns(path)
    assert np.array_equal(columns.data["Vib Displacement"], X)
    assert any("byte order" in note for note in columns.notes)


def test_several_sets_and_other_kinds_between(tmp_path):
    path = tmp_path / "a.uff"
    file = pyuff.UFF(str(path))
    file.write_sets({"type": 151, "model_name": "m", "description": "d", "db_app": "a", "program": "p"}, "overwrite")
    file.write_sets(data_set(binary=1), "add")
    file.write_sets(data_set(binary=0, data=2 * X), "add")
    file.write_sets(data_set(binary=1, x=T[:20], data=X[:20], id1="short"), "add")
    file.write_sets(data_set(binary=1, func_type=4, abscissa_spec_data_type=18, id1="spectrum"), "add")
    columns = read_columns(path)
    assert np.array_equal(columns.data["Vib Displacement"], X)
    assert columns.data["Vib Displacement (2)"] == pytest.approx(2 * X, rel=1e-11)
    assert columns.data["short time"].size == columns.data["short"].size == 20
    assert "spectrum" in columns.ignored


@pytest.mark.parametrize("binary", [0, 1])
def test_cut_short(tmp_path, refuses, binary):
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(data_set(binary=binary))
    path.write_bytes(path.read_bytes()[:-60])
    refuses(lambda: read_columns(path), "a.uff", "data set 1", "40" if binary else "promises")


def test_vax_format_is_refused(tmp_path, refuses):
    payload = struct.pack(f"<{X.size}d", *X)
    path = write(tmp_path / "a.uff", header(1, 4, 1, X.size, total=320, fmt=1), payload)
    refuses(lambda: read_columns(path), "VAX or IBM", "IEEE")


def test_two_sets_under_one_header(tmp_path):
    """Two channels an instrument did not name apart."""
    path = tmp_path / "a.uff"
    file = pyuff.UFF(str(path))
    file.write_sets(data_set(binary=1))
    file.write_sets(data_set(binary=1, data=2 * X), "add")
    columns = read_columns(path)
    assert np.array_equal(columns.data["Vib Displacement"], X)
    assert np.array_equal(columns.data["Vib Displacement (2)"], 2 * X)


def _spaces_at_the_end(lines):  # SignalStar: the last line of the numbers is filled up (pyuff issue 20)
    closing = max(i for i, line in enumerate(lines) if line.strip() == "-1")
    return [line.ljust(80) if i == closing - 1 else line for i, line in enumerate(lines)]


def _short_records(lines):  # records not filled with blanks
    return [line.rstrip() if 2 <= i < 13 else line for i, line in enumerate(lines)]


def _small_exponents(lines):
    return [line if i < 13 else line.replace("E", "e") for i, line in enumerate(lines)]


def _fortran_exponents(lines):  # of double precision: 1.0D+00
    return [line if i < 13 else line.replace("E", "D") for i, line in enumerate(lines)]


@pytest.mark.parametrize("edit", [_spaces_at_the_end, _short_records, _small_exponents, _fortran_exponents])
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
def test_text_as_other_writers_have_it(tmp_path, edit, newline):
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(data_set(binary=0))
    path.write_bytes(newline.join(line.encode() for line in edit(path.read_text().split("\n"))))
    columns = read_columns(path)
    assert columns.data["Vib Displacement"] == pytest.approx(X, rel=1e-11, abs=1e-18)
    assert columns.units == {"time": "s", "Vib Displacement": "um"}


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
@pytest.mark.parametrize("binary", [0, 1])
def test_letters_beyond_ascii_in_the_header(tmp_path, encoding, binary):
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(data_set(binary=binary, id2="note"))
    path.write_bytes(path.read_bytes().replace(b"note", "20 °C, µm".encode(encoding), 1))
    assert read_columns(path).data["Vib Displacement"] == pytest.approx(X, rel=1e-11, abs=1e-18)


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_text_as_catman_writes_it(tmp_path, encoding, newline):
    """Lines of 80 letters, three digits in the exponents of the header, units in the writer's own encoding."""
    rows = [f"{x * 1e6:13.5E}" for x in X]
    lines = [
        "    -1", "    58", "1x : µm", "UFF58 file created by HBM catman", "30-Apr-20 19:12:52", "NONE", "NONE",
        "    1         0    0         0 NONE               0   0 NONE               0   0",
        f"         2{X.size:10d}         1 0.00000E+000 2.50000E-004 0.00000E+000",
        f"        17    0    0    0 {'Time':<20} {'s':<20}", f"         8    0    0    0 {'1x':<20} {'µm':<20}",
        *[f"         0    0    0    0 {'NONE':<20} {'NONE':<20}"] * 2,
        *["".join(rows[i : i + 6]) for i in range(0, X.size, 6)], "    -1",
    ]  # fmt: skip
    path = tmp_path / "a.uff"
    path.write_bytes("".join(line.ljust(80) + newline for line in lines).encode(encoding))
    columns = read_columns(path)
    assert columns.units == {"1x : µm": "um", "time": "s"}
    assert columns.data["time"] == pytest.approx(T, abs=1e-12)
    assert columns.data["1x : µm"] == pytest.approx(1e6 * X, rel=1e-5)


@pytest.mark.parametrize("rest", [b"", b"\n", b" " * 80, b"\0" * 12])
def test_no_closing_mark(tmp_path, rest):
    payload = struct.pack(f"<{X.size}d", *X)
    columns = read_columns(write(tmp_path / "a.uff", header(1, 4, 1, X.size, total=320), payload, rest))
    assert np.array_equal(columns.data["Vib Displacement"], X)
    assert any("closes the data set is missing" in note for note in columns.notes)


def test_a_header_cut_short_names_the_file(tmp_path, refuses):
    path = tmp_path / "a.uff"
    path.write_text("\n".join(header(1, 4, 1, X.size, total=320)[:6]))
    refuses(lambda: read_columns(path), "a.uff", "data set 1", "header", "export")


def _edited(path, lines, indents, payload=b""):
    """A file with its opening and closing mark at other columns, byte by byte."""
    opening, closing = indents
    lines[0] = " " * opening + "-1"
    path.write_bytes("".join(f"{line}\n" for line in lines).encode() + payload + b" " * closing + b"-1\n")
    return path


MARGINS = [(0, 0), (0, 4), (4, 0), (2, 2)]


@pytest.mark.parametrize("indents", MARGINS)
@pytest.mark.parametrize("ending", [".uff", ".dat"])
def test_binary_with_its_marks_at_the_left_margin(tmp_path, indents, ending):
    lines = header(1, 4, 1, X.size, total=320)
    lines[1] = lines[1].lstrip()  # "58b" goes with the mark
    path = _edited(tmp_path / f"a{ending}", lines, indents, struct.pack(f"<{X.size}d", *X))
    columns = read_columns(path)
    assert columns.reader == "uff"
    assert np.array_equal(columns.data["Vib Displacement"], X)
    assert columns.units == {"time": "s", "Vib Displacement": "um"}


@pytest.mark.parametrize("indents", MARGINS)
def test_text_with_its_marks_at_the_left_margin(tmp_path, indents):
    lines = header(1, 4, 1, X.size, total=0)
    lines[1] = "58"
    lines += ["".join(f"{x:20.11e}" for x in X[i : i + 4]) for i in range(0, X.size, 4)]
    columns = read_columns(_edited(tmp_path / "a.uff", lines, indents))
    assert columns.data["Vib Displacement"] == pytest.approx(X, rel=1e-11, abs=1e-18)
    assert columns.data["time"] == pytest.approx(T, rel=1e-5, abs=1e-12)


def test_two_sets_at_the_left_margin_behind_another_kind(tmp_path):
    """A set that is passed over ends at a mark like its first, not at a number of its own that looks like one."""
    payload = struct.pack(f"<{X.size}d", *X)
    path = tmp_path / "a.uff"
    one = _edited(path, header(1, 4, 1, X.size, total=320), (0, 0), payload).read_bytes()
    path.write_bytes(b"-1\n2411\n         1\n    -1\n         7\n-1\n" + one + one)
    columns = read_columns(path)
    assert set(columns.data) == {"time", "Vib Displacement", "Vib Displacement (2)"}
    assert np.array_equal(columns.data["Vib Displacement (2)"], X)


def test_a_column_of_numbers_that_begins_with_minus_one_is_a_table(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("-1\n5\n3\n2\n")
    assert read_columns(path).reader != "uff"


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("line", ["    58b   {}   2", "    58b     {}     2", "    58b {} 2", "58b {} 2 11"])
def test_a_short_identifier_line(tmp_path, line, order):
    lines = header(order, 4, 1, X.size, total=320)
    lines[1] = line.format(order)
    path = _edited(tmp_path / "a.uff", lines, (4, 4), struct.pack(f"{'<>'[order - 1]}{X.size}d", *X))
    columns = read_columns(path)
    assert np.array_equal(columns.data["Vib Displacement"], X)
    assert columns.notes == ["Vib Displacement: time step 0.00025, which this format rounds to 6 digits"]


@pytest.mark.parametrize("line", ["    58b", "    58b     1", "    58b little ieee"])
def test_an_identifier_line_without_the_kind_of_numbers_is_refused(tmp_path, refuses, line):
    lines = header(1, 4, 1, X.size, total=320)
    lines[1] = line
    path = _edited(tmp_path / "a.uff", lines, (4, 4), struct.pack(f"<{X.size}d", *X))
    refuses(lambda: read_columns(path), "a.uff", "data set 1", "byte order", "export")


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("says", [2, 4])
@pytest.mark.parametrize("sizes", ["fd", "df", "ff", "dd"])
def test_abscissas_and_ordinates_of_any_precision(tmp_path, sizes, says, order):
    """A single and a double take twelve bytes in either order; the one that makes sense is taken."""
    count = 400
    t = 3.0 + np.arange(count) * 2.5e-4
    x = 5.0 + np.cos(t * 300)
    payload = b"".join(struct.pack(f"{'<>'[order - 1]}{sizes}", *pair) for pair in zip(t, x, strict=True))
    path = write(tmp_path / "a.uff", header(order, says, 0, count, total=len(payload)), payload)
    columns = read_columns(path)
    kinds = {"f": np.float32, "d": np.float64}
    assert np.array_equal(columns.data["time"], t.astype(kinds[sizes[0]]).astype(float))
    assert np.array_equal(columns.data["Vib Displacement"], x.astype(kinds[sizes[1]]).astype(float))
    declared = says == (4 if sizes[1] == "d" else 2)
    assert any("not what the header states" in note for note in columns.notes) != declared
