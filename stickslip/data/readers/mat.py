"""MATLAB files: versions 4 to 7 by scipy, 7.3 (an HDF5 file with a MATLAB preamble) by h5py."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import InputError
from .base import Columns, add_array, need_columns, reading
from .guarded_reading import guard
from .hdf import read_hdf

HINT = "save it again with -v7"
_MOST_CELLS = 1000  # of a cell array


class MatReader:
    """MATLAB .mat of every version."""

    name = "mat"
    suffixes: tuple[str, ...] = (".mat",)
    description = "MATLAB .mat (4, 5, 6, 7 and 7.3)"

    def sniff(self, path: Path, head: bytes) -> bool:
        return head.startswith(b"MATLAB ") or (path.suffix.lower() == ".mat" and not head.startswith(b"\x89HDF"))

    def read(self, path: Path) -> Columns:
        with path.open("rb") as stream:
            head = stream.read(1024)
        if head.startswith(b"MATLAB 7.3") or b"\x89HDF\r\n\x1a\n" in head:
            return read_hdf(path, skip=("#refs#", "#subsystem#"))
        import scipy.io

        raised = guard(path, "mat")
        if raised:
            raise InputError(f"not a readable MATLAB file ({raised})", file=path, hint=HINT)
        with reading("MATLAB", path, hint=HINT):
            content = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
        columns = Columns({})
        for name, value in content.items():
            if not name.startswith("__"):
                _add(columns, name, value)
        return need_columns(columns, path)


def _add(columns: Columns, name: str, value: object, depth: int = 0) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is not None and depth < 8:
        for part in fields:
            _add(columns, f"{name}.{part}", getattr(value, part), depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype == object and depth < 8:  # a cell or a struct array
        for number, item in enumerate(value.ravel()[:_MOST_CELLS], start=1):
            _add(columns, f"{name}:{number}", item, depth + 1)
        if value.size > _MOST_CELLS:
            columns.notes.append(f"of the {value.size} cells of '{name}' the first {_MOST_CELLS} were read")
    elif not isinstance(value, str):
        add_array(columns, name, value)
