"""Recurrence and slip over the velocity, measured and simulated."""

from __future__ import annotations

from typing import Any

import numpy as np
import panel as pn
from bokeh.models import FixedTicker, Range1d

from ..objects import experiments
from ..objects.experiments import Swept
from ..system.units import shown
from .background_work import Show, Tell, background
from .figures import figure, label, look, source, unit_of
from .page_parts import head, progress, starter
from .saved_fields import SavedFields
from .session import Session, watch
from .simulation_form import SimulationForm, named, needed
from .widgets import Signs, field


def ticks(values: np.ndarray) -> list[float]:
    """Numbers 1, 2 and 5 of every decade, around some values, for a logarithmic axis."""
    known = values[np.isfinite(values) & (values > 0)]
    if not known.size:
        return []
    low, high = float(known.min()), float(known.max())
    decades = range(int(np.floor(np.log10(low))) - 1, int(np.ceil(np.log10(high))) + 2)
    every = [float(f"{m}e{d}") for d in decades for m in (1, 2, 5)]
    return [v for v in every if 0.39 * low <= v <= 2.6 * high]


def reach(values: np.ndarray) -> tuple[float, float]:
    """Ends of a logarithmic axis around some values, so that it has two ticks at least, however close they are."""
    known = values[np.isfinite(values) & (values > 0)]
    if not known.size:
        return 1.0, 10.0
    low, high = float(known.min()), float(known.max())
    every = ticks(known)
    first, last = max(v for v in every if v <= low), min(v for v in every if v >= high)
    if first == last:
        first, last = max(v for v in every if v < low), min(v for v in every if v > high)
    return 0.9 * first, 1.1 * last


def _scale(axis: Any, shown: Any, values: np.ndarray) -> None:
    """Ticks and ends of a logarithmic axis; what a hand has zoomed into stays until the values change."""
    axis.ticker = FixedTicker(ticks=ticks(values))
    low, high = reach(values)
    if (shown.reset_start, shown.reset_end) != (low, high):
        shown.update(start=low, end=high, reset_start=low, reset_end=high)


class SweepView:
    """Recurrence and slip over the velocity, measured and simulated."""

    def __init__(self, session: Session, asked: SimulationForm) -> None:
        self._session, self._asked = session, asked
        self._work = background(session, "sweep")
        theme = look()
        self.low, self.high = (field(pn.widgets.TextInput, name, 130) for name in ("velocities from", "to"))
        self.points = field(pn.widgets.IntInput, "how many", 90, value=6, start=2, end=40)
        self._kept = SavedFields(session, "sweep", {"low": self.low, "high": self.high, "points": self.points})
        self._model = source(v=[], recurrence=[], slip=[])
        self._model.name = "sweep"
        self._measured = source(v=[], recurrence=[], slip=[], run=[])
        self._bars = {key: source(xs=[], ys=[]) for key in ("recurrence", "slip")}
        self.figures: dict[str, Any] = {}
        for key in ("recurrence", "slip"):
            scales = {"x_axis_type": "log", "y_axis_type": "log" if key == "recurrence" else "linear"}
            made = figure(height=280, output_backend="canvas", **scales)
            made.x_range = Range1d()
            if key == "recurrence":
                made.y_range = Range1d()
            made.line("v", key, source=self._model, color=theme.model, line_width=2, line_dash="dashed", name="model")
            made.scatter(
                "v", key, source=self._model, color=theme.model, fill_alpha=0.0, line_width=2, size=13, marker="square"
            )
            made.multi_line("xs", "ys", source=self._bars[key], color=theme.measured, line_width=1.5, name="scatter")
            made.scatter("v", key, source=self._measured, color=theme.measured, size=9, name="measured")
            self.figures[key] = made
        self.signs = Signs()
        self.view = pn.Column(
            head("A sweep of the velocity: means over the slips after the first, with their scatter"),
            pn.FlexBox(self.low, self.high, self.points, starter(self._work, "Sweep", self.start), gap="6px 0"),
            progress(self._work),
            self.signs,
            pn.Row(*self.figures.values()),
        )
        watch(self._work, ["found", "doing"], self.update)
        watch(session, ["campaign"], self._anew)
        watch(session, ["steps", "at"], self.update)
        self._prepare()
        self._kept.restore()

    def _anew(self) -> None:
        self._work.found = None
        self._prepare()

    def _prepare(self) -> None:
        campaign = self._session.data
        self._steady = experiments.steady_runs(campaign)
        speeds = [v for v, _ in self._steady.values()] or [t.drive_velocity or 1e-4 for t in campaign.traces]
        with self._kept.aside():
            self.low.value = shown(0.5 * min(speeds), "m/s", 3).replace("µ", "u")
            self.high.value = shown(2.0 * max(speeds), "m/s", 3).replace("µ", "u")
        self.update()

    def start(self) -> None:
        """Simulate one velocity after the other."""
        setting, low, high, points = self._asked.setting(), self.low.value, self.high.value, int(self.points.value or 0)

        def make(tell: Tell, show: Show) -> Any:
            fit, code = needed(self._session), self._session.code()
            return experiments.sweep(fit, setting, low, high, points, tell, show, code)

        self._work.do("sweeping the velocity", make)

    def update(self) -> None:
        """Draw what there is."""
        found: Swept | None = self._work.found
        every = [v for v, _ in self._steady.values()]
        velocities = np.array([*every, *([] if found is None else found.velocities)])
        k, unit = unit_of(velocities, "m/s")
        model: dict[str, Any] = {"v": velocities[len(every) :] * k}
        measured: dict[str, Any] = {"v": np.array(every) * k, "run": list(self._steady)}
        for key, si in (("recurrence", "s"), ("slip", "m")):
            own = np.array([values[key][0] for _, values in self._steady.values()])
            std = np.array([values[key][1] for _, values in self._steady.values()])
            theirs = np.array([]) if found is None else found.mean(key)
            f, written = unit_of(np.concatenate([own, theirs]), si)
            model[key], measured[key] = theirs * f, own * f
            bars = [[max(m - s, 1e-3 * m) * f, (m + s) * f] for m, s in zip(own, std, strict=True)]
            self._bars[key].data = {"xs": [[v * k, v * k] for v in every], "ys": bars}
            self.figures[key].yaxis.axis_label = label(key, written)
            self.figures[key].xaxis.axis_label = label("velocity of the drive", unit)
            _scale(self.figures[key].xaxis, self.figures[key].x_range, velocities * k)
            if key == "recurrence":
                whole = np.concatenate([np.ravel(bars), theirs * f])
                _scale(self.figures[key].yaxis, self.figures[key].y_range, whole)
        self._model.data, self._measured.data = model, measured
        theme = look()
        signs = [{"sign": "●", "colour": theme.measured, "text": "measured"}]
        if found is not None:
            signs.append({"sign": "□", "colour": theme.model, "text": named(found.fit, self._session.fit)})
        self.signs.rows = signs
