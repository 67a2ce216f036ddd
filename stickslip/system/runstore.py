"""Run folders: written aside and renamed, so that a folder is there as a whole or not at all.

While a run writes, its files lie in ``NAME.partial`` beside the folder, held by a lock that dies with the process. A
crash leaves the partial folder; the next run into the same name continues it (``resume=True``) or starts anew.
"""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Protocol, TextIO

from ..errors import InputError, RunFolderError

RESULT = "result.json"
_FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
_DISK = (*_FULL, errno.EROFS, errno.EACCES)
PACKAGES = ("stickslip", "numpy", "scipy", "jax", "diffrax", "equinox", "xarray")


class Arrays(Protocol):
    """An `xarray.Dataset`, or what writes the same file."""

    @property
    def variables(self) -> Mapping[Any, Any]:
        """Name -> what has the ``values``."""

    def to_netcdf(self, path: Any, *, engine: Any) -> Any:
        """Write it as NetCDF."""


class Run:
    """A run folder while it is written.

    Attributes:
        folder: where files go for now.
        target: what it will be called.
        resumed: whether files of an interrupted run were found in it.
    """

    def __init__(self, folder: Path, target: Path, resumed: bool) -> None:
        self.folder, self.target, self.resumed = folder, target, resumed

    def clear(self, kept: str) -> None:
        """Remove all that an interrupted run left behind but the folder ``kept``."""
        for path in self.folder.iterdir():
            if path.is_dir() and path.name != kept:
                shutil.rmtree(path)
            elif path.is_file():
                path.unlink()

    def path(self, name: str) -> Path:
        """Where a file of this name is written; its folder is made."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def json(self, content: Mapping[str, Any], name: str = RESULT) -> Path:
        """Write a JSON file, aside and renamed; numbers that are not finite become null."""
        return self.text(json_text(content) + "\n", name)

    def text(self, content: str, name: str) -> Path:
        """Write a text file, aside and renamed."""
        return write_aside(self.path(name), content)

    def arrays(self, data: Arrays, name: str = "arrays.nc") -> Path:
        """Write a data set as NetCDF."""
        path = self.path(name)
        aside = path.with_name(path.name + ".part")
        values = [variable.values for variable in data.variables.values()]
        _reserve(aside, sum(v.nbytes for v in values) + 8192 * (len(values) + 4))
        data.to_netcdf(aside, engine="h5netcdf")
        return aside.replace(path)


def write_aside(path: Path, content: str | bytes) -> Path:
    """Write a file aside and rename it, so that it is there whole or not at all; an error leaves nothing behind."""
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with aside.open("wb") as stream:
            stream.write(content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content)
            stream.flush()
            os.fsync(stream.fileno())
        return aside.replace(path)
    except OSError as error:  # writing, unlike opening, does not say what was written
        _remove(aside)
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    except BaseException:
        _remove(aside)
        raise


def _remove(path: Path) -> None:
    with suppress(OSError):  # what went wrong before is what is told
        path.unlink(missing_ok=True)


def is_of_the_disk(error: BaseException | None) -> bool:
    """Whether an error is there because a disk is full, read-only or shut, and not because of what was to be done."""
    if error is None:
        return False
    return (isinstance(error, OSError) and error.errno in _DISK) or is_of_the_disk(error.__cause__)


@contextmanager
def alone(target: Path) -> Iterator[None]:
    """Nobody else may work on a folder meanwhile.

    Raises:
        RunFolderError: somebody does, or the lock cannot be made.
    """
    with ExitStack() as held:
        with _speaking(target):  # of the lock only: what goes wrong in the work is no fault of the folder
            held.enter_context(_locked(target))
        yield


def _reserve(path: Path, size: int) -> None:
    """Ask for the room before HDF5 does: on a full disk its library speaks through tracebacks of its own."""
    with path.open("wb") as stream:
        if hasattr(os, "posix_fallocate"):
            try:
                os.posix_fallocate(stream.fileno(), 0, size)
            except OSError as error:
                if error.errno in _FULL:
                    raise OSError(error.errno, error.strerror, str(path)) from None


@contextmanager
def open_run(target: str | Path, *, force: bool = False, resume: bool = False) -> Iterator[Run]:
    """Write a run folder; it appears under its name when the block ends without an error.

    Args:
        target: the folder.
        force: replace an existing run folder (one with a ``result.json``; nothing else is ever replaced).
        resume: go on with what an interrupted run left behind instead of removing it, and leave files after an error.

    Raises:
        RunFolderError: it exists, another run is writing it, or the disk is read-only or full.
    """
    target = _itself(Path(target))
    name = target.name
    if not name:
        raise RunFolderError("not a name for a run folder", file=target)
    _refuse_existing(target, force)
    partial = target.with_name(f"{name}.partial")
    with _speaking(target), _locked(target):
        _recover(target)
        _refuse_existing(target, force)
        resumed = resume and partial.is_dir()
        if partial.exists() and not resumed:
            shutil.rmtree(partial)
        partial.mkdir(parents=True, exist_ok=True)
        for half in partial.rglob("*.part"):  # of a process that was killed while it wrote
            half.unlink()
        try:
            yield Run(partial, target, resumed)
        except BaseException:
            if not resume or not any(path.is_file() for path in partial.rglob("*")):
                shutil.rmtree(partial, ignore_errors=True)
            raise
        _rename(partial, target)


def refuse_existing(target: Path | None, force: bool) -> None:
    """Say early, before long work, that a folder cannot be written (None: that nothing is to be written into one).

    Raises:
        RunFolderError: it exists, unless it is an empty folder, or a run folder and ``force``; or nobody can write
            where it would lie.
    """
    if target is None:
        return
    target = _itself(target)
    _refuse_existing(target, force)
    home = next((folder for folder in target.absolute().parents if folder.exists()), target)
    try:
        with tempfile.TemporaryFile(dir=home):
            pass
    except OSError as error:
        what = f"the run folder cannot be written: nothing can be, into {home} ({error.strerror or error})"
        raise RunFolderError(what, file=target, hint="choose another --out") from error
    if _lock(target).exists():  # of a run that is at work, or of one that was killed
        with _locked(target):
            pass


def _itself(target: Path) -> Path:
    """The folder that is locked and written: what a link leads to, and a name where there is none."""
    return target.resolve() if target.is_symlink() or target.name in ("", "..", ".") else target


def _refuse_existing(target: Path, force: bool) -> None:
    if not target.exists() or (target.is_dir() and not any(target.iterdir())):
        return
    if not target.is_dir():
        raise RunFolderError("the run folder's name is taken by a file", file=target, hint="choose another --out")
    if not (target / RESULT).is_file():
        what = "the folder exists and is no run folder (it holds no result.json), so it is left alone"
        raise RunFolderError(what, file=target, hint="choose another --out")
    if not force:
        hint = "choose another --out, or replace it with --force"
        raise RunFolderError("the run folder exists already", file=target, hint=hint)


def _replaced(target: Path) -> Path:
    return target.with_name(f".{target.name}.replaced")


def _recover(target: Path) -> None:
    """Bring back the older folder where a run died while it was replacing it."""
    old = _replaced(target)
    if old.is_dir() and not target.exists():
        old.replace(target)
    elif old.is_dir():
        shutil.rmtree(old)


def _rename(partial: Path, target: Path) -> None:
    old = _replaced(target)
    if target.exists():
        target.replace(old)
    partial.replace(target)
    if old.exists():
        shutil.rmtree(old)


@contextmanager
def _speaking(target: Path) -> Iterator[None]:
    """Turn the system's errors about this folder into one message."""
    try:
        yield
    except OSError as error:
        where = Path(error.filename) if isinstance(error.filename, (str, Path)) else target
        home = target.resolve().parent
        if error.filename is not None and not where.resolve().is_relative_to(home):
            raise
        reason = error.strerror or str(error)
        hint = "choose another --out, or make room"
        raise RunFolderError(f"the run folder cannot be written ({reason})", file=target, hint=hint) from error


def _lock(target: Path) -> Path:
    return target.with_name(f".{target.name}.lock")


@contextmanager
def _locked(target: Path) -> Iterator[None]:
    """Hold the lock of a run folder; the system lets go of it when the process ends, however it ends."""
    target.parent.mkdir(parents=True, exist_ok=True)
    path = _lock(target)
    stream = path.open("a+", encoding="utf-8")
    try:
        if not _take(stream):
            hint = "wait for it, or choose another --out"
            raise RunFolderError("another run is writing this folder", file=target, hint=hint)
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
    finally:
        stream.close()


def _take(stream: TextIO) -> bool:
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True
    import fcntl

    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # whoever held it before may have removed the file, so that this lock is on nothing
        return os.fstat(stream.fileno()).st_ino == Path(stream.name).stat().st_ino
    except (BlockingIOError, FileNotFoundError):
        return False


def json_text(content: Any) -> str:
    """JSON of plain data, arrays and numpy numbers; what is not finite becomes null, so that it is valid JSON."""
    return json.dumps(_plain(content), indent=1, allow_nan=False, ensure_ascii=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, (str, bool, int, type(None))):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if hasattr(value, "tolist"):  # arrays and numbers of numpy
        return _plain(value.tolist())
    if isinstance(value, Iterable):
        return [_plain(part) for part in value]
    return str(value)


def file_record(path: str | Path) -> dict[str, str]:
    """Name and SHA-256 of an input."""
    path = Path(path)
    try:
        with path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256")
    except OSError as error:
        raise InputError(f"the file cannot be read ({error.strerror})", file=path) from None
    return {"file": str(path), "sha256": digest.hexdigest()}


def digests(inputs: Iterable[Mapping[str, str]]) -> list[str]:
    """Those of :func:`file_record`: the same data, whatever the way to them was written like."""
    return [str(record.get("sha256")) for record in inputs]


def versions() -> dict[str, str]:
    """Versions of what a result depends on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def read_result(folder: str | Path) -> dict[str, Any]:
    """The ``result.json`` of a run folder.

    Raises:
        RunFolderError: the folder is not there, is not a run folder, or its result is damaged.
    """
    folder = Path(folder)
    path = folder / RESULT
    if not path.is_file():
        what = "there is no such folder" if not folder.is_dir() else "not a run folder: it holds no result.json"
        raise RunFolderError(what, file=folder, hint="name the folder that a command with --out has finished")
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RunFolderError(f"the result cannot be read ({error})", file=path) from None
    if not isinstance(found, dict):
        raise RunFolderError("the result is not a table", file=path)
    return found
