"""What JAX compiles is kept on disk, so that the next start does not compile again.

Set through environment variables before JAX is imported, so nothing here imports it and child processes inherit it.
"""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
import zlib
from pathlib import Path
from typing import Any

OFF = "STICKSLIP_NO_CACHE"
_ZSTANDARD = b"\x28\xb5\x2f\xfd"


def keep_compiled() -> Path | None:
    """Keep compiled code in the user's cache folder, and compile the same code where nothing can be kept.

    Commands, their workers and the workbench do so by themselves. In Python it is left to you, for it sets JAX for the
    whole process: call it before anything is simulated or fitted. A second call changes nothing.

    Returns:
        The folder, or None where it is switched off (``STICKSLIP_NO_CACHE=1``), cannot be written, or JAX has its own
        setting already.
    """
    # a checked error inside compiled code calls back into Python, and such code cannot be kept and gives other last
    # digits; as nan it is found by the integrator's own check of every piece
    os.environ.setdefault("EQX_ON_ERROR", "nan")
    folder, chosen = folder_for("compiled"), os.environ.get("JAX_COMPILATION_CACHE_DIR")
    if folder is None or chosen is not None:
        return folder if chosen == str(folder) else None
    settings = {
        "jax_compilation_cache_dir": str(folder),
        "jax_persistent_cache_min_compile_time_secs": 0.0,
        "jax_persistent_cache_min_entry_size_bytes": -1,
    }
    for name, value in settings.items():
        os.environ.setdefault(name.upper(), str(value))
        if "jax" in sys.modules:
            sys.modules["jax"].config.update(name, value)
    heal(folder)
    return folder


def heal(folder: Path) -> None:
    """Have entries removed that cannot be read, and say once where none can be written.

    JAX writes an entry straight under its name and never replaces it: one that was cut short by a kill or a full disk
    would be met with a warning at every start.
    """
    before, said = warnings.showwarning, False

    def shown(message: Warning | str, *args: Any, **kwargs: Any) -> None:
        nonlocal said
        text = str(message)
        if text.startswith("Error reading persistent compilation cache"):
            remove_broken(folder)
        elif text.startswith("Error writing persistent compilation cache"):
            if not said:
                said = True
                print(f"stickslip: warning: compiled code cannot be kept in {folder} ({text})", file=sys.stderr)
        else:
            before(message, *args, **kwargs)

    warnings.showwarning = shown


def remove_broken(folder: Path) -> int:
    """Remove entries of the cache that end too early; returns how many."""
    count = 0
    for path in folder.glob("*-cache"):
        try:
            _unpack(path.read_bytes())
        except (zlib.error, ValueError, EOFError):
            path.unlink(missing_ok=True)
            count += 1
        except OSError:
            continue
    return count


def _unpack(content: bytes) -> None:
    if content[:4] == _ZSTANDARD:
        try:
            import zstandard
        except ImportError:
            return
        try:
            zstandard.ZstdDecompressor().decompress(content)
        except zstandard.ZstdError as error:
            raise ValueError(str(error)) from None
    else:
        zlib.decompress(content)


def folder_for(name: str) -> Path | None:
    """A folder in the user's cache, made if need be; None where caches are switched off or nothing can be written."""
    if os.environ.get(OFF, "").strip() not in ("", "0"):
        return None
    import platformdirs

    folder = Path(platformdirs.user_cache_dir("stickslip", appauthor=False)) / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return None
