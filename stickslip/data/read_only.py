"""Data that nobody can change: read-only arrays, and what is copied with them."""

from __future__ import annotations

from dataclasses import fields
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]


class Rebuilt:
    """Pickled and copied as what it is made of: the copy is checked, and its arrays are read-only again."""

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        values = (getattr(self, f.name) for f in fields(self))  # type: ignore[arg-type]  # a dataclass
        return type(self), tuple(dict(v) if isinstance(v, MappingProxyType) else v for v in values)


def read_only(values: ArrayLike, what: str) -> Array:
    """A read-only float view; copies only what someone else could still write to."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise InputError(f"{what} must be one-dimensional", value=array.shape)
    if array.flags.writeable:
        array = array.copy() if array.base is not None or array is values else array
        array.flags.writeable = False
    return array
