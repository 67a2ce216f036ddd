"""A simulated run as plain arrays: read like an `xarray.Dataset`, written as one, without importing xarray.

That import and its way of writing take two thirds of a second, a quarter of a whole ``stickslip simulate``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import xarray


class Variable(NamedTuple):
    """One variable: its dimension, values (n,), and attributes with ``units``."""

    dimension: str
    values: np.ndarray
    attrs: Mapping[str, str]

    @property
    def dims(self) -> tuple[str]:
        """As xarray names it."""
        return (self.dimension,)


@dataclass(frozen=True)
class Recording:
    """A simulated run; ``run["slip"].values``, ``run.sizes`` and ``run.attrs`` are as of the data set.

    Attributes:
        variables: name -> variable.
        attrs: facts of the whole run.
    """

    variables: Mapping[str, Variable]
    attrs: Mapping[str, Any]

    def __getitem__(self, name: str) -> Variable:
        return self.variables[name]

    @property
    def sizes(self) -> dict[str, int]:
        """Dimension -> length."""
        return {v.dimension: v.values.size for v in self.variables.values()}

    def dataset(self) -> xarray.Dataset:
        """As `simulate` gives it."""
        import xarray

        data = {name: (v.dimension, v.values, dict(v.attrs)) for name, v in self.variables.items()}
        return xarray.Dataset(data, coords={"time": data.pop("time")}, attrs=dict(self.attrs))

    def to_netcdf(self, path: str | Path, engine: str = "h5netcdf") -> None:
        """Write it as NetCDF; xarray reads back what `dataset` makes."""
        import h5netcdf

        if engine != "h5netcdf":
            raise ValueError(f"written with h5netcdf, not {engine}")
        with h5netcdf.File(path, "w") as file:
            file.dimensions = self.sizes
            for name, variable in self.variables.items():
                written = file.create_variable(name, variable.dims, data=variable.values)
                written.attrs.update(variable.attrs)
            file.attrs.update(self.attrs)
