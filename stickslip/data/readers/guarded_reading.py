"""Files that may take a process down with them are first read by another one.

A damaged HDF5 or MATLAB file can send the compiled library that reads it into an endless loop or a segmentation fault
(a single flipped bit is enough), which no exception handler sees.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from ...errors import InputError

PATIENCE = 10.0  # s of processor time, and one more for every 10 MB
WALL = 60.0  # times as long by the clock: the machine may be busy
ENABLED = True
_LATE, _DIED = "does not end", "fails"

_LIMIT = """
import sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, (int(sys.argv[2]), int(sys.argv[2]) + 1))
except (ImportError, OSError, ValueError):
    pass
"""
_PROGRAMS = {
    "hdf5": """
import sys, h5py
def look(name, item):
    list(item.attrs.items())
    if isinstance(item, h5py.Dataset) and item.shape and not item.external and not item.is_virtual:
        for i in range(0, item.shape[0], 1 << 20):
            item[i : i + (1 << 20)]
with h5py.File(sys.argv[1], "r") as file:
    list(file.attrs.items())
    file.visititems(look)
""",
    "mat": """
import sys
try:
    import scipy.io
except ImportError:  # which is elsewhere than a process without surroundings looks
    sys.exit()
scipy.io.loadmat(sys.argv[1], squeeze_me=True, struct_as_record=False)
""",
}
_XCPU, _KILL = 24, 9
_sound: set[tuple[str, int, int]] = set()


def guard(path: Path, library: str) -> str:
    """Have another process read the file once.

    Args:
        path: the file.
        library: ``"hdf5"`` or ``"mat"``.

    Returns:
        What the library raised there; empty where it read the file. One that reads beyond its memory raises something
        at times, and fails at others: a reader that must not fail repeats these words and does not read again.

    Raises:
        InputError: that process was killed by the system or did not come to an end.
    """
    facts = path.stat()
    key = (str(path.resolve()), facts.st_mtime_ns, facts.st_size)
    if not ENABLED or key in _sound or not sys.executable:
        return ""
    patience = max(int(PATIENCE + facts.st_size / 1e7), 1)
    command = [sys.executable, "-I", "-W", "ignore", "-c", _LIMIT + _PROGRAMS[library], str(path), str(patience)]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            errors="replace", timeout=WALL * patience,
        )  # fmt: skip
        if done.returncode in (-_XCPU, -_KILL):
            fault = _LATE
        else:
            fault = _DIED if done.returncode < 0 or done.returncode > 2 else ""
    except subprocess.TimeoutExpired:
        fault = _LATE
    except OSError:  # no other process can be had: then without this precaution
        return ""
    if fault:
        hint = "export it again, or as CSV"
        raise InputError(f"the file is damaged: the library that reads this format {fault} on it", file=path, hint=hint)
    if done.returncode:
        return (done.stderr.strip().splitlines() or ["an error"])[-1]
    _sound.add(key)
    return ""
