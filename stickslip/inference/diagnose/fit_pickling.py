"""A base model and what was fitted on top of it, as they are sent between processes.

Candidates share with their base all that is known of the record, nine tenths of what they hold: on their way back
those arrays are sent by name and not copied.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from cloudpickle import Pickler, dumps, loads

from ..force.candidates import Candidate
from ..force.fit import Fit


class FitPickler:
    """Takes candidates to another process that has the same base.

    Attributes:
        base: the model that both processes have, as it was read from its file.

    Args:
        path: file made by :meth:`packed`.
    """

    def __init__(self, path: Path) -> None:
        self.base: Fit = loads(path.read_bytes())
        self._arrays = dict(_arrays(self.base, ""))

    @classmethod
    def packed(cls, base: Fit, path: Path) -> FitPickler:
        """One for this process; the base is written to the file, from which the others have it."""
        path.write_bytes(dumps(base))
        return cls(path)

    def pack(self, made: Sequence[Candidate]) -> bytes:
        """Candidates on top of the base."""
        names = {id(array): name for name, array in self._arrays.items()}

        class Named(Pickler):
            def persistent_id(self, obj: Any) -> str | None:
                return names.get(id(obj))

        into = io.BytesIO()
        Named(into).dump(list(made))
        return into.getvalue()

    def unpack(self, packed: bytes) -> list[Candidate]:
        """The candidates again."""
        arrays = self._arrays

        class Known(pickle.Unpickler):
            def persistent_load(self, name: Any) -> Any:
                return arrays[name]

        found: list[Candidate] = Known(io.BytesIO(packed)).load()
        return found


def _arrays(part: Any, name: str) -> Iterator[tuple[str, np.ndarray]]:
    """All arrays of an object, by the way that leads to them."""
    if isinstance(part, np.ndarray):
        yield name, part
    elif isinstance(part, tuple | list):
        for i, one in enumerate(part):
            yield from _arrays(one, f"{name}.{i}")
    elif type(part).__module__.split(".")[0] in {__name__.split(".")[0], "scipy"}:
        for key, one in getattr(part, "__dict__", {}).items():
            yield from _arrays(one, f"{name}.{key}")
