"""What segmentation gives: events, phases, and what was left out and why."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ...system.object_repr import Shown, facts, table

if TYPE_CHECKING:
    import pandas

PHASES = ("virgin loading", "stick", "hold", "nucleation", "slip", "ring-down", "continuous sliding")


@dataclass(frozen=True)
class Settings:
    """The estimator's settings: chosen on the measurement, then used unchanged on the model's own trace.

    Args:
        window: s; velocities are differences of means over so long before and after each sample.
        threshold: m/s; an event's onset is where the block's velocity rises through it.
        speed: m/s, usual speed of the drive.
        minimum_slip: m; anything smaller is not an event.
        noise: m, standard deviation of one sample of position (quantisation included).
        arrest: ``"zero"``: a slip ends at the first zero of velocity; ``"drive"``: where it falls behind the drive.
        relative: slips below this share of the large ones (which make half of all slipped length) are left out too.
        gain: for traces of spring force, N per m (or per s of loading) between force and spring elongation.
        unit: ``"m"``, or ``"s of loading"`` where neither stiffness nor drive is known.
    """

    window: float
    threshold: float
    speed: float
    minimum_slip: float
    noise: float
    arrest: str = "zero"
    relative: float = 0.1
    gain: float | None = None
    unit: str = "m"


@dataclass(frozen=True)
class Event:
    """One slip. Times in s, positions in m (or the settings' unit), along the drive's direction where signed.

    ``slip`` and ``peak_velocity`` are positive. ``recurrence`` is the time since the onset before, ``stick_time`` since
    the arrest before (NaN for the first event). ``holds`` are (start, stop) of the drive's halts in the stick before.
    ``drive_position`` is the load point's at onset, for absolute drive phases. ``arrest`` says what ended the slip: a
    ``"zero"`` of velocity, or falling below the ``"drive"``'s speed where the block never quite stops.
    """

    index: int
    t_onset: float
    t_arrest: float
    x_onset: float
    x_arrest: float
    slip: float
    peak_velocity: float
    t_peak: float
    direction: int
    recurrence: float
    stick_time: float
    holds: tuple[tuple[float, float], ...]
    drive_position: float
    i_onset: int
    i_arrest: int
    arrest: str = "zero"
    warnings: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Time from onset to arrest, s."""
        return self.t_arrest - self.t_onset

    @property
    def hold_time(self) -> float:
        """Sum of the holds in the preceding stick, s."""
        return sum(stop - start for start, stop in self.holds)


@dataclass(frozen=True)
class Phase:
    """A stretch of the record: kind, times (s) and sample range, and the event it leads to or follows."""

    kind: str
    start: float
    stop: float
    first: int
    last: int
    event: int | None = None


@dataclass(frozen=True)
class Dropped:
    """Something left out: what, how many, where, why; ``coarse`` if the sensor shows too little for what was asked."""

    what: str
    count: int
    where: str
    reason: str
    coarse: bool = False

    def __str__(self) -> str:
        what = "slip" if self.count == 1 and self.what == "slips" else self.what
        return f"{self.count} {what} ({self.where}): {self.reason}"


@dataclass(frozen=True, repr=False)
class Segmentation(Shown):
    """Events and phases of one trace.

    ``regime``: ``"stick-slip"``, ``"oscillation"`` (the block slows and hurries but hardly rests), ``"continuous
    sliding"``, or ``"no slip"``; ``reason`` says why in words.
    """

    name: str
    events: tuple[Event, ...]
    phases: tuple[Phase, ...]
    dropped: tuple[Dropped, ...]
    regime: str
    reason: str
    settings: Settings
    warnings: tuple[str, ...] = field(default=())

    def during(self, kind: str) -> tuple[Phase, ...]:
        """All phases of one kind."""
        return tuple(phase for phase in self.phases if phase.kind == kind)

    def to_dataframe(self) -> pandas.DataFrame:
        """A row for each slip, by its number from 1, with the unit in the name of each column."""
        length = self.settings.unit
        rows: dict[Any, dict[str, Any]] = {
            e.index + 1: {
                "onset (s)": e.t_onset,
                "arrest (s)": e.t_arrest,
                f"slip ({length})": e.slip,
                f"peak velocity ({length}/s)": e.peak_velocity,
                "recurrence (s)": e.recurrence,
            }
            for e in self.events
        }
        return table(rows, "slip number")

    def _parts(self) -> list[Any]:
        what = {"run": self.name, "slips": len(self.events), "regime": self.regime, "reason": self.reason}
        events = [self.to_dataframe()] if self.events else []
        return [facts(what), *events, *(f"left out: {d}" for d in self.dropped), *self.warnings]
