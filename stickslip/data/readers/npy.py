"""NumPy .npy and .npz; pickled objects are never loaded."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import InputError
from .base import Columns, add_array, need_columns


class NpyReader:
    """NumPy arrays."""

    name = "numpy"
    suffixes: tuple[str, ...] = (".npy", ".npz")
    description = "NumPy .npy and .npz"

    def sniff(self, path: Path, head: bytes) -> bool:
        return head.startswith(b"\x93NUMPY") or (head.startswith(b"PK\x03\x04") and path.suffix.lower() == ".npz")

    def read(self, path: Path) -> Columns:
        columns = Columns({})
        try:
            with path.open("rb") as stream:  # numpy leaves a damaged archive open
                content = np.load(stream, allow_pickle=False)
                if isinstance(content, np.ndarray):
                    add_array(columns, "" if content.ndim == 2 or content.dtype.names else "column 1", content)
                else:
                    with content:
                        for name in content.files:
                            add_array(columns, name, content[name])
        except ValueError as error:
            hint = "save plain arrays of floats" if "pickle" in str(error).lower() else None
            raise InputError(f"the NumPy file cannot be read ({error})", file=path, hint=hint) from None
        except Exception as error:  # zipfile and numpy raise many kinds on a damaged file
            raise InputError(f"the NumPy file cannot be read ({type(error).__name__}: {error})", file=path) from None
        return need_columns(columns, path)
