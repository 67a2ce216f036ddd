import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.data.readers import find_reader, read_columns
from stickslip.data.readers.base import split_unit

T = np.array([0.0, 0.001, 0.002, 0.003, 0.004])
X = np.array([1.5, -2.25, 3e-7, 40000.0, 0.125])


def write(path, rows, *, header="", encoding="utf-8", newline="\n"):
    text = (header + "\n" if header else "") + "\n".join(rows) + "\n"
    path.write_bytes(text.replace("\n", newline).encode(encoding))
    return path


def rows(delimiter, decimal="."):
    return [f"{t!r}{delimiter}{x!r}".replace(".", decimal) for t, x in zip(T.tolist(), X.tolist(), strict=True)]


@pytest.mark.parametrize(
    "header", ["", "time [s]{}x [um]", "time (s){}x (um)", "# time [s]{}x [um]", '"time [s]"{}"x [um]"']
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
@pytest.mark.parametrize(
    ("delimiter", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("  ", ".")]
)
def test_every_kind_of_table_gives_the_same_numbers(tmp_path, delimiter, decimal, encoding, header):
    path = write(tmp_path / "a.csv", rows(delimiter, decimal), header=header.format(delimiter), encoding=encoding)
    columns = read_columns(path)
    names = ["time", "x"] if header else ["column 1", "column 2"]
    assert list(columns.data) == names
    assert np.array_equal(columns.data[names[0]], T)
    assert np.array_equal(columns.data[names[1]], X)
    if header:
        assert columns.units == {"time": "s", "x": "um"}
    assert columns.first_line == (2 if header else 1)


def test_a_number_counts_all_columns_of_the_file(tmp_path, refuses):
    lines = [f"12:00:0{i},{t!r},{x!r}" for i, (t, x) in enumerate(zip(T.tolist(), X.tolist(), strict=True))]
    columns = read_columns(write(tmp_path / "a.csv", lines))
    assert columns.find(2) == "column 2"
    assert np.array_equal(columns.data[columns.find(3)], X)
    refuses(lambda: columns.find(1), "'column 1' cannot be used", "text such as '12:00:0")
    refuses(lambda: columns.find(4), "there is no column 4", "1 to 3")


@pytest.mark.parametrize("end", ["", ","])
def test_first_rows_may_lack_their_last_value(tmp_path, end):
    lines = [
        "0," + end,
        "0.001," + end,
        *(f"{t!r},{x!r}{end}" for t, x in zip(T.tolist()[2:], X.tolist()[2:], strict=True)),
    ]
    columns = read_columns(write(tmp_path / "a.csv", lines, header="t [s],x [um]" + end))
    assert columns.units == {"t": "s", "x": "um"}
    assert np.array_equal(columns.data["t"], T)
    assert np.isnan(columns.data["x"][:2]).all()
    assert np.array_equal(columns.data["x"][2:], X[2:])
    assert "2 empty fields" in columns.notes[0]


def test_a_text_column_and_a_last_line_cut_short(tmp_path):
    lines = [f"{0.001 * i:.4f},{0.1 * i:.4f},ok" for i in range(300)] + ["0.3000"]
    columns = read_columns(write(tmp_path / "a.csv", lines, header="t,x,state"))
    assert list(columns.data) == ["t", "x"]
    assert columns.data["t"].size == 300
    assert any("line 302, the last, is cut short" in note for note in columns.notes)


@pytest.mark.parametrize("extra", ["", ",ok"])
def test_a_row_too_long_is_refused_and_named(tmp_path, refuses, extra):
    lines = [f"{row}{extra}" for row in rows(",")]
    lines[3] += ",7,7"
    refuses(
        lambda: read_columns(write(tmp_path / "a.csv", lines, header="t,x" + extra)),
        "line 5",
        "fields where",
        "complete",
    )


def test_a_delimiter_within_quotes_divides_nothing(tmp_path):
    columns = read_columns(write(tmp_path / "a.csv", rows(","), header='"Time, elapsed [s]","x [um]"'))
    assert columns.units == {"Time, elapsed": "s", "x": "um"}
    assert np.array_equal(columns.data["x"], X)


def test_a_number_has_no_underscores(tmp_path, refuses):
    lines = rows(",")
    lines[2] = "0.002,1_000"
    refuses(lambda: read_columns(write(tmp_path / "a.csv", lines, header="t,x")), "not a number", "line 4", "1_000")


def test_decimal_comma_between_blanks(tmp_path):
    columns = read_columns(write(tmp_path / "a.txt", rows(" ", ",")))
    assert np.array_equal(columns.data["column 2"], X)


def test_windows_line_ends(tmp_path):
    columns = read_columns(write(tmp_path / "a.csv", rows(","), header="t,x", newline="\r\n"))
    assert np.array_equal(columns.data["x"], X)


def test_micro_sign_in_latin1_and_unit_row(tmp_path):
    path = write(
        tmp_path / "a.txt",
        rows("\t"),
        header="Vibrometer export\n\nTime\tDisplacement\n[ s ]\t[ µm ]",
        encoding="latin-1",
    )
    columns = read_columns(path)
    assert columns.units == {"Time": "s", "Displacement": "um"}
    assert np.array_equal(columns.data["Displacement"], X)


def test_preamble_comments_and_text_columns(tmp_path):
    lines = ["Device: X 200", "Rate: 1000", "t;state;x", "# gap"]
    lines += [f"{t!r};ok;{x!r}" for t, x in zip(T.tolist(), X.tolist(), strict=True)]
    lines.insert(6, "# a comment between the rows")
    columns = read_columns(write(tmp_path / "a.csv", lines))
    assert list(columns.data) == ["t", "x"]
    assert "text such as 'ok'" in columns.ignored["state"]
    assert np.array_equal(columns.data["x"], X)


def test_header_names_with_blanks_in_a_blank_separated_table(tmp_path):
    columns = read_columns(write(tmp_path / "a.dat", rows("   "), header="time [s]   spring force [mN]"))
    assert columns.units == {"time": "s", "spring force": "mN"}


def test_empty_fields_and_nan_words_become_nan(tmp_path):
    columns = read_columns(write(tmp_path / "a.csv", ["0,1", "1,", "2,NaN", "3,--", "4,5"], header="t,x"))
    assert np.array_equal(np.isnan(columns.data["x"]), [False, True, True, True, False])
    assert columns.data["t"].size == 5


def test_last_line_cut_short_is_left_out_and_said(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,x\n0,1\n1,2\n2,3\n3")
    columns = read_columns(path)
    assert columns.data["t"].tolist() == [0, 1, 2]
    assert "line 5" in columns.notes[0]


def test_repeated_and_missing_names(tmp_path):
    columns = read_columns(write(tmp_path / "a.csv", ["0,1,2", "1,2,3"], header=",x,x"))
    assert list(columns.data) == ["column 1", "x", "x (2)"]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (["t,x", "0,1", "1,two", "2,3"], ["line 3", "column 'x'", "'two'"]),
        (["t,x", "0,1", "1", "2,3"], ["line 3", "1 fields where 2", "complete the line"]),
        (["only words", "and no numbers"], ["no rows of numbers"]),
    ],
)
def test_faults_name_their_line(tmp_path, refuses, rows, words):
    path = write(tmp_path / "a.csv", rows)
    refuses(lambda: read_columns(path), "a.csv", *words)


def test_files_that_are_no_tables(tmp_path, refuses):
    empty = tmp_path / "empty.csv"
    empty.write_bytes(b" \n\n")
    refuses(lambda: read_columns(empty), "empty.csv", "empty", "export it again")
    binary = tmp_path / "binary.csv"
    binary.write_bytes(bytes(range(256)) * 10)
    refuses(lambda: read_columns(binary), "binary.csv", "holds binary data", "MATLAB", "TDMS")
    page = tmp_path / "data.xml"
    page.write_text("<data><row>0 1</row><row>1 2</row></data>")
    refuses(lambda: read_columns(page), "format of the file is not known", "NetCDF", "CSV", "universal file")
    refuses(lambda: read_columns(tmp_path / "emty.csv"), "not there", "did you mean 'empty.csv'")
    refuses(lambda: read_columns(tmp_path), "not a file")
    refuses(lambda: find_reader(binary, "cvs"), "no reader 'cvs'")


def test_columns_are_found_by_name_number_or_with_their_unit(tmp_path, refuses):
    columns = read_columns(write(tmp_path / "a.csv", rows(","), header="Time [s],Position [um]"))
    assert columns.find("position") == columns.find("Position [um]") == columns.find(2) == "Position"
    refuses(lambda: columns.find("positon"), "no column 'positon'", "did you mean 'Position'", "Time")
    refuses(lambda: columns.find(3), "no column 3", "1 to 2")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x [um]", ("x", "um")),
        ("x (µm)", ("x", "um")),
        ("F[ mN ]", ("F", "mN")),
        ("x", ("x", None)),
        ("x []", ("x", None)),
        ("[um]", ("[um]", None)),
        ("v (m/s)", ("v", "m/s")),
    ],
)
def test_units_in_headers(text, expected):
    assert split_unit(text) == expected


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=2, max_size=2), min_size=2, max_size=30
    )
)
def test_any_floats_come_back_as_they_were_written(tmp_path_factory, table):
    path = tmp_path_factory.mktemp("floats") / "a.csv"
    path.write_text("t,x\n" + "\n".join(f"{a!r},{b!r}" for a, b in table) + "\n")
    columns = read_columns(path)
    assert np.array_equal(np.column_stack(list(columns.data.values())), np.array(table))


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=400))
def test_any_bytes_are_read_or_refused_but_never_crash(tmp_path_factory, content):
    from stickslip.errors import InputError

    for ending in ("csv", "mat", "uff", "npy", "h5"):
        path = tmp_path_factory.mktemp("bytes") / f"a.{ending}"
        path.write_bytes(content)
        try:
            read_columns(path)
        except InputError as error:
            assert path.name in str(error)


def test_commas_between_thousands_are_not_read_as_decimal_commas(tmp_path, refuses):
    mixed = write(tmp_path / "a.tsv", ["0.000\t2,000", "0.001\t25,750", "0.002\t1,025,750"], header="time [s]\tx [nm]")
    refuses(lambda: read_columns(mixed), "column 'x' has commas and another one decimal points", "thousands")
    whole = write(tmp_path / "b.tsv", ["0\t2,000", "1\t25,750", "2\t1,025"], header="time [ms]\tx [nm]")
    (said,) = (note for note in read_columns(whole).notes if "three digits" in note)
    assert "'x' has three digits behind every comma, as in 2,000" in said
    clear = write(tmp_path / "c.tsv", ["0,000\t2,000", "0,001\t25,75", "0,002\t1,025"], header="time [s]\tx [nm]")
    assert not any("three digits" in note for note in read_columns(clear).notes)
