"""One thing that the file states and the motion contradicts."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ...errors import InputError


@dataclass(frozen=True)
class Finding:
    """What is off, where, and what the motion says instead; numbers in SI.

    Attributes:
        what: "drive velocity", "displacement scale", "time", "sign", "spring force scale" or "mass and spring"; two of
            them joined by "or" where the motion cannot tell which.
        run: name of the run, or None where it holds of all.
        stated, value, std: what the file says, and what the motion gives with its standard deviation, in ``unit``. A
            scale is stated as 1; its value is the factor by which to multiply the numbers of the file.
        sentence: all of it in words, and how to fix it.
        stops: whether no physics may be named before it is mended.
        impossible: whether nothing can be made of the data as they are stated.
    """

    what: str
    run: str | None
    stated: float
    value: float
    std: float
    unit: str
    sentence: str
    stops: bool = True
    impossible: bool = False

    def plain(self) -> dict[str, Any]:
        """For ``result.json``: numbers that are not finite are None."""
        numbers = {name: getattr(self, name) for name in ("stated", "value", "std")}
        known = {name: float(v) if math.isfinite(v) else None for name, v in numbers.items()}
        return {
            "what": self.what, "run": self.run, **known, "unit": self.unit, "sentence": self.sentence,
            "stops": self.stops,
        }  # fmt: skip


def stopping(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Those that forbid to name physics."""
    return tuple(f for f in findings if f.stops)


def refuse_impossible(findings: Iterable[Finding]) -> None:
    """Stop where block and drive are so far apart that a unit must be wrong.

    Raises:
        InputError: with the first finding that is impossible.
    """
    for finding in findings:
        if finding.impossible:
            raise InputError(
                finding.sentence, key="trace.drive_velocity",
                hint="check the drive's velocity, the units of time and displacement, and whether a counter wraps or "
                "is cleared ('wrap', 'resets')",
            )  # fmt: skip
