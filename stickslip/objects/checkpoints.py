"""Finished parts of long work in its run folder, of the same data and the same code."""

from __future__ import annotations

import hashlib
import sys
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..physics.effects import catalogue
from ..system.runstore import Run, json_text
from .result_base import write_arrays


def code_digest(effect_files: Sequence[str | Path] = ()) -> str:
    """Digest of the package's own modules and of effects from elsewhere: parts made by other code are not taken up.

    Of an installed package it has the version, and the modules that define the effects (which may be under work).
    """
    own = sorted(Path(__file__).parent.parent.rglob("*.py"))
    plugged = sorted({getattr(sys.modules.get(c.__module__), "__file__", None) or "" for c in catalogue.all().values()})
    others = [path for path in map(Path, plugged) if path.is_file() and path not in own]
    digest = hashlib.sha256(json_text(catalogue.EFFECTS.packages()).encode())
    for path in (*own, *others, *map(Path, effect_files)):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


class FinishedParts:
    """Finished parts of long work in the run folder, one file each, written aside and renamed."""

    def __init__(self, run: Run, inputs: str) -> None:
        # a digest: each of many parts has one, and the text may be longer than a part
        self._run, self._inputs = run, hashlib.sha256(inputs.encode()).hexdigest()

    def _path(self, key: str) -> Path:
        return self._run.path(f"pieces/{key}.npz")

    def ready(self) -> int:
        """How many finished parts of the same inputs there are."""
        return sum(self.load(path.stem) is not None for path in self._path("any").parent.glob("*.npz"))

    def load(self, key: str) -> Mapping[str, np.ndarray] | None:
        """A finished part of the same inputs, or None."""
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = dict(file)
        except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
            return None
        return arrays if str(arrays.pop("inputs", "")) == self._inputs else None

    def save(self, key: str, part: Mapping[str, np.ndarray]) -> None:
        """Keep a finished part."""
        write_arrays(self._path(key), {"inputs": np.array(self._inputs), **part})
