"""TDMS of LabVIEW, by npTDMS (an extra)."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from ...system.extras import need
from .base import Columns, add_array, need_columns, reading


class TdmsReader:
    """LabVIEW TDMS."""

    name = "tdms"
    suffixes: tuple[str, ...] = (".tdms",)
    description = "TDMS of LabVIEW (needs the extra 'tdms')"

    def sniff(self, path: Path, head: bytes) -> bool:
        return head.startswith(b"TDSm")

    def read(self, path: Path) -> Columns:
        need("reading TDMS files", "tdms", "nptdms", file=path, instead="export the file as CSV")
        import nptdms

        columns = Columns({})
        nptdms.log.log_manager.set_level(logging.ERROR)  # what it tells of a file cut short is told below
        with reading("TDMS", path), nptdms.TdmsFile.open(path) as file:
            for group in file.groups():
                for channel in group.channels():
                    _add(columns, group.name, channel)
            if file.file_status.incomplete_final_segment:
                columns.notes.append("the file is cut short; what is there was read")
        return need_columns(columns, path)


def _add(columns: Columns, group: str, channel: object) -> None:
    properties = channel.properties  # type: ignore[attr-defined]
    name = channel.name if channel.name not in columns.data else f"{group}/{channel.name}"  # type: ignore[attr-defined]
    values = channel[:]  # type: ignore[index]
    unit = properties.get("unit_string") or properties.get("NI_UnitDescription")
    add_array(columns, name, values, unit if isinstance(unit, str) else None)
    if "wf_increment" in properties and name in columns.data:
        own = f"{name} time"
        first, step = float(properties.get("wf_start_offset", 0.0)), float(properties["wf_increment"])
        add_array(columns, own, first + step * np.arange(columns.data[name].size), "s")
        columns.data.setdefault("time", columns.data[own])
        columns.units.setdefault("time", "s")
