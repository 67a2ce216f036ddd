"""Where a trace came from, and what of it was mended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from .read_only import Rebuilt


@dataclass(frozen=True)
class Repair:
    """Something changed or left out between the file and the trace.

    Args:
        kind: a short name such as ``"spike"``, ``"wrap"``, ``"nan"``, ``"dropped-samples"``.
        count: how many samples or places.
        where: the channel and the first place.
        reason: why it was necessary, in words.
    """

    kind: str
    count: int
    where: str
    reason: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.count} ({self.where}): {self.reason}"


@dataclass(frozen=True)
class Provenance(Rebuilt):
    """Where a trace came from: file, its SHA-256, the reader, and quantity -> column and unit."""

    file: str = ""
    sha256: str = ""
    reader: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))
