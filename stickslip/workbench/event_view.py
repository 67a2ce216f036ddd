"""The chosen event beside the other events of its run: creep, slip and ring-down, each laid on the others."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..objects.campaign import Campaign
from .event_parts import PARTS, Curve, part
from .figures import figure, label, look, source, unit_of
from .overview import events_of, record
from .picked import chosen
from .session import Session, watch

OTHERS = 40  # events that are drawn thin
FROM = {"creep": "time before the onset", "slip": "time after the onset", "ring-down": "time after the arrest"}


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
        watch(session, ["run", "event", "campaign"], self.update)
        self.update()

    def _make(self, name: str) -> Any:
        theme = look()
        made = figure(name, label(FROM[name], "s"), height=260, output_backend="canvas")
        made.multi_line("t", "y", source=self._others[name], color=theme.band, line_width=1, line_alpha=0.7)
        self._own[name].name = f"event {name}"
        made.line("t", "y", source=self._own[name], color=theme.model, line_width=2.5)
        made.xaxis.ticker.desired_num_ticks = 4
        return made

    def update(self) -> None:
        """Show the chosen event."""
        campaign = self._session.campaign
        if campaign is None:
            return
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
