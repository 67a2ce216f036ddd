"""NetCDF: version 3 by scipy, version 4 by h5netcdf, both through xarray."""

from __future__ import annotations

from pathlib import Path

from .base import Columns, add_array, need_columns, reading
from .guarded_reading import guard

_MOST_LINKS = 8  # one to the next


class NetcdfReader:
    """NetCDF 3 and 4."""

    name = "netcdf"
    suffixes: tuple[str, ...] = (".nc", ".cdf", ".nc4")
    description = "NetCDF (3 and 4)"

    def sniff(self, path: Path, head: bytes) -> bool:
        return head[:4] in (b"CDF\x01", b"CDF\x02") or (
            head.startswith(b"\x89HDF") and path.suffix.lower() in self.suffixes
        )

    def read(self, path: Path) -> Columns:
        import xarray

        with path.open("rb") as stream:
            classic = stream.read(3) == b"CDF"
        columns = Columns({})
        if not classic:
            guard(path, "hdf5")
        with reading("NetCDF", path):
            # decode_times=False: "seconds since ..." stays a number
            elsewhere = [] if classic else _elsewhere(path)
            columns.ignored.update(dict.fromkeys(elsewhere, "its numbers lie in another file"))
            with xarray.open_dataset(
                path, engine="scipy" if classic else "h5netcdf", decode_times=False, drop_variables=elsewhere
            ) as data:
                for name, variable in data.variables.items():
                    unit = variable.attrs.get("units", variable.attrs.get("unit"))
                    if isinstance(unit, str):
                        unit = unit.split(" since ")[0]
                    add_array(columns, str(name), variable.values, unit if isinstance(unit, str) else None)
        return need_columns(columns, path)


def _elsewhere(path: Path) -> list[str]:
    """Variables whose numbers lie in another file: linked, external or virtual."""
    import h5py

    found = []
    with h5py.File(path, "r") as file:
        for name in file:
            link = file.get(name, getlink=True)  # a link into another file is not followed
            for _ in range(_MOST_LINKS):
                if isinstance(link, h5py.SoftLink):
                    link = file.get(link.path, getlink=True)
            item = None if isinstance(link, h5py.ExternalLink) else file.get(name)
            if (
                item is None
                or item.file.filename != file.filename
                or (isinstance(item, h5py.Dataset) and (item.external or item.is_virtual))
            ):
                found.append(name)
    return found
