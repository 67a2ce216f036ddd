"""What a process that is this program's own (a command, a worker, a search of the workbench) sets for itself."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from typing import Any

from . import cache, threads

AMPLE = 3 * 2**29  # bytes that a process may hold between two pieces of its work
RARELY = 50_000  # containers between two searches for cycles: imports and traces make a million, and keep them
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of mallopt(3)
_KEPT, _LARGEST = 2**30, 2**25  # bytes: of freed memory that is kept, and of one piece of it


def begin() -> None:
    """One thread for linear algebra, compiled code kept on disk, freed memory kept by the process, no accelerator.

    JAX would take a graphics processor where it finds one, and most of its memory. ``JAX_PLATFORMS=cuda`` in the
    environment uses it all the same.

    A fit makes and drops arrays of some megabytes thousands of times. The GNU library hands each back to the system,
    and the system clears each page before it is given again: a tenth of the time of a diagnosis.
    """
    platforms = os.environ.setdefault("JAX_PLATFORMS", "cpu")
    if "jax" in sys.modules:
        sys.modules["jax"].config.update("jax_platforms", platforms)
    gc.set_threshold(RARELY)
    threads.one_for_linear_algebra()
    cache.keep_compiled()
    set_option = _of_c_library("mallopt")
    if set_option is not None:
        set_option(_MMAP_THRESHOLD, _LARGEST)
        set_option(_TRIM_THRESHOLD, _KEPT)


def forget_programs(ample: int = AMPLE) -> bool:
    """Let go of what JAX has compiled in this process, if the process holds more than ``ample`` bytes.

    Every effect, and every campaign, leaves programs of its own behind. Returns whether so.
    """
    import jax
    import psutil

    much = bool(psutil.Process().memory_info().rss > ample)
    if much:
        jax.clear_caches()
        trim = _of_c_library("malloc_trim")
        if trim is not None:
            trim(0)
    return much


def _of_c_library(name: str) -> Any:
    """A function of the C library, None where it has none of this name (``mallopt``, ``malloc_trim``: GNU)."""
    return getattr(ctypes.CDLL(None), name, None) if os.name == "posix" else None
