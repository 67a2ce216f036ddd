"""Reading files of instruments: found by what they begin with, then by their ending.

Another format is added by a package that offers a `Reader` class in the entry point group ``stickslip.readers``.
"""

from __future__ import annotations

import warnings
from pathlib import Path

from ...errors import InputError, nearest
from ...system.registry import Registry
from .base import HEAD_BYTES, PARTS, Columns, Reader, split_unit
from .hdf import HdfReader
from .json_arrays import JsonReader
from .mat import MatReader
from .netcdf import NetcdfReader
from .npy import NpyReader
from .tdms import TdmsReader
from .text import TextReader
from .uff import UffReader

__all__ = ["READERS", "Columns", "Reader", "beside", "find_reader", "read_columns", "split_unit", "supported"]


def accept(loaded: object) -> Reader:
    """A plug-in's reader, made where it is a class.

    Raises:
        InputError: what it lacks.
    """
    reader = loaded() if isinstance(loaded, type) else loaded
    lacking = [part for part in PARTS if not hasattr(reader, part)]
    if lacking:
        raise InputError("a reader is not complete", value=type(reader).__name__, hint=f"add {', '.join(lacking)}")
    return reader  # type: ignore[return-value]


READERS: Registry[Reader] = Registry("stickslip.readers", "reader", accept)
# a file that many could read goes to the first: NetCDF and MATLAB 7.3 are HDF5 too, and text is the last resort
for _class in (NetcdfReader, MatReader, HdfReader, NpyReader, TdmsReader, UffReader, JsonReader):
    _reader: Reader = _class()
    READERS.register(_reader.name, _reader)
_TEXT: Reader = TextReader()


def supported() -> str:
    """The formats that can be read, for a message."""
    readers: list[Reader] = [reader for _, reader in READERS.items()]
    readers.append(_TEXT)
    return "; ".join(f"{reader.description}: {' '.join(reader.suffixes)}" for reader in readers)


def _knows(reader: Reader, path: Path, head: bytes) -> bool:
    """Whether a reader takes a file; one that fails while it looks must not keep the others from it."""
    try:
        return reader.sniff(path, head)
    except Exception as error:  # whatever a foreign reader raises
        said = f"the reader '{reader.name}' fails on {path.name}, and is passed over: {error!r}"
        warnings.warn(said, RuntimeWarning, stacklevel=2)
        return False


def beside(path: Path) -> list[str]:
    """Names of files in the same folder that may hold a record, by their endings; hidden ones do not."""
    if not path.parent.is_dir():
        return []
    endings = {ending for reader in (*READERS.values(), _TEXT) for ending in reader.suffixes}
    files = (p for p in path.parent.iterdir() if p.is_file() and p.name[0] != ".")
    return [p.name for p in files if p.suffix.lower() in endings]


def find_reader(path: str | Path, name: str | None = None) -> Reader:
    """The reader of a file, by name or by its content.

    Raises:
        InputError: no such file, an empty file, or no reader knows it (the message lists the formats).
    """
    path = Path(path)
    if not path.exists():
        others = beside(path)
        raise InputError("the file is not there", file=path, hint=nearest(path.name, others) if others else None)
    if not path.is_file():
        raise InputError("not a file", file=path)
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"the file cannot be opened ({error.strerror})", file=path) from None
    if not head.strip():
        raise InputError("the file is empty", file=path, hint="export it again")
    if name is not None:
        return _TEXT if name == _TEXT.name else READERS.find(name)
    for _, reader in READERS.items():
        if _knows(reader, path, head):
            return reader
    if _TEXT.sniff(path, head):
        return _TEXT
    if path.suffix.lower() in _TEXT.suffixes:
        what = "it has the ending of a text table but holds binary data"
        raise InputError(what, file=path, allowed=supported(), hint="give it its right ending, or export it as text")
    hint = "export it in one of these, as CSV for one, or add a reader for it (see the documentation)"
    raise InputError("the format of the file is not known", file=path, allowed=supported(), hint=hint)


def read_columns(path: str | Path, name: str | None = None) -> Columns:
    """Read all columns of numbers of a file, as written there.

    Args:
        path: the file.
        name: name of a reader, to overrule what the file looks like.

    Raises:
        InputError: the file cannot be read.
    """
    path = Path(path)
    reader = find_reader(path, name)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", ResourceWarning)  # of whatever is collected meanwhile: another file's, perhaps
        columns = reader.read(path)
    columns.notes += list(dict.fromkeys(f"warning of the reader: {w.message}" for w in caught))
    columns.reader = reader.name
    return columns
