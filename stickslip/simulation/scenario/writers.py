"""Simulated runs as files of an instrument, with the campaign file that describes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...system.units import shown
from .contact_tables import ElasticTable, RoughLineTable
from .load import Scenario

if TYPE_CHECKING:
    import xarray

    from .recording import Recording

    Run = xarray.Dataset | Recording

Array = np.ndarray
_UNITS = {
    "mass": "kg", "spring_stiffness": "N/m", "normal_force": "N", "youngs_modulus": "Pa", "line_length": "m",
}  # fmt: skip
# channel -> variable of the data set, unit in the file, its factor to SI
CHANNELS = {
    "displacement": ("reading", "um", 1e-6),
    "velocity": ("velocity", "mm/s", 1e-3),
    "spring_force": ("spring_force", "mN", 1e-3),
    "drive_position": ("drive_position", "um", 1e-6),
}
CAMPAIGN = "campaign.toml"
DIGITS = 15  # of the largest value of a column, in text
SMALLEST = 1e-250


def write_trace(path: str | Path, columns: Mapping[str, tuple[Array, str]]) -> Path:
    """Write named columns as CSV, NetCDF, MAT or a universal file (data set 58), by the file's ending.

    Args:
        path: the file; its folder is there.
        columns: name -> values (n,) and unit text; the first is the time in s.

    Raises:
        InputError: an ending that is not known.
    """
    path = Path(path)
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise InputError("unknown ending of a trace", file=path, allowed=" ".join(_WRITERS))
    writer(path, columns)
    return path


def write_campaign(folder: str | Path, scenarios: Sequence[Scenario], runs: Sequence[Run]) -> Path:
    """Write the synthetic measurement of every run, as its scenario's ``[output]`` asks, and ``campaign.toml``.

    Args:
        folder: where the files go; it is there.
        scenarios, runs: one data set of `simulate` for each; all of one rig.

    Returns:
        The campaign file. It knows what a careful experimenter knows: the rig, the drive, the sensor's count and its
        clears; nothing of the sensor's errors.
    """
    folder = Path(folder)
    first = scenarios[0]
    rig = _rig(first)
    lines = ["schema = 1", f"title = {_text(first.title)}", 'note = "simulated"', "", "[rig]"]
    lines += [f"{key} = {_value(key, value)}" for key, value in rig.items()]
    for number, (scenario, run) in enumerate(zip(scenarios, runs, strict=True), start=1):
        output = scenario.file.output
        name = output.trace or "trace.csv"
        if len(runs) > 1:
            stem = Path(name)
            name = f"{stem.stem}-{number:02d}{stem.suffix}"
        columns = {"time": (run["time"].values, "s")}
        for channel in output.channels:
            variable, unit, factor = CHANNELS[channel]
            columns[channel] = (run[variable].values / factor, unit)
        write_trace(folder / name, columns)
        own = {key: value for key, value in _rig(scenario).items() if rig.get(key) != value}
        lines += ["", *_entry(name, scenario, run), *(f"{key} = {_value(key, value)}" for key, value in own.items())]
    path = folder / CAMPAIGN
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _rig(scenario: Scenario) -> dict[str, Any]:
    block, contact = scenario.file.block, scenario.file.contact
    every = range(contact.contacts)
    rig: dict[str, Any] = {
        "mass": block.mass,
        "spring_stiffness": block.spring_stiffness,
        "contacts": contact.contacts,
        "normal_force": float(np.mean([contact.of(i, "normal_force") for i in every])),
        "friction_coefficient": float(np.mean([contact.of(i, "friction_coefficient") for i in every])),
    }
    if isinstance(contact, ElasticTable):
        rig |= {"youngs_modulus": contact.youngs_modulus, "poisson_ratio": contact.poisson_ratio}
    if isinstance(contact, RoughLineTable):
        rig |= {"line_length": contact.line_length, "springs": contact.springs}
    return rig


def _entry(name: str, scenario: Scenario, run: Run) -> list[str]:
    file = scenario.file
    lines = ["[[trace]]", f"file = {_text(name)}", 'time = { column = "time", unit = "s" }']
    for channel in file.output.channels:
        parts = [f'column = "{channel}"', f'unit = "{CHANNELS[channel][1]}"']
        if channel == "displacement" and file.sensor is not None:
            parts += _counter(file.sensor, run)
        lines.append(f"{channel} = {{ {', '.join(parts)} }}")
    if "drive_position" not in file.output.channels:
        lines.append(_drive(scenario))
    lines.append(f"virgin = {'true' if file.contact.residual == 0 else 'false'}")
    return lines


def _counter(sensor: Any, run: Run) -> list[str]:
    if not sensor.resolution:
        return []
    parts = [f"resolution = {_quantity(sensor.resolution, 'm')}"]
    if sensor.counter_steps:
        parts.append(f"wrap = {_quantity(sensor.counter_steps * sensor.resolution, 'm')}")
    if sensor.clear_at_arrest and run.sizes["event"]:
        parts.append(f"resets = {[float(t) for t in run['arrest'].values]!r}")
    return parts


def _drive(scenario: Scenario) -> str:
    drive = scenario.file.drive
    if drive.velocity is not None:
        return f"drive_velocity = {_quantity(drive.velocity, 'm/s')}"
    from .drive import load_point

    motion = load_point(drive, scenario.folder)
    pieces = (
        f"{{ until = {_text(f'{t:.12g} s')}, velocity = {_quantity(v, 'm/s')} }}"
        for t, v in zip(motion.times[1:].tolist(), motion.velocities.tolist(), strict=True)
    )
    return f"drive = [{', '.join(pieces)}]"


def _value(key: str, value: Any) -> str:
    return _quantity(value, _UNITS[key]) if key in _UNITS else repr(value)


def _quantity(value: float, unit: str) -> str:
    """A quantity as a person would write it into the file, in letters that are on every keyboard."""
    return _text(shown(value, unit, 10).replace("µ", "u"))


def _text(value: str) -> str:
    import json

    return json.dumps(value, ensure_ascii=False)


def _csv(path: Path, columns: Mapping[str, tuple[Array, str]]) -> None:
    """Text that a reader turns into the same numbers, but for the last digit of the largest."""
    import pyarrow
    from pyarrow.csv import WriteOptions, write_csv

    header = ",".join(f"{name} [{unit}]" for name, (_, unit) in columns.items())
    table = pyarrow.table({name: _rounded(np.asarray(values, float)) for name, (values, _) in columns.items()})
    with path.open("wb") as file:
        file.write(f"{header}\n".encode())
        write_csv(table, file, WriteOptions(include_header=False))


def _rounded(values: Array) -> Array:
    largest = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
    if largest < SMALLEST:  # tens to the power of more than 308 are none
        return values
    return np.round(values, DIGITS - int(np.ceil(np.log10(largest))))


def _netcdf(path: Path, columns: Mapping[str, tuple[Array, str]]) -> None:
    import xarray

    data = {name: ("sample", values, {"units": unit}) for name, (values, unit) in columns.items()}
    xarray.Dataset(data).to_netcdf(path, engine="h5netcdf")


def _mat(path: Path, columns: Mapping[str, tuple[Array, str]]) -> None:
    from scipy.io import savemat

    content: dict[str, Any] = {name: values for name, (values, _) in columns.items()}
    savemat(path, content | {"units": ", ".join(f"{name} {unit}" for name, (_, unit) in columns.items())})


def _uff(path: Path, columns: Mapping[str, tuple[Array, str]]) -> None:
    import pyuff

    (time, _), *_ = columns.values()
    path.unlink(missing_ok=True)
    file = pyuff.UFF(str(path))
    for name, (values, unit) in list(columns.items())[1:]:
        file.write_sets(_set_58(pyuff, name, unit, time, values), "add")


def _set_58(pyuff: Any, name: str, unit: str, time: Array, values: Array) -> dict[str, Any]:
    """A binary data set 58 of doubles with every abscissa written, because a header rounds the time step."""
    found = pyuff.prepare_58(
        binary=1,
        func_type=1,
        rsp_node=1,
        rsp_dir=1,
        ref_node=1,
        ref_dir=1,
        data=np.asarray(values, float),
        x=np.asarray(time, float),
        id1=name,
        rsp_ent_name="block",
        ref_ent_name="base",
        abscissa_spacing=0,
        abscissa_spec_data_type=17,
        ordinate_spec_data_type=8,
        abscissa_axis_units_lab="s",
        ordinate_axis_units_lab=unit,
        orddenom_spec_data_type=0,
    )
    return dict(found) | {"ord_data_type": 4}


_WRITERS: dict[str, Callable[[Path, Mapping[str, tuple[Array, str]]], None]] = {
    ".csv": _csv,
    ".nc": _netcdf,
    ".mat": _mat,
    ".uff": _uff,
}
