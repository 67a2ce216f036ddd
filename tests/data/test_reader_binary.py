import json
import os
import sys
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import xarray

from stickslip.data.readers import READERS, read_columns
from stickslip.data.readers.npy import NpyReader
from stickslip.errors import InputError

T = np.arange(50) * 1e-3
X = np.sin(T * 30) * 1e-6


def same(columns, time, x):
    assert np.array_equal(columns.data[time], T)
    assert np.array_equal(columns.data[x], X)


@pytest.mark.parametrize("version", ["5", "4"])
def test_matlab(tmp_path, version):
    scipy.io.savemat(tmp_path / "a.mat", {"t": T[:, None], "x": X[None, :], "fs": 1000.0}, format=version)
    columns = read_columns(tmp_path / "a.mat")
    same(columns, "t", "x")
    assert columns.reader == "mat"
    assert columns.ignored["fs"] == "a single number"


def test_json_arrays_rows_and_records(tmp_path):
    rows = np.column_stack([T, X]).tolist()
    (tmp_path / "a.json").write_text(json.dumps({"t": T.tolist(), "run": {"x": X.tolist()}, "dt": 1e-3, "unit": "m"}))
    columns = read_columns(tmp_path / "a.json")
    same(columns, "t", "run.x")
    assert columns.reader == "json"
    (tmp_path / "b.json").write_text(json.dumps({"data": rows}))
    same(read_columns(tmp_path / "b.json"), "data:1", "data:2")
    (tmp_path / "c.json").write_text(json.dumps([{"t": t, "x": x} for t, x in rows]))
    same(read_columns(tmp_path / "c.json"), "t", "x")


def test_json_says_what_it_left_out(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps({"t": [0.0, None, 2.0], "x": ["a", "b"], "y": [[1.0], [2.0, 3.0]]}))
    columns = read_columns(tmp_path / "a.json")
    assert np.isnan(columns.data["t"][1])
    assert set(columns.ignored) == {"x", "y"}
    (tmp_path / "b.json").write_text('{"t": [1.0, 2.0')
    with pytest.raises(InputError, match="not a readable JSON file"):
        read_columns(tmp_path / "b.json")


def test_matlab_structs_cells_and_matrices(tmp_path):
    content = {"run": {"time": T, "signal": {"x": X}}, "both": np.column_stack([T, X]), "title": "text"}
    scipy.io.savemat(tmp_path / "a.mat", content)
    columns = read_columns(tmp_path / "a.mat")
    same(columns, "run.time", "run.signal.x")
    same(columns, "both:1", "both:2")


def matlab73(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"] = T[None, :]  # MATLAB's column of n is written as (1, n)
        file["x"] = X[None, :]
        file["#refs#/a"] = np.zeros(3)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + b" " * 8 + b"\x00\x02IM")


def test_matlab73(tmp_path):
    matlab73(tmp_path / "a.mat")
    columns = read_columns(tmp_path / "a.mat")
    assert columns.reader == "mat"
    same(columns, "t", "x")
    assert set(columns.data) == {"t", "x"}


def test_hdf5_groups_units_and_compounds(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/time"] = T
        file["run/time"].attrs["units"] = "s"
        file["run/x"] = X
        file["run/x"].attrs["unit"] = np.bytes_("µm".encode())
        table = np.zeros(50, [("t", float), ("x", float)])
        table["t"], table["x"] = T, X
        file["table"] = table
        file["label"] = "text"
    columns = read_columns(tmp_path / "a.h5")
    same(columns, "run/time", "run/x")
    same(columns, "table.t", "table.x")
    assert columns.units == {"run/time": "s", "run/x": "um"}


def test_hdf5_data_in_another_file_are_not_followed(tmp_path, refuses):
    (tmp_path / "other.bin").write_bytes(T.tobytes())
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", T.shape, float, external=[(str(tmp_path / "other.bin"), 0, T.nbytes)])
    refuses(lambda: read_columns(tmp_path / "a.h5"), "no column of numbers", "another file")


@pytest.mark.parametrize(
    ("engine", "format"), [("scipy", "NETCDF3_CLASSIC"), ("scipy", "NETCDF3_64BIT"), ("h5netcdf", "NETCDF4")]
)
def test_netcdf(tmp_path, engine, format):
    data = xarray.Dataset(
        {"x": ("time", X, {"units": "m"})}, {"time": ("time", T, {"units": "seconds since 2020-01-01"})}
    )
    data.to_netcdf(tmp_path / "a.nc", engine=engine, format=format)
    columns = read_columns(tmp_path / "a.nc")
    assert columns.reader == "netcdf"
    same(columns, "time", "x")
    assert columns.units == {"x": "m", "time": "seconds"}


def test_numpy(tmp_path, refuses):
    np.save(tmp_path / "two.npy", np.column_stack([T, X]))
    same(read_columns(tmp_path / "two.npy"), "column 1", "column 2")
    np.save(tmp_path / "wide.npy", np.stack([T, X]))
    same(read_columns(tmp_path / "wide.npy"), "column 1", "column 2")
    np.savez_compressed(tmp_path / "a.npz", t=T, x=X)
    same(read_columns(tmp_path / "a.npz"), "t", "x")
    np.save(tmp_path / "fields.npy", np.rec.fromarrays([T, X], names="t,x"))
    same(read_columns(tmp_path / "fields.npy"), "t", "x")
    np.save(tmp_path / "one.npy", X)
    assert np.array_equal(read_columns(tmp_path / "one.npy").data["column 1"], X)
    np.save(tmp_path / "objects.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    refuses(lambda: read_columns(tmp_path / "objects.npy"), "objects.npy", "pickle", "plain arrays")
    np.save(tmp_path / "complex.npy", X + 1j)
    refuses(lambda: read_columns(tmp_path / "complex.npy"), "complex numbers")


def tdms(path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        properties = {"wf_increment": 1e-3, "wf_start_offset": 0.0, "wf_samples": 50, "unit_string": "um"}
        writer.write_segment([nptdms.ChannelObject("run", "x", X, properties=properties)])


def test_tdms(tmp_path):
    tdms(tmp_path / "a.tdms")
    columns = read_columns(tmp_path / "a.tdms")
    assert np.array_equal(columns.data["x"], X)
    assert np.allclose(columns.data["time"], T, rtol=0, atol=1e-15)
    assert columns.units == {"x": "um", "x time": "s", "time": "s"}


def test_tdms_without_its_package(tmp_path, monkeypatch, refuses):
    tdms(tmp_path / "a.tdms")
    monkeypatch.setitem(sys.modules, "nptdms", None)
    refuses(lambda: read_columns(tmp_path / "a.tdms"), "nptdms", "pip install 'stickslip[tdms]'")


def cut(tmp_path, make, name):
    make(tmp_path / name)
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(whole[: len(whole) // 2])


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda p: scipy.io.savemat(p, {"t": T, "x": X}), "a.mat"),
        (matlab73, "b.mat"),
        (lambda p: h5py.File(p, "w").create_dataset("x", data=X).file.close(), "a.h5"),
        (lambda p: xarray.Dataset({"x": ("time", X)}).to_netcdf(p, engine="h5netcdf"), "a.nc"),
        (lambda p: np.savez(p, t=T, x=X), "a.npz"),
        (lambda p: np.save(p, X), "a.npy"),
    ],
)
def test_damaged_files_are_refused(tmp_path, refuses, make, name):
    cut(tmp_path, make, name)
    refuses(lambda: read_columns(tmp_path / name), name)


def test_tdms_cut_short_is_said(tmp_path):
    cut(tmp_path, tdms, "a.tdms")
    columns = read_columns(tmp_path / "a.tdms")
    size = columns.data["x"].size
    assert 0 < size < 50
    assert np.array_equal(columns.data["x"], X[:size])
    assert columns.notes == ["the file is cut short; what is there was read"]


def test_content_counts_more_than_the_ending(tmp_path):
    np.save(tmp_path / "a.npy", X)
    (tmp_path / "a.npy").rename(tmp_path / "a.csv")
    assert read_columns(tmp_path / "a.csv").reader == "numpy"


def test_a_plug_in_reader_is_found_and_broken_ones_are_left_out(tmp_path, monkeypatch):
    from importlib.metadata import EntryPoint

    from stickslip.data.readers import Columns
    from stickslip.system import registry

    class Mine:
        name, suffixes, description = "mine", (".mine",), "my own format"

        def sniff(self, path, head):
            return head.startswith(b"MINE")

        def read(self, path):
            return Columns({"x": np.frombuffer(path.read_bytes()[4:])})

    class Blind:
        name, suffixes, description, read = "blind", (".blind",), "a reader that cannot look", Mine.read

    class Failing(Mine):
        name = "failing"

        def sniff(self, path, head):
            return head[1 << 20] == 0

    class Point(EntryPoint):
        def load(self):
            if self.name == "broken":
                raise RuntimeError("no")
            return {"failing": Failing, "blind": Blind, "mine": Mine}[self.name]

    points = [Point(name, f"m:{name}", "stickslip.readers") for name in ("failing", "broken", "blind", "mine")]
    monkeypatch.setattr(registry, "entry_points", lambda group: points if group == "stickslip.readers" else [])
    monkeypatch.setattr(READERS, "_plugged", None)
    with pytest.warns(UserWarning, match="'broken' of m:broken cannot be loaded") as told:
        assert READERS.names()[-2:] == ["failing", "mine"]
    assert len(told) == 2 and "Blind" in str(told[1].message) and "add sniff" in str(told[1].message)
    (tmp_path / "a.mine").write_bytes(b"MINE" + X.tobytes())
    with pytest.warns(RuntimeWarning, match="'failing' fails on a.mine, and is passed over: IndexError"):
        columns = read_columns(tmp_path / "a.mine")
    assert columns.reader == "mine"
    assert np.array_equal(columns.data["x"], X)


def test_what_another_file_left_open_is_no_warning_of_this_one(tmp_path):
    """Found by a run of all tests: a damaged archive that numpy had not closed was collected while a file was read."""

    class Reader(NpyReader):
        def read(self, path):
            warnings.warn("unclosed file <_io.FileIO name='other.npz'>", ResourceWarning, stacklevel=1)
            warnings.warn("of this file", UserWarning, stacklevel=1)
            return super().read(path)

    np.save(tmp_path / "a.npy", X)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("stickslip.data.readers.find_reader", lambda *a: Reader())
        assert read_columns(tmp_path / "a.npy").notes == ["warning of the reader: of this file"]


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc")
def test_a_damaged_archive_is_not_left_open(tmp_path):
    (tmp_path / "a.npz").write_bytes(b"PK\x03\x04" + bytes(40))
    with pytest.raises(InputError, match="cannot be read") as kept:
        read_columns(tmp_path / "a.npz")
    assert not [p for p in Path("/proc/self/fd").iterdir() if os.path.realpath(p).endswith("a.npz")]
    assert kept.value.what  # as long as the error is kept, so is what it came from
