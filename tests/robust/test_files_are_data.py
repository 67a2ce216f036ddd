"""A file is data: nothing in it is run, nothing outside its folder is followed unsaid, nothing of it becomes HTML."""

from __future__ import annotations

import json
import pickle
import re
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import xarray

from stickslip.cli import run
from stickslip.data.readers import read_columns
from stickslip.errors import InputError
from stickslip.system.units import to_si

from .seeds import SCENARIO, T, X, beside

PACKAGE = Path(__file__).parents[2] / "stickslip"


class Bomb:
    """Makes a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = str(mark)

    def __reduce__(self):
        return (open, (self.mark, "w"))


@pytest.mark.parametrize("ending", [".npy", ".npz", ".mat", ".csv", ".h5"])
def test_a_pickle_is_not_loaded(tmp_path, ending):
    mark, path = tmp_path / "mark", tmp_path / f"a{ending}"
    bomb = np.array([Bomb(mark), 1.0], object)
    if ending == ".npz":
        np.savez(path, x=bomb, allow_pickle=True)
    elif ending == ".npy":
        np.save(path, bomb, allow_pickle=True)
    else:
        path.write_bytes(pickle.dumps(Bomb(mark)))
    with pytest.raises(InputError):
        read_columns(path)
    assert not mark.exists()
    # the bomb is live
    pickle.loads(pickle.dumps(Bomb(mark)))  # noqa: S301
    assert mark.exists()


def test_the_package_itself_neither_evaluates_nor_unpickles():
    """Text of files could only be run by these; user's effects, which are code, go through importlib."""
    forbidden = (
        r"(?<![\w.])(?:eval|exec|compile)\(|pickle\.loads?\(|allow_pickle=True|os\.system|shell=True|yaml\.load\("
    )
    found = {
        str(path.relative_to(PACKAGE)): hits
        for path in PACKAGE.rglob("*.py")
        if (hits := re.findall(forbidden, path.read_text(encoding="utf-8")))
    }
    assert found == {}


@pytest.mark.parametrize("text", ["9**9**9 s", "((9**99)**99)**99 s", "9**(99*99*99*99) s", "9⁹⁹⁹ s", "9**1e9 s"])
def test_a_quantity_cannot_keep_the_program_busy(text):
    with pytest.raises(InputError):
        to_si(text, "s")


@pytest.mark.parametrize(
    ("text", "unit", "value"), [("10^-6 m", "m", 1e-6), ("2 m**0.5", "m**0.5", 2), ("3 m³", "m**3", 3)]
)
def test_and_powers_of_units_still_can_be_written(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value)


@pytest.fixture
def elsewhere(tmp_path):
    """Numbers outside the folder ``inside``."""
    (tmp_path / "inside").mkdir()
    (tmp_path / "raw.bin").write_bytes(X.tobytes())
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["secret"] = X
    return tmp_path / "inside"


@pytest.mark.parametrize("ending", [".h5", ".nc", ".mat"])
@pytest.mark.parametrize("how", ["link", "soft", "external", "virtual"])
def test_numbers_in_another_file_are_not_followed(elsewhere, ending, how):
    path = elsewhere / f"a{ending}"
    if ending == ".nc":
        xarray.Dataset({"x": ("time", X)}, {"time": ("time", T)}).to_netcdf(path, engine="h5netcdf")
    if ending == ".mat":
        h5py.File(path, "w", userblock_size=512).close()
    with h5py.File(path, "a") as file:
        if ending != ".nc":
            file["x"], file["time"] = X, T
        if how in ("link", "soft"):
            file["link"] = h5py.ExternalLink("../other.h5", "/secret")
            if how == "soft":
                file["secret"] = h5py.SoftLink("/link")
        elif how == "external":
            file.create_dataset("secret", X.shape, float, external=[(str(elsewhere.parent / "raw.bin"), 0, X.nbytes)])
        else:
            layout = h5py.VirtualLayout(X.shape, float)
            layout[:] = h5py.VirtualSource("../other.h5", "secret", X.shape)
            file.create_virtual_dataset("secret", layout)
        if how == "link" and ending != ".mat":  # and the file by itself would follow it
            assert np.array_equal(file["link"][()], X)
    if ending == ".mat":
        head = b"MATLAB 7.3 MAT-file".ljust(116) + b" " * 8 + b"\x00\x02IM"
        with path.open("r+b") as stream:
            stream.write(head)
    assert set(read_columns(path).data) == {"x", "time"}


@pytest.mark.parametrize("name", ["../a.csv", "{absolute}", "link.csv", "sub/../../a.csv"])
def test_a_campaign_does_not_leave_its_folder_unsaid(tmp_path, capsys, name):
    inside = tmp_path / "inside"
    (inside / "sub").mkdir(parents=True)
    (tmp_path / "a.csv").write_bytes(beside()["a.csv"])
    (inside / "link.csv").symlink_to(tmp_path / "a.csv")
    file = name.format(absolute=tmp_path / "a.csv")
    text = (
        f'schema = 1\n[rig]\n[[trace]]\nfile = "{file}"\ntime = {{ column = "time", unit = "s" }}\n'
        'displacement = { column = "x", unit = "um" }\ndrive_velocity = "50 um/s"\n'
    )
    (inside / "c.toml").write_text(text)
    assert run(["inspect", str(inside / "c.toml")]) == 2
    assert "outside the campaign's folder" in capsys.readouterr().err
    (inside / "c.toml").write_text(text + "outside = true\n")
    assert run(["inspect", str(inside / "c.toml"), "--json"]) == 0
    assert "outside the campaign folder" in capsys.readouterr().out


@pytest.mark.slow
def test_a_scenario_says_what_it_reads_from_outside(tmp_path, capsys):
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "a.csv").write_bytes(beside()["a.csv"])
    drive = 'file = "../a.csv"\nposition = { column = "x", unit = "um" }\n'
    text = SCENARIO[: SCENARIO.index("[sensor]")].replace('velocity = "50 um/s"\nevents = 3\n', drive)
    (inside / "s.toml").write_text(text[: text.index("[[effect]]")])
    assert run(["simulate", str(inside / "s.toml")]) == 0
    assert "../a.csv lies outside the scenario's folder" in capsys.readouterr().err


def test_a_static_curve_says_it_too_and_records_the_file(tmp_path, capsys):
    inside = tmp_path / "inside"
    inside.mkdir()
    table = np.column_stack([np.arange(256) * 1e-7, np.random.default_rng(1).normal(0, 1e-6, 256)])
    np.savetxt(tmp_path / "line.csv", table, delimiter=",", header="x,z", comments="")
    contact = """kind = "heights"
file = "../line.csv"
position = { column = "x", unit = "m" }
height = { column = "z", unit = "m" }
contacts = 4
normal_force = "0.31 N"
friction_coefficient = 0.21
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
"""
    start, stop = SCENARIO.index('kind = "rough-line"'), SCENARIO.index("[weakening]")
    (inside / "s.toml").write_text(SCENARIO[:start] + contact + SCENARIO[stop : SCENARIO.index("[[effect]]")])
    assert run(["creep", str(inside / "s.toml"), "--out", str(tmp_path / "out")]) == 0
    assert "../line.csv lies outside the scenario's folder" in capsys.readouterr().err
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert [Path(i["file"]).name for i in result["inputs"]] == ["s.toml", "line.csv"]


def test_an_effect_file_is_run_only_when_named(tmp_path, capsys):
    """Neither its presence beside the file nor its name in it runs it."""
    mark = tmp_path / "mark"
    (tmp_path / "my_effect.py").write_text(f"open({str(mark)!r}, 'w')\n")
    text = SCENARIO[: SCENARIO.index("[sensor]")]
    for kind in ("my-effect", "my_effect", "my_effect.py", "./my_effect.py"):
        (tmp_path / "s.toml").write_text(text.replace("contact-ageing", kind))
        assert run(["creep", str(tmp_path / "s.toml")]) == 2
    assert not mark.exists()
    (tmp_path / "s.toml").write_text(text)
    run(["simulate", str(tmp_path / "s.toml"), "--effect", str(tmp_path / "my_effect.py"), "--sweep", "nothing"])
    assert mark.exists()
    capsys.readouterr()


EVIL = "<script>alert(1)</script><img src=x onerror=alert(2)>\"'&"


def test_the_report_escapes_what_came_from_files(tmp_path, capsys):
    rows = "\n".join(f"{t:.6g},{1e6 * x:.6g}" for t, x in zip(T, X, strict=True))
    (tmp_path / "a.csv").write_text(f"time,{EVIL.replace(',', '')}\n{rows}\n")
    name = EVIL.replace("\\", "\\\\").replace('"', '\\"')
    (tmp_path / "c.toml").write_text(
        f'schema = 1\ntitle = "{name}"\nnote = "{name}"\n[rig]\nnote = "{name}"\n[[trace]]\nfile = "a.csv"\n'
        f'name = "{name}"\ntime = {{ column = "time", unit = "s" }}\ndisplacement = {{ column = 2, unit = "um" }}\n'
        'drive_velocity = "50 um/s"\n'
    )
    assert run(["inspect", str(tmp_path / "c.toml"), "--out", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "&lt;script&gt;alert(1)" in page
    assert "<script>alert" not in page
    assert "<img src=x" not in page
    assert "<script" in (tmp_path / "out" / "result.json").read_text()  # data stay as they are
    capsys.readouterr()


def test_matlab_text_is_no_code(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"x": X, "code": "__import__('os').abort()"})
    assert set(read_columns(tmp_path / "a.mat").data) == {"x"}
