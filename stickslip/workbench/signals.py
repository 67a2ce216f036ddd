"""The signals of the chosen run: the whole of it, and a part to pan and zoom, with its events marked."""

from __future__ import annotations

from typing import Any

import numpy as np
import panel as pn
from bokeh.events import Tap
from bokeh.models import Range1d, RangeTool

from ..data.segment import Segmentation
from ..objects.campaign import Campaign
from ..system.units import shown
from .figures import crosshair, figure, label, look, source, unit_of
from .overview import DISPLACEMENT, FORCE, GAP, Levels, Record, Window, record
from .selection import chosen, select
from .session import Session, watch

CURVES = (DISPLACEMENT, FORCE, GAP)
WHOLE = 2500  # points of the overview
ZOOM = "zoom"  # of what is remembered
PAUSE = 25  # ms between two answers to a hand that pans
NEAR = 0.015  # of the window, within which a tap hits an event
DRAWN = "canvas"  # some thousand points at 40 redraws a second; WebGL without a graphics processor: 4
LEFT = 76  # pixels of the axes' labels, so that figures above one another agree


class Signals:
    """Figures of the chosen run, which share their time.

    Attributes:
        whole: all of the run, with a frame around what the others show.
        figures: name of a signal -> its figure.
        range: of time (s), what they show.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._of: tuple[Campaign, str] | None = None
        self._record: Record | None = None
        self._found: Segmentation | None = None
        self._window = Window((0.0, 1.0))
        self._factors: dict[str, float] = {}
        self._waiting = False
        self._document = pn.state.curdoc
        self.range: Any = Range1d(start=0.0, end=1.0)
        self._curves: dict[str, tuple[Levels, str]] = {}
        self._line = source(t=[], y=[])
        self._data = {name: source(t=[], y=[]) for name in CURVES}
        self._marks = {name: source(t=[], y=[]) for name in (DISPLACEMENT, GAP)}
        self._mark = {name: source(t=[], y=[]) for name in (DISPLACEMENT, GAP)}
        self.whole = self._make_whole()
        self.figures = {name: self._make(name) for name in CURVES}
        crosshair(*self.figures.values())
        for end in ("start", "end"):
            self.range.on_change(end, self._moved)
        watch(session, ["run", "event", "campaign"], self.update)
        watch(session, ["steps"], self._fitted)
        watch(session, ["restored"], self._restore)
        self.update()
        self._restore()

    def _restore(self) -> None:
        """Show the part of the run that was shown before."""
        kept = self._session.view.get(ZOOM)
        if self._of is None or self._record is None or not isinstance(kept, dict) or kept.get("run") != self._of[1]:
            return
        begin, last = self._record.span
        ends = [min(max(float(v), begin), last) for v in (kept.get("from"), kept.get("to")) if isinstance(v, float)]
        if len(ends) == 2 and ends[0] < ends[1]:
            self.range.update(start=ends[0], end=ends[1])

    def _make_whole(self) -> Any:
        theme = look()
        made = figure(
            "the whole run", label("time", "s"), height=140, output_backend=DRAWN, x_range=Range1d(start=0.0, end=1.0)
        )
        made.line("t", "y", source=self._line, color=theme.measured)
        made.toolbar_location = None
        made.min_border_left = LEFT
        made.yaxis.ticker.desired_num_ticks = 3
        tool = RangeTool(x_range=self.range)
        tool.overlay.fill_color, tool.overlay.fill_alpha = theme.accent, 0.2
        made.add_tools(tool)
        made.on_event(Tap, self._tapped)
        return made

    def _make(self, name: str) -> Any:
        theme = look()
        made = figure(height=190, output_backend=DRAWN, x_range=self.range, window_axis="x", tags=[label("time", "s")])
        made.name = f"signal {name}"
        for tool in made.toolbar.tools[:2]:
            tool.dimensions = "width"
        made.toolbar.active_drag, made.toolbar.active_scroll = made.toolbar.tools[:2]
        self._data[name].name = f"data {name}"
        made.line("t", "y", source=self._data[name], color=theme.measured, line_width=1.5, name="record")
        if name in self._marks:
            made.scatter(
                "t", "y", source=self._marks[name], marker="inverted_triangle", size=9, color=theme.accent,
                name="onsets",
            )  # fmt: skip
            made.scatter(
                "t", "y", source=self._mark[name], marker="circle", size=15, line_width=2.5,
                line_color=theme.model, fill_alpha=0.0, name="chosen event",
            )  # fmt: skip
        made.min_border_left = LEFT
        made.y_range.range_padding = 0.25  # room for the ring around a mark at the top
        made.on_event(Tap, self._tapped)
        return made

    def update(self) -> None:
        """Show the chosen run, and mark the chosen event."""
        campaign = self._session.data
        run, event = chosen(self._session)
        if self._of != (campaign, run):
            self._of = (campaign, run)
            self._show(campaign, run)
        if self._found is not None and self._found.events:
            onset = np.array([self._found.events[event].t_onset])
            for name, mark in self._mark.items():
                mark.data = {"t": onset, "y": self._at(name, onset)}
            self._bring(float(onset[0]))

    def _fitted(self) -> None:
        """A spring that nobody measured is known from a fit on."""
        if self._of is not None and FORCE not in self._curves and GAP in self._curves:
            self._show(*self._of)

    def _force(self, campaign: Campaign, run: str, own: Record) -> tuple[dict[str, tuple[Levels, str]], str]:
        """All curves, with the spring's force from its elongation where nobody measured it, and what that is."""
        if FORCE in own.curves or GAP not in own.curves:
            return own.curves, ""
        fit, stated = self._session.fitted, campaign[run].spring_stiffness
        spring = stated or (None if fit is None else fit.values.get("rig.spring_stiffness"))
        if not spring:
            return own.curves, ""
        told = f"not measured: {'stated' if stated else 'fitted'} stiffness, {shown(spring, 'N/m', 3)}, times "
        force = own.curves[GAP][0].times(spring)
        return {**own.curves, FORCE: (force, "N")}, f"{told}load point - block, from its start"

    def _show(self, campaign: Campaign, run: str) -> None:
        number = campaign.names.index(run)
        self._found = campaign.events[number]
        self._record = own = record(campaign.traces[number], self._found)
        self._curves, told = self._force(campaign, run, own)
        self.figures[FORCE].title.text = told
        begin, end = own.span
        self._window = Window((begin, end))
        self._factors = {}
        last = [name for name in CURVES if name in self._curves][-1]
        for name, made in self.figures.items():
            made.visible = name in self._curves
            made.xaxis.axis_label = label("time", "s") if name == last else None
            made.xaxis.major_label_text_font_size = "12px" if name == last else "0px"
        for name, (curve, si) in self._curves.items():
            self._factors[name], unit = unit_of(curve.values, si)
            self.figures[name].yaxis.axis_label = label(name, unit)
        first = GAP if GAP in own.curves else DISPLACEMENT
        t, y = own.curves[first][0](begin, end, WHOLE)
        self._line.data = {"t": t, "y": y * self._factors[first]}
        axis = self.figures[first].yaxis.axis_label
        self.whole.title.text = f"{axis} of the whole run: drag or resize the frame, or scroll"
        self.whole.x_range.update(start=begin, end=end)
        onsets = np.array([e.t_onset for e in self._found.events])
        for name, marks in self._marks.items():
            marks.data = {"t": onsets, "y": self._at(name, onsets)}
            self._mark[name].data = {"t": [], "y": []}
        self.range.update(bounds=(begin, end), start=begin, end=end, reset_start=begin, reset_end=end)
        self._send()

    def _at(self, name: str, times: np.ndarray) -> np.ndarray:
        """A signal at some times, as it is shown."""
        assert self._record is not None
        if name not in self._record.curves:
            return np.full(times.size, np.nan)
        curve, _ = self._record.curves[name]
        return np.asarray(np.interp(times, curve.time, curve.values) * self._factors[name])

    def _bring(self, time: float) -> None:
        """Move the window so that a time is in it."""
        low, high = float(self.range.start), float(self.range.end)
        if low <= time <= high or self._record is None:
            return
        begin, end = self._record.span
        width = high - low
        start = min(max(time - 0.5 * width, begin), max(end - width, begin))
        self.range.update(start=start, end=start + width)

    def _moved(self, attribute: str, old: Any, new: Any) -> None:
        if self._document is None or self._document.session_context is None:
            self._send()
        elif not self._waiting:
            self._waiting = True
            self._document.add_timeout_callback(self._later, PAUSE)

    def _later(self) -> None:
        self._waiting = False
        self._send()
        if self._of is not None and self.range.start is not None and self.range.end is not None:
            shown = {"run": self._of[1], "from": float(self.range.start), "to": float(self.range.end)}
            self._session.remember(ZOOM, shown)

    def _send(self) -> None:
        """Send what is looked at and something around it, where what was sent does not serve any more."""
        if self._record is None or self.range.start is None or self.range.end is None:
            return
        needed = self._window.needed(float(self.range.start), float(self.range.end))
        if needed is None:
            return
        for name, (curve, _) in self._curves.items():
            t, y = curve(*needed)
            self._data[name].data = {"t": t, "y": y * self._factors[name]}

    def _tapped(self, event: Any) -> None:
        """Select the event whose mark was hit."""
        if self._found is None or self._of is None or event.x is None or not self._found.events:
            return
        of: Any = self.whole.x_range if event.model is self.whole else self.range
        onsets = np.array([e.t_onset for e in self._found.events])
        nearest = int(np.abs(onsets - event.x).argmin())
        if abs(onsets[nearest] - event.x) <= NEAR * (of.end - of.start):
            select(self._session, self._of[1], nearest)
