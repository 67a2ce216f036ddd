"""Where the error lies: by phase of the cycle and run, as a map; a click shows the worst cycle there."""

from __future__ import annotations

from typing import Any

import numpy as np
import panel as pn
from bokeh.events import Tap
from bokeh.models import CustomJSTickFormatter, HoverTool

from ..system.units import shown
from .figures import FEW, figure, look, source
from .selection import choose, worst
from .session import Session, watch
from .widgets import BUTTON, field

NOW = "as it stands"
WORST = 2.0  # floors at which the map is at its darkest, at least


class ErrorMap:
    """Error by phase of the cycle and run, the slowest first; a click selects the worst cycle there."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.kind = field(
            pn.widgets.RadioButtonGroup, "", 220, options=[NOW, "unseen runs"], value=NOW, stylesheets=[BUTTON],
            margin=(0, 0, 0, 70),
        )  # fmt: skip
        self._data = source(run=[], phase=[], error=[], std=[], text=[], colour=[], ink=[])
        self._data.name = "error map"
        self.figure = figure("error in floors; a click shows the worst cycle", "run, velocity of its drive",
                             "phase of the cycle", height=284, x_range=["all"], y_range=["all"],
                             output_backend=FEW)  # fmt: skip
        self.figure.rect("run", "phase", 0.96, 0.94, source=self._data, fill_color="colour", line_color=None)
        self.figure.text(
            "run", "phase", text="text", text_color="ink", text_align="center", text_baseline="middle",
            text_font_size="11px", text_line_height=1.05, source=self._data,
        )  # fmt: skip
        self.figure.add_tools(
            HoverTool(tooltips=[("run", "@run"), ("phase", "@phase"), ("error", "@error{0.000} ± @std{0.000} floors")])
        )
        self.figure.name = "error map figure"
        self.figure.grid.grid_line_color = None
        self.figure.xaxis.major_label_orientation = 0.6
        self._labels = CustomJSTickFormatter(args={"labels": {}}, code="return labels[tick] || tick")
        self.figure.xaxis.formatter = self._labels
        self.figure.toolbar_location = None
        self.figure.on_event(Tap, self._tapped)
        self.kind.param.watch(lambda event: self.update(), "value")
        watch(session, ["steps", "at"], self.update, now=True)

    def _tapped(self, event: Any) -> None:
        fit = self._session.fit
        if fit is None or event.x is None or event.y is None:
            return
        runs, phases = list(self.figure.x_range.factors), list(self.figure.y_range.factors)
        i, j = int(np.floor(event.x)), int(np.floor(event.y))
        if 0 <= i < len(runs) and 0 <= j < len(phases):
            found = worst(fit, runs[i], phases[j])
            if found is not None:
                choose(self._session, *found)

    def update(self) -> None:
        """Colour it anew."""
        fit, fitted = self._session.fit, self._session.fitted
        if fit is None or fitted is None:
            return
        now = self.kind.value == NOW
        table = fit.errors if now else fitted.unseen_errors
        spread = fit.error_deviations if now else fitted.unseen_error_deviations
        speeds = self._speeds(list(table.columns))
        runs, phases = sorted(table.columns, key=lambda run: speeds.get(run, np.inf)), list(table.index)[::-1]
        labels = {run: f"{run}, {shown(speed, 'm/s', 2)}" for run, speed in speeds.items()}
        if self._labels.args["labels"] != labels:
            self._labels.args = {"labels": labels}
        if list(self.figure.x_range.factors) != runs or list(self.figure.y_range.factors) != phases:
            self.figure.x_range.factors, self.figure.y_range.factors = runs, phases
        values, deviations = (t.loc[phases, runs].to_numpy(float).ravel() for t in (table, spread))
        top = max(float(np.nanmax(values)), WORST)
        colours = [colour(v, top) for v in values]
        self._data.data = {
            "run": runs * len(phases), "phase": [p for p in phases for _ in runs], "error": values.tolist(),
            "std": deviations.tolist(), "text": [cell(v, s) for v, s in zip(values, deviations, strict=True)],
            "colour": colours, "ink": [ink(c) for c in colours],
        }  # fmt: skip

    def _speeds(self, runs: list[str]) -> dict[str, float]:
        """Run -> velocity of its drive (m/s), for those that have one."""
        campaign = self._session.data
        speeds = {run: campaign[run].drive_velocity for run in runs if run in campaign}
        return {run: abs(speed) for run, speed in speeds.items() if speed}


def cell(value: float, std: float) -> str:
    """An error with its deviation, as it stands in the map; "" for none."""
    if not np.isfinite(value):
        return ""
    return f"{value:.2f}\n±{std:.2f}" if np.isfinite(std) else f"{value:.2f}"


def colour(value: float, top: float) -> str:
    """Colour of an error: 1 is as good as the data allow, ``top`` the worst; by factors, so that 5 among 60 is seen."""
    theme = look()
    if not np.isfinite(value):
        return theme.surface
    ends, share = (
        ((theme.middle, theme.low), 1.0 - value)
        if value < 1.0
        else ((theme.middle, theme.high), np.log(value) / np.log(top))
    )
    one, other = (np.array([int(c[i : i + 2], 16) for i in (1, 3, 5)]) for c in ends)
    mixed = one + (other - one) * float(np.clip(share, 0.0, 1.0))
    return "#" + "".join(f"{round(v):02x}" for v in mixed)


def ink(colour: str) -> str:
    """Black or white, whichever can be read on a colour."""
    r, g, b = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return "#101318" if 0.3 * r + 0.59 * g + 0.11 * b > 0.5 else "#ffffff"
