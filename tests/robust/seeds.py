"""Valid files of every format that is read, small, as bytes: what fuzzing starts from."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import scipy.io
import xarray

T = np.arange(40) * 1e-3
X = 1e-6 * np.sin(30 * T) + 5e-5 * T

CAMPAIGN = """\
schema = 1
title = "Steel on V-blocks"
note = 'two runs'

[rig]
mass = "89.4 g"
spring_stiffness = { guess = "1000 N/m", lower = "200 N/m", upper = "5000 N/m" }
contacts = 4
normal_force = "0.31 N"
friction_coefficient = 0.21
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
springs = 4096
temperature = "293 K"

[[trace]]
file = "a.csv"
time = { column = "time", unit = "s" }
displacement = { column = "x", unit = "um", resolution = "8 nm", wrap = "1 mm", resets = false }
drive_velocity = "50 um/s"
virgin = true
role = "train"

[[trace]]
file = "a.csv"
name = "second"
sampling_rate = "1 kHz"
displacement = { column = 2, unit = "um", file = "b.csv", time = { column = "time", unit = "s" } }
drive = [{ until = "20 ms", velocity = "50 um/s" }, { until = 0.039, velocity = 0 }]
minimum_slip = "1 um"
mass = 0.1
"""

SCENARIO = """\
schema = 1
title = "A rig"

[block]
mass = "89.4 g"
spring_stiffness = "1000 N/m"
damping = 0.5

[drive]
velocity = "50 um/s"
events = 3

[contact]
kind = "rough-line"
contacts = 4
normal_force = "0.31 N"
friction_coefficient = 0.21
line_length = "20 um"
H = 0.3
h_rms = "2.46 um"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
springs = 64
seed = 1

[weakening]
ratio = 0.85
slip_distance = "1 um"
healing_time = "20 ms"

[[effect]]
type = "contact-ageing"
rate = 0.02

[sensor]
resolution = "7.91 nm"
counter_steps = 1024
seed = 3

[solver]
relative = 1e-3

[output]
sampling_rate = "10 kHz"
trace = "trace.csv"
channels = ["displacement", "velocity"]

[sweep]
key = "drive.velocity"
start = "20 um/s"
stop = "1 mm/s"
points = 3
"""

PIECES = """\
schema = 1
[block]
mass = 0.1
spring_stiffness = 1e3
[drive]
file = "a.csv"
position = { column = "x", unit = "um" }
[contact]
kind = "power-law"
contacts = 2
normal_force = 0.3
friction_coefficient = 0.2
u_max = "1 um"
p = 3.2
bins = 16
"""


def _csv(delimiter: str, decimal: str, header: str, ending: str = "\n", encoding: str = "utf-8") -> bytes:
    rows = [delimiter.join(f"{v:.6g}".replace(".", decimal) for v in row) for row in np.column_stack([T, 1e6 * X])]
    return ending.join([header, *rows, ""]).encode(encoding)


def _uff(binary: bool) -> bytes:
    import pyuff

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "a.uff"
        pyuff.UFF(str(file)).write_sets(
            {
                "type": 58, "binary": int(binary), "func_type": 1, "id1": "displacement", "rsp_node": 1, "rsp_dir": 1,
                "ref_node": 1, "ref_dir": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s",
                "abscissa_spacing": 1, "ordinate_spec_data_type": 8, "ordinate_axis_units_lab": "m",
                "orddenom_spec_data_type": 0, "x": T, "data": X,
            }
        )  # fmt: skip
        return file.read_bytes()


def _made(name: str, write: Callable[[Path], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        content = (Path(folder) / name).read_bytes()
    # scipy writes the date into the head
    return b"MATLAB 5.0 MAT-file".ljust(116) + content[116:] if content.startswith(b"MATLAB 5.0") else content


def _hdf(path: Path, **options: object) -> None:
    with h5py.File(path, "w") as file:
        for name, values, unit in (("run/time", T, "s"), ("run/x", 1e6 * X, "um")):
            file.create_dataset(name, data=values, **options).attrs["units"] = unit
        file["label"] = "text"
        file["link"] = h5py.SoftLink("/run/x")


def _mat73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file["time"], file["x"] = T[None, :], 1e6 * X[None, :]
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + b" " * 8 + b"\x00\x02IM")


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("g", "time", T, {"unit_string": "s"}),
                ChannelObject("g", "x", 1e6 * X, {"unit_string": "um", "wf_increment": 1e-3}),
            ]
        )


def seeds() -> list[tuple[str, bytes]]:
    """File name and content of valid measurements."""
    data = {"time": T, "x": 1e6 * X}
    netcdf = xarray.Dataset({"x": ("time", 1e6 * X, {"units": "um"})}, {"time": ("time", T, {"units": "s"})})
    formats = {"3.nc": ("scipy", "NETCDF3_CLASSIC"), "364.nc": ("scipy", "NETCDF3_64BIT"), "4.nc": ("h5netcdf", None)}
    found = [
        ("comma.csv", _csv(",", ".", "time [s],x [um]")),
        ("semicolon.csv", _csv(";", ",", '"time";"x"', "\r\n")),
        ("tab.txt", _csv("\t", ".", "# time\tx")),
        ("blank.dat", _csv("  ", ".", "time  x")),
        ("latin.csv", _csv(";", ".", "Zeit [s];Weg [µm]", encoding="latin-1")),
        ("wide.csv", _csv(",", ".", "time,x", encoding="utf-16")),
        ("5.mat", _made("5.mat", lambda p: scipy.io.savemat(p, data | {"s": {"a": T, "t": "text"}, "c": 1.0}))),
        ("5z.mat", _made("5z.mat", lambda p: scipy.io.savemat(p, data, do_compression=True))),
        ("4.mat", _made("4.mat", lambda p: scipy.io.savemat(p, data, format="4"))),
        ("73.mat", _made("73.mat", _mat73)),
        ("a.h5", _made("a.h5", _hdf)),
        ("chunked.h5", _made("c.h5", lambda p: _hdf(p, chunks=(16,), compression="gzip", fletcher32=True))),
        *((n, _made(n, lambda p, e=e, f=f: netcdf.to_netcdf(p, engine=e, format=f))) for n, (e, f) in formats.items()),
        ("a.npy", _made("a.npy", lambda p: np.save(p, np.column_stack([T, 1e6 * X])))),
        ("f.npy", _made("f.npy", lambda p: np.save(p, np.asfortranarray(np.column_stack([T, X])).astype(">f4")))),
        ("a.npz", _made("a.npz", lambda p: np.savez(p, **data))),
        ("z.npz", _made("z.npz", lambda p: np.savez_compressed(p, **data))),
        ("a.json", json.dumps({k: np.asarray(v).tolist() for k, v in data.items()}).encode()),
        ("text.uff", _uff(False)),
        ("binary.uff", _uff(True)),
    ]
    with suppress(ImportError):
        found.append(("a.tdms", _made("a.tdms", _tdms)))
    return found


def tables() -> list[tuple[str, bytes]]:
    """File name and content of valid campaigns and scenarios; they use the files ``a.csv`` and ``b.csv``."""
    texts = {"campaign.toml": CAMPAIGN, "scenario.toml": SCENARIO, "scenario-pieces.toml": PIECES}
    return [(name, text.encode()) for name, text in texts.items()]


def beside() -> dict[str, bytes]:
    """Files that the tables use."""
    return {"a.csv": _csv(",", ".", "time,x"), "b.csv": _csv(",", ".", "time,x")}
