"""One run of the model beside the measured one."""

from __future__ import annotations

from typing import Any

import numpy as np
import panel as pn
from bokeh.core.properties import value

from ..objects import experiments
from ..objects.experiments import Simulated
from .background_work import Show, Tell, background
from .figures import compared, crosshair, figure, label, legend, source, unit_of
from .overview import record
from .page_parts import Table, progress, starter
from .session import Session, watch
from .simulation_form import SimulationForm, named, needed
from .slip_tables import event_rows, thinned

LEFT = 76
TIME = label("time from the start", "s")


class SimulatedView:
    """One run of the model beside the measured one."""

    def __init__(self, session: Session, asked: SimulationForm) -> None:
        self._session, self._asked = session, asked
        self._work = background(session, "simulation")
        self._measured = source(t=[], x=[], gap=[])
        self._model = source(t=[], x=[], gap=[])
        self._model.name = "simulated"
        self.figures: dict[str, Any] = {}
        for key in ("x", "gap"):
            linked = {"x_range": self.figures["x"].x_range} if self.figures else {}
            made = figure(
                x=TIME if key == "gap" else "",
                height=230,
                window_axis="x",
                output_backend="canvas",
                tags=[TIME],
                **linked,
            )
            compared(made, self._measured, self._model, (key, key), "model", width=2)
            made.min_border_left = LEFT
            self.figures[key] = made
        self.figures["x"].xaxis.major_label_text_font_size = "0px"  # it has that of the figure below
        legend(self.figures["x"])
        self._name = self.figures["x"].legend[0].items[1]
        self.figures["gap"].legend.visible = False
        crosshair(*self.figures.values())
        self._table = Table()
        asked.row.append(starter(self._work, "Simulate", self.start))
        self.view = pn.Column(progress(self._work), *self.figures.values(), self._table)
        asked.run.param.watch(lambda event: self.update(), "value")
        watch(self._work, ["found", "doing"], self.update)
        watch(session, ["campaign", "steps", "at"], self.update, now=True)

    def start(self) -> None:
        """Simulate what is asked for."""
        setting = self._asked.setting()

        def make(tell: Tell, show: Show) -> Simulated:
            fit, code = needed(self._session), self._session.code()
            tell("simulating", 0.0)
            return Simulated(fit, setting, experiments.run(experiments.scenario(fit, setting), tell), code)

        self._work.do("simulating", make)

    def update(self) -> None:
        """Draw both."""
        campaign, run = self._session.data, self._asked.run.value
        if run not in campaign.names:
            return
        trace, events = campaign[run], campaign.events[campaign.names.index(run)]
        found: Simulated | None = self._work.found
        if found is not None and (found.setting.run != run or found.fit.campaign is not campaign):
            found = None
        t, x, gap = _motion(trace, events)
        k, unit = unit_of(x, "m")
        g, small = unit_of(gap, "m")
        self._measured.data = thinned(t, x * k, gap * g)
        self.figures["x"].yaxis.axis_label = label("displacement", unit)
        self.figures["gap"].yaxis.axis_label = label("load point - block", small)
        if found is None:
            self._model.data = {"t": [], "x": [], "gap": []}
        else:
            self._name.label = value(named(found.fit, self._session.fit))
            r = found.recording
            moved = r["displacement"].values
            self._model.data = thinned(r["time"].values, moved * k, (r["drive_position"].values - moved) * g)
        own = experiments.measured(trace, events)
        columns, rows = event_rows(own, found, trace, self._session.fit)
        self._table.param.update(columns=columns, rows=rows)


def _motion(trace: Any, events: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time from the start (s), way of the block (m), and how far the load point is ahead of it (m)."""
    own = record(trace, events)
    t = own.time - own.time[0]
    if own.unit != "m" or trace.drive is None:
        return t, np.full(t.size, np.nan), np.full(t.size, np.nan)
    x = own.position - own.position[0]
    drive = trace.drive.position(own.time)
    return t, x, drive - drive[0] - x
