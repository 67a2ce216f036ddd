"""HDF5 files: every numeric data set, named by its path, with the unit its attributes give."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import InputError
from .base import Columns, add_array, need_columns
from .guarded_reading import guard

_MAGIC = b"\x89HDF\r\n\x1a\n"
_UNIT_KEYS = ("units", "unit", "Units", "Unit", "UNITS")


class HdfReader:
    """HDF5."""

    name = "hdf5"
    suffixes: tuple[str, ...] = (".h5", ".hdf5", ".hdf", ".he5")
    description = "HDF5"

    def sniff(self, path: Path, head: bytes) -> bool:
        return head.startswith(_MAGIC) or head[512:520] == _MAGIC

    def read(self, path: Path) -> Columns:
        return read_hdf(path)


def read_hdf(path: Path, skip: tuple[str, ...] = ()) -> Columns:
    """Numeric data sets of an HDF5 file, without groups named in ``skip``. Links out of the file are not followed."""
    import h5py

    columns = Columns({})
    guard(path, "hdf5")

    def take(name: str, item: Any) -> None:
        if name.startswith(skip) or not isinstance(item, h5py.Dataset) or item.shape in (None, ()):
            return
        if item.external or item.is_virtual:
            columns.ignored[name] = "its numbers lie in another file"
            return
        add_array(columns, name, item[()], _unit(item.attrs))

    try:
        with h5py.File(path, "r") as file:
            file.visititems(take)
    except Exception as error:  # a damaged file makes h5py raise many kinds, and numpy where a size is absurd
        hint = "was the file closed when written?"
        raise InputError(f"not a readable HDF5 file ({error})", file=path, hint=hint) from None
    return need_columns(columns, path)


def _unit(attributes: Any) -> str | None:
    for key in _UNIT_KEYS:
        if key in attributes:
            value = attributes[key]
            value = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
            return value if isinstance(value, str) else None
    return None
