"""The chosen event beside the other events of its run: creep, slip and ring-down, overlaid."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..data.segment import Segmentation
from ..objects.campaign import Campaign
from .figures import figure, label, look, source, unit_of
from .overview import Array, Record, events_of, record, reduced
from .selection import chosen
from .session import Session, watch

CREEP, SLIP, RING = "creep", "slip", "ring-down"
PARTS = (CREEP, SLIP, RING)
POINTS = 600  # of a part
AFTER = 1.5  # durations of a slip that its ring-down is shown
MARGIN = 0.3  # durations of a slip that are shown before and after it
Curve = tuple[Array, Array]
OTHERS = 40  # events that are drawn thin
FROM = {CREEP: "time before the onset", SLIP: "time after the onset", RING: "time after the arrest"}


class EventView:
    """Three figures.

    Attributes:
        figures: part of the event -> its figure.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._of: tuple[Campaign, str] | None = None
        self._thin: dict[str, list[tuple[int, Curve]]] = {}
        self._scale: dict[str, tuple[float, str]] = {}
        self._others = {name: source(t=[], y=[]) for name in PARTS}
        self._own = {name: source(t=[], y=[]) for name in PARTS}
        self.figures = {name: self._make(name) for name in PARTS}
        watch(session, ["run", "event", "campaign"], self.update, now=True)

    def _make(self, name: str) -> Any:
        theme = look()
        made = figure(name, label(FROM[name], "s"), height=260, output_backend="canvas")
        made.multi_line(
            "t", "y", source=self._others[name], color=theme.band, line_width=1, line_alpha=0.7, name="others"
        )
        self._own[name].name = f"event {name}"
        made.line("t", "y", source=self._own[name], color=theme.model, line_width=2.5, name="chosen")
        made.xaxis.ticker.desired_num_ticks = 4
        return made

    def update(self) -> None:
        """Show the chosen event."""
        campaign = self._session.data
        run, event = chosen(self._session)
        number = campaign.names.index(run)
        found = campaign.events[number]
        own = record(campaign.traces[number], found)
        if self._of != (campaign, run):
            self._of = (campaign, run)
            for name in PARTS:
                made = [(i, part(own, found, i, name)) for i in events_of(found, OTHERS)]
                self._thin[name] = [(i, curve) for i, curve in made if curve is not None]
                heights = [np.ptp(curve[1]) for _, curve in self._thin[name]]
                self._scale[name] = unit_of(np.array(heights), own.unit)
        for name in PARTS:
            k, unit = self._scale[name]
            curve = part(own, found, event, name) if found.events else None
            others = [c for i, c in self._thin[name] if i != event]
            self._others[name].data = {"t": [t for t, _ in others], "y": [x * k for _, x in others]}
            self._own[name].data = {"t": [], "y": []} if curve is None else {"t": curve[0], "y": curve[1] * k}
            self.figures[name].yaxis.axis_label = label("displacement", unit)
            thin = f"; {len(others)} others as thin lines" if others else ""
            what = f"{name} of event {event + 1}{thin}" if found.events else "no slip in this run"
            self.figures[name].title.text = what


def part(record: Record, found: Segmentation, number: int, which: str) -> Curve | None:
    """Time (s) and displacement (the record's unit) of a part of an event.

    Creep and slip are aligned at the onset, the ring-down on the arrest; displacements are along the slip.

    Args:
        record, found: of the run.
        number: of the event in it, from 0.
        which: one of :data:`PARTS`.

    Returns:
        None where the record does not hold it.
    """
    event = found.events[number]
    first, last = float(record.time[0]), float(record.time[-1])
    before = found.events[number - 1] if number else None
    after = found.events[number + 1].t_onset if number + 1 < len(found.events) else last
    if which == CREEP:
        begin = first if before is None else min(before.t_arrest + AFTER * before.duration, event.t_onset)
        span, at = (begin, event.t_onset), (event.t_onset, event.x_onset)
    elif which == SLIP:
        margin = MARGIN * event.duration
        span, at = (max(event.t_onset - margin, first), event.t_arrest + margin), (event.t_onset, event.x_onset)
    else:
        span, at = (
            (event.t_arrest, min(event.t_arrest + AFTER * event.duration, after)),
            (event.t_arrest, event.x_arrest),
        )
    t, x = reduced(record.time, record.position, *span, points=POINTS)
    if t.size < 2:
        return None
    return t - at[0], (x - at[1]) * (event.direction or 1)
