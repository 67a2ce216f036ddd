"""Compiled functions whose traces are kept on disk.

JAX finds what it has compiled (:mod:`stickslip.system.cache`) by the traced function, so every process would trace each
model again, which takes three times as long as to load it.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Any

import jax
import numpy as np
from jax import export

from .cache import folder_for

PACKAGE = Path(__file__).parents[1]
MADE_WITH = ("jax", "jaxlib", "diffrax", "equinox", "lineax", "optimistix", "numpy")  # and with this package's code
OPTIONS = {
    "xla_cpu_prefer_vector_width": 512,  # bits, where the processor has them; XLA itself takes half
    "xla_cpu_use_fusion_emitters": False,  # which take half as long again to compile, for the same speed
}
FORGOTTEN = 30 * 86400.0  # s after which traces of other versions are removed
_DIGEST = hashlib.sha256().digest_size
_IMPORTED = time.time()


class Program:
    """A function of pytrees of numbers, compiled; where its trace is kept, only its values can be asked for.

    Attributes:
        function: itself, for derivatives and for lanes.

    Args:
        function: of pytrees of arrays.
        name: says all that decides about the trace besides the arguments' shapes and the package's code; None keeps
            no trace.
    """

    def __init__(self, function: Callable[..., Any], name: str | None) -> None:
        self.function, self.name = function, name
        self._traced = _compiled(function)
        self._ready: dict[Any, Callable[..., Any]] = {}
        self._lock = Lock()

    def __call__(self, *args: Any) -> Any:
        """The function's result."""
        leaves, structure = jax.tree.flatten(args)
        leaves = [_here(a) for a in leaves]  # arrays that JAX has committed to a device would compile anew
        kinds = structure, tuple((np.shape(a), getattr(a, "dtype", type(a))) for a in leaves)
        if kinds not in self._ready:
            with self._lock:  # of several threads one compiles, and the others wait for it
                if kinds not in self._ready:
                    made = self._made(kinds, leaves, structure)
                    found = made(*leaves)
                    self._ready[kinds] = made
                    return found
        return self._ready[kinds](*leaves)

    def _made(self, kinds: Any, leaves: list[Any], structure: Any) -> Callable[..., Any]:
        """The function of its arguments' leaves; by its trace on disk, which is made where it is not there."""
        folder = None if self.name is None else _folder()
        if folder is None:
            return lambda *leaves: self._traced(*jax.tree.unflatten(structure, leaves))
        path = folder / hashlib.sha256(f"{self.name} {kinds}".encode()).hexdigest()

        def flat(*leaves: Any) -> Any:
            return self.function(*jax.tree.unflatten(structure, leaves))

        kept = _read(path)
        if kept is None:
            try:
                kept = bytes(export.export(jax.jit(flat))(*leaves).serialize())
            except (NotImplementedError, ValueError):  # calls back into Python, or returns no known container
                return _compiled(flat)
            _write(path, kept)
        return _compiled(export.deserialize(bytearray(kept)).call)


def _here(leaf: Any) -> Any:
    return np.asarray(leaf) if isinstance(leaf, jax.Array) and isinstance(leaf.dtype, np.dtype) else leaf


def _compiled(function: Callable[..., Any]) -> Any:
    return jax.jit(function, compiler_options=OPTIONS)


def of_this_package(structure: Any) -> bool:
    """Whether all effects of this structure are this package's own, so that its code says all of their laws."""
    effects = jax.tree.unflatten(structure, [0.0] * structure.num_leaves)
    package = __name__.split(".")[0]
    return all(type(e).__module__.split(".")[0] == package for e in effects)


def _read(path: Path) -> bytes | None:
    """What was kept, or None where it is not there or damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    digest, kept = content[:_DIGEST], content[_DIGEST:]
    return kept if hashlib.sha256(kept).digest() == digest else None


def _write(path: Path, kept: bytes) -> None:
    """Keep a trace, unless it may be of other code than what is on disk by now."""
    aside = path.with_suffix(f".{os.getpid()}")
    with suppress(OSError):  # a full disk, or one that cannot be written: it is traced again next time
        if _as_loaded():
            aside.write_bytes(hashlib.sha256(kept).digest() + kept)
            aside.replace(path)
    with suppress(OSError):
        aside.unlink(missing_ok=True)


def _folder() -> Path | None:
    """Where traces are kept, or None where compiled code is not kept either."""
    kept: str | None = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]  # made when JAX starts
    return _of_this_version() if kept else None


def _code() -> Iterator[Path]:
    return PACKAGE.rglob("*.py")


def _as_loaded() -> bool:
    """Whether the code on disk is older than this process' own."""
    return max(path.stat().st_mtime for path in _code()) < _IMPORTED


def _digest() -> str | None:
    """Of the code and of all else that a trace depends on; None where the code on disk is not what was loaded."""
    parts = [platform.python_version(), jax.default_backend(), os.environ.get("EQX_ON_ERROR", "")]
    found = hashlib.sha256(" ".join([*parts, *map(version, MADE_WITH)]).encode())
    try:
        if not _as_loaded():
            return None
        for path in sorted(_code()):
            found.update(path.relative_to(PACKAGE).as_posix().encode() + path.read_bytes())
    except OSError:
        return None
    return found.hexdigest()


@lru_cache(maxsize=1)
def _of_this_version() -> Path | None:
    """The folder for traces of this version of everything; those of others are removed when they are old."""
    above, digest = folder_for("traced"), _digest()
    if above is None or digest is None:
        return None
    folder = above / digest
    try:
        folder.mkdir(exist_ok=True)
        folder.touch()
    except OSError:
        return None
    for other in above.iterdir():
        with suppress(OSError):
            if other.stat().st_mtime < time.time() - FORGOTTEN:
                shutil.rmtree(other)
    return folder
