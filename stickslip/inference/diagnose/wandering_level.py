"""Whether friction wanders: the level of the base fit, asked for once more beside the last model.

The base lets the strength of events wander where that pays (:func:`..force.fit.wandering`), and every effect is tried
on top of it. An effect may have taken its place: what is left is named only if the last model would lose by strengths
that are independent from event to event.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...system.units import shown
from ..force.fit import Fit, independent
from ..force.scatter import NUMERIC, WANDER
from .decide import DISPERSION

TAG = "wandering-friction"
FORMS = {"place": "place", "slip path": "slip", "time": "time"}
WHAT = {"both": "the strength", "static": "static friction", "sliding": "sliding friction"}
SEPARATED = {
    frozenset({"slip path", "time"}): "hold the drive for as long as several slips take: a level that wanders in time "
    "changes meanwhile, one that wanders along the slip path does not",
    frozenset({"slip path", "place"}): "go back over the same track: a level that depends on place repeats",
    frozenset({"place", "time"}): "go back over the same track: a level that depends on place repeats",
}


@dataclass(frozen=True)
class Level:
    """How the strength of the contact wanders.

    Attributes:
        coordinate: along what.
        equally_likely: along what it might as well.
        size: standard deviation, as a share of the strength.
        length: correlation length (m or s).
        own: what events differ by besides, as a share of the strength.
        gain: fall of the cost against independent strengths.
        of: which friction wanders: both, static or sliding.
    """

    coordinate: str
    equally_likely: tuple[str, ...]
    size: float
    length: float
    own: float
    gain: float
    of: str = "both"

    @property
    def form(self) -> dict[str, str]:
        """Of the catalogue's effect."""
        form = {"along": FORMS[self.coordinate]}
        return form if self.of == "both" else {**form, "of": self.of}

    @property
    def reason(self) -> str:
        """What the name rests on."""
        return f"{TAG}: the cost falls by {self.gain:.0f} against strengths that are independent from event to event"

    @property
    def text(self) -> str:
        """The same in a few sentences."""
        unit = "s" if self.coordinate == "time" else "m"
        others = " or ".join(self.equally_likely)
        like = f" (or {others}: these data cannot distinguish them)" if others else ""
        return (
            f"From event to event {WHAT[self.of]} wanders by {100 * self.size:.2g} % along {self.coordinate}{like}, "
            f"with a length of {shown(self.length, unit, 2)}; {100 * self.own:.2g} % of the strength is independent "
            "from event to event. All effects are tried on top of this."
        )

    @property
    def experiment(self) -> dict[str, Any] | None:
        """What would separate the coordinates."""
        if not self.equally_likely:
            return None
        names = [f"{TAG} along {name}" for name in (self.coordinate, *self.equally_likely)]
        return {"text": SEPARATED[frozenset({self.coordinate, self.equally_likely[0]})], "separates": names}

    def plain(self) -> dict[str, Any]:
        """Entries of the result beside the sizes of what is random."""
        return {
            "coordinate": self.coordinate,
            "of": self.of,
            "equally_likely": list(self.equally_likely),
            "text": self.text,
        }


def level_of(fit: Fit) -> Level | None:
    """The level of a model's strength; None where strengths of events may as well be independent."""
    follows, size = fit.scatter.follows, fit.scatter.named()
    if follows is None or size["level"] < NUMERIC:
        return None
    gain = independent(fit).cost - fit.cost
    if gain / DISPERSION < len(WANDER) * np.log(fit.problem.events):  # Schwarz's criterion
        return None
    return Level(
        follows.coordinate, follows.equally_likely, size["level"], size["length"], size["strength"], gain, follows.of
    )  # fmt: skip
