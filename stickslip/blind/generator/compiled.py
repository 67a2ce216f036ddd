"""``jit``: numba with a cache that belongs to the text of all compiled modules together.

Numba's own cache looks at the file of a function alone, so a kernel would go on using old laws after an edit.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from stickslip.errors import InputError

try:
    import numba
except ImportError:
    raise InputError("the challenge's simulator needs numba", hint="pip install 'stickslip[challenge]'") from None

config: Any = numba.config
_SOURCES = ("array_layout.py", "laws.py", "springs.py", "contacts.py", "implicit.py", "kernel.py")


@cache
def _folder() -> str:
    here = Path(__file__).parent
    digest = hashlib.sha256(b"".join((here / name).read_bytes() for name in _SOURCES)).hexdigest()[:16]
    return str(Path(config.CACHE_DIR or here / "__pycache__") / f"kernel-{digest}")


def jit(function: Callable | None = None, **options: Any) -> Any:
    """``numba.njit`` with that cache; without a cache where the folder cannot be written."""
    if function is None:
        return lambda given: jit(given, **options)
    before = config.CACHE_DIR
    config.CACHE_DIR = _folder()
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:
        return numba.njit(**options)(function)
    finally:
        config.CACHE_DIR = before
