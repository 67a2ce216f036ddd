"""The menu of experiments that were not made, relative to what was measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..features.measurement import Measurement
from ..forward import MOST_STEPS, longest

BACK = 0.8  # of full friction, to which a reversed start pulls the other way
HELD_AT = 0.8  # of the stick: where a hold begins
LONGEST = longest(MOST_STEPS)  # s; a diagnosis leaves a cycle that lasts longer out of a record
_HOLD = 5.0 * math.floor(0.9 * LONGEST / 5.0)  # s, round; the rest is for the stick around it
_PREFIXES = {-9: "n", -6: "u", -3: "m", 0: "", 3: "k"}


@dataclass(frozen=True)
class Experiment:
    """One entry of the menu, relative to what was measured.

    Attributes:
        name: in one or two words.
        of: which of the measured velocities it takes: "slowest", "middle" or "fastest".
        speed: factor on that velocity.
        hold: of the drive late in a stick (s); 0 for none.
        load: factor on the normal load.
        mass: factor on the mass, with the load on the contacts kept.
        reversed: whether the contact is first pulled the other way, short of slipping.
        lifted: whether the block is lifted off and set down first.
    """

    name: str
    of: str = "middle"
    speed: float = 1.0
    hold: float = 0.0
    load: float = 1.0
    mass: float = 1.0
    reversed: bool = False
    lifted: bool = False

    @property
    def first(self) -> bool:
        """Whether the first slip of a fresh contact is what is compared, and not one of a series."""
        return self.reversed or self.lifted

    def words(self, conditions: Conditions) -> str:
        """What to do, for a person."""
        if self.hold:
            return f"hold the drive for {self.hold:g} s late in a stick (at {100 * HELD_AT:.0f} % of it)"
        if self.load != 1.0:
            return f"multiply the normal load by {self.load:g}"
        if self.mass != 1.0:
            return f"add {100 * (self.mass - 1):.0f} % of mass without loading the contacts more"
        if self.reversed:
            return f"start in reverse: pull the other way to {100 * BACK:.0f} % of the slip force, then forward"
        if self.lifted:
            return "lift the block off, set it down and pull"
        return f"drive at {quantity(conditions.velocity(self), 'm/s')}"


MENU = (
    Experiment("slow drive", "slowest", 0.25),
    Experiment("fast drive", "fastest", 4.0),
    Experiment("hold 10 s", hold=10.0),
    Experiment(f"hold {_HOLD:g} s", hold=_HOLD),
    Experiment("double load", load=2.0),
    Experiment("added mass", mass=1.5),
    Experiment("lift-off", lifted=True),
    Experiment("reversed start", reversed=True),
)


class Conditions(NamedTuple):
    """What was measured, as far as an experiment refers to it.

    Attributes:
        velocities: of the drive (m/s).
        period: of the contact resonance (s).
        stiffness: of the spring where the runs have another than the rig (N/m), else nan.
        noise: standard deviation of a level that the sensor reads (m).
        clock: of a time (s).
    """

    velocities: tuple[float, ...]
    period: float
    stiffness: float = math.nan
    noise: float = 0.0
    clock: float = 0.0

    @classmethod
    def of(cls, m: Measurement) -> Conditions:
        """Those of a measurement."""
        s, used = m.layout.slices(), np.asarray(m.cycles.used)
        own = np.asarray(m.cycles.stiffness, float)
        return cls(
            tuple(sorted({float(f"{v:.6g}") for v in m.velocities})),
            float(np.asarray(m.anchors.ring_period).flat[0]),
            float(own[0]) if np.isfinite(own).all() else math.nan,
            float(np.median(m.sensor[used][:, s["size"]])),
            float(np.median(m.sensor[used][:, s["recurrence"]])),
        )

    def velocity(self, experiment: Experiment) -> float:
        """Of the drive in an experiment (m/s)."""
        known = sorted(self.velocities)
        at = {"slowest": known[0], "middle": known[len(known) // 2], "fastest": known[-1]}[experiment.of]
        return experiment.speed * at


def quantity(value: float, unit: str) -> str:
    """``0.0123, "s"`` as ``12 ms``."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g} {unit}"
    power = max(-9, min(3, 3 * math.floor(math.log10(value * 1.005) / 3)))
    return f"{value / 10.0**power:.3g} {_PREFIXES[power]}{unit}"
