"""Which features are taken of a cycle, in which order, and to which phase of the cycle each belongs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

LEVELS = (0.05, 0.10, 0.25, 0.75, 0.90, 0.97)  # shares of a slip whose times are compared with that of its half
RING_WINDOWS = ((0.0, 0.08), (0.08, 0.16), (0.16, 0.32), (0.32, 0.64), (0.64, 1.2))  # in units of the settling time
CREEP_POINTS = 16
SETTLE = (0.6, 0.8, 3.0, 6.0)  # times after arrest, in units of the settling time
HOLD = (0.15, 0.5, 0.95)  # shares of a hold
PHASES = ("creep", "slip", "ring-down", "recurrence", "hold")
RING_SAMPLES = 200


@dataclass(frozen=True)
class Layout:
    """The features of a cycle and the times they are taken at.

    Attributes:
        settling: time after an arrest at which the ring-down is over (s); the unit of all windows after an arrest.
        shortest: how close to a slip its creep is followed (s).
        names, phases: of every feature, in their order.
    """

    settling: float
    shortest: float
    names: tuple[str, ...] = field(init=False)
    phases: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        table = [("recurrence", "recurrence"), ("slip size", "slip")]
        table += [(f"time of {100 * q:g} % of the slip", "slip") for q in LEVELS]
        table += [("overshoot", "ring-down")]
        table += [(f"ringing {a:g}-{b:g} of the settling time", "ring-down") for a, b in RING_WINDOWS]
        table += [("ring frequency", "ring-down")]
        table += [(f"creep, point {j + 1} of {CREEP_POINTS} before the slip", "creep") for j in range(CREEP_POINTS)]
        table += [(f"settling, {s:g} of the settling time after the arrest", "creep") for s in SETTLE]
        table += [(f"hold, {100 * s:g} % of it", "hold") for s in HOLD]
        object.__setattr__(self, "names", tuple(n for n, _ in table))
        object.__setattr__(self, "phases", tuple(p for _, p in table))

    @property
    def size(self) -> int:
        return len(self.names)

    def slices(self) -> dict[str, slice]:
        """Where each group of features stands."""
        sizes = {
            "recurrence": 1,
            "size": 1,
            "times": len(LEVELS),
            "overshoot": 1,
            "ring": len(RING_WINDOWS),
            "frequency": 1,
            "creep": CREEP_POINTS,
            "settle": len(SETTLE),
            "hold": len(HOLD),
        }
        ends = np.cumsum(list(sizes.values()))
        return {k: slice(int(e) - n, int(e)) for (k, n), e in zip(sizes.items(), ends, strict=True)}
