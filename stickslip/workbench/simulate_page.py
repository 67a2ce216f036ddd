"""*Simulate*: the model as it stands, run freely under another drive, or beside a run that was measured."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import panel as pn

from ..errors import InputError, StickslipError
from ..objects import Fit
from ..scenario.writers import write_campaign
from ..units import to_si
from .controls import BUTTON, Words
from .figures import figure, label, legend, look, source, unit_of
from .keep_page import target
from .session import Session, watch

TITLE = "Simulate"
SETTINGS = {  # of the form: key of a scenario, unit, words
    "velocity": ("drive.velocity", "m/s", "drive velocity"),
    "mass": ("block.mass", "kg", "mass"),
    "spring": ("block.spring_stiffness", "N/m", "spring stiffness"),
}
EVENTS = 6  # slips of a run
LONGEST = 4000  # points of a curve
SWEEP = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the velocity that is asked for


def page(session: Session) -> Any:
    """The page of a session."""
    return _Simulated(session).view


def changes(values: dict[str, str]) -> list[str]:
    """Settings of the form as changes of a scenario; what is left empty stays as it is.

    Raises:
        InputError: a text that is no such quantity, or not positive.
    """
    out = []
    for name, text in values.items():
        if not text.strip():
            continue
        key, unit, words = SETTINGS[name]
        number = to_si(text.strip(), unit, key=words)
        if not number > 0.0:
            raise InputError("out of range", key=words, value=text, allowed="more than zero")
        out.append(f"{key}={number:.9g}")
    return out


def freely(fit: Fit, asked: list[str], run: str | None) -> dict[str, np.ndarray]:
    """The model under a drive: ``time``, ``recurrence`` (s), ``displacement``, ``load_point`` and ``slip`` (m)."""
    made = fit.simulate(asked, run, EVENTS)
    every = slice(None, None, max(made.sizes["time"] // LONGEST, 1))
    names = {"time": "time", "displacement": "displacement", "load_point": "drive_position"}
    kept = {name: made[own].values[every] for name, own in names.items()}
    return {**kept, "recurrence": made.recurrence.values, "slip": made.slip.values}


def swept(fit: Fit, asked: list[str], velocities: np.ndarray, tell: Callable[[float], None]) -> dict[str, np.ndarray]:
    """Recurrence (s) and slip (m) of the last slips at every velocity (m/s); nan where the block slides."""
    rows = []
    for i, velocity in enumerate(velocities):
        found = freely(fit, [*asked, f"drive.velocity={velocity:.9g}"], None)
        known = found["recurrence"].size > 1
        rows.append((found["recurrence"][-1], found["slip"][-1]) if known else (np.nan, np.nan))
        tell((i + 1) / len(velocities))
    return {"velocity": velocities, "recurrence": np.array(rows)[:, 0], "slip": np.array(rows)[:, 1]}


class _Simulated:
    """The form, the run and the sweep."""

    def __init__(self, session: Session) -> None:
        self._session = session
        theme = look()
        self._fields = {
            name: pn.widgets.TextInput(name=f"{words}", placeholder="as fitted", width=200)
            for name, (_, _, words) in SETTINGS.items()
        }
        self._run = pn.widgets.Select(name="beside the measured run", options=[""], width=200)
        buttons = {"Run": self._go, "Sweep of velocity": self._sweep, "Synthetic record": self._write}
        made = []
        for name, call in buttons.items():
            button = pn.widgets.Button(name=name, stylesheets=[BUTTON], width=200, sizing_mode="fixed")
            button.on_click(partial(self._pressed, call))
            made.append(button)
        self._words = Words(text="", sizing_mode="stretch_width")
        self._motion = source(time=[], model=[], drive=[])
        self._measured = source(time=[], measured=[])
        self._points = source(velocity=[], recurrence=[], slip=[])
        self._seen = source(velocity=[], recurrence=[], slip=[])
        self.run = figure("", label("time", "s"), label("displacement", "µm"), height=340)
        self.run.line(
            "time", "drive", source=self._motion, color=theme.band, line_dash="dashed", legend_label="load point"
        )
        self.run.line("time", "measured", source=self._measured, color=theme.measured, legend_label="measured")
        self.run.line("time", "model", source=self._motion, color=theme.model, legend_label="model, run freely")
        legend(self.run)
        self.recurrence = self._against(label("recurrence", "s"), "recurrence")
        self.slip = self._against(label("slip", "µm"), "slip")
        self.view = pn.Row(
            pn.Column(*self._fields.values(), self._run, *made, width=230, sizing_mode="fixed", margin=(8, 16, 0, 0)),
            pn.Column(
                self._words,
                pn.pane.Bokeh(self.run, sizing_mode="stretch_width"),
                pn.Row(
                    pn.pane.Bokeh(self.recurrence, sizing_mode="stretch_width"),
                    pn.pane.Bokeh(self.slip, sizing_mode="stretch_width"),
                    sizing_mode="stretch_width",
                ),
                sizing_mode="stretch_width",
                margin=(8, 0, 0, 0),
            ),
            sizing_mode="stretch_width",
        )
        watch(session, ["steps", "at"], self._offer)
        self._offer()

    def _against(self, text: str, name: str) -> Any:
        theme = look()
        made = figure("", label("drive velocity", "µm/s"), text, height=260, x_axis_type="log", y_axis_type="log")
        made.line("velocity", name, source=self._points, color=theme.model, legend_label="model")
        made.scatter("velocity", name, source=self._points, color=theme.model, size=6, legend_label="model")
        made.scatter(
            "velocity", name, source=self._seen, color=theme.measured, marker="x", size=9, legend_label="measured runs"
        )
        legend(made)
        return made

    def _offer(self) -> None:
        fit = self._session.fit
        if fit is None:
            return
        self._run.options = ["", *(d.name for d in fit.fitted.runs)]
        rows = [
            (1e6 * (t.drive_velocity or np.nan), float(np.median(gaps)), 1e6 * float(np.median(sizes)))
            for t, s in zip(fit.campaign.traces, fit.campaign.events, strict=True)
            if len(s.events) > 2
            for gaps in [np.diff([e.t_onset for e in s.events[1:]])]
            for sizes in [[e.slip for e in s.events[1:]]]
        ]
        v, r, x = (list(column) for column in zip(*rows, strict=True)) if rows else ([], [], [])
        self._seen.data = {"velocity": v, "recurrence": r, "slip": x}

    def _pressed(self, call: Callable[[Fit, list[str]], Callable[[], None]], event: Any) -> None:
        """Do long work off the thread that serves the window, and show what it gives there."""
        session, fit, doc = self._session, self._session.fit, pn.state.curdoc
        if fit is None:
            self._words.text = "there is no model yet"
            return
        try:
            asked = changes({name: str(field.value) for name, field in self._fields.items()})
        except InputError as error:
            self._words.text = str(error)
            return

        def show(update: Callable[[], None]) -> None:
            if doc is None or doc.session_context is None:
                update()
            else:
                doc.add_next_tick_callback(update)

        def job() -> None:
            try:
                update = call(fit, asked)
            except StickslipError as error:
                update = partial(setattr, self._words, "text", str(error))
            finally:
                session.busy = ""
            show(update)

        session.busy, session.share = "simulating", 0.0
        session.worker("", job)

    def _go(self, fit: Fit, asked: list[str]) -> Callable[[], None]:
        name = str(self._run.value) or None
        found = freely(fit, asked, name)

        def update() -> None:
            self._motion.data = {
                "time": found["time"], "model": 1e6 * found["displacement"], "drive": 1e6 * found["load_point"],
            }  # fmt: skip
            self._measured.data = {"time": [], "measured": []}
            if name is not None:
                trace = next(t for t in fit.climbed.prepared.traces if t.name == name)
                every = slice(None, None, max(trace.time.size // LONGEST, 1))
                assert trace.displacement is not None
                start = trace.time[0]
                self._measured.data = {"time": trace.time[every] - start, "measured": 1e6 * trace.displacement[every]}
            slips = found["slip"][np.isfinite(found["slip"])]
            k, unit = unit_of(slips, "m") if slips.size else (1.0, "m")
            size = f", the last of {slips[-1] * k:.3g} {unit}" if slips.size else ""
            self._words.text = f"{slips.size} slips{size}"

        return update

    def _sweep(self, fit: Fit, asked: list[str]) -> Callable[[], None]:
        given = [a for a in asked if not a.startswith("drive.velocity")]
        text = str(self._fields["velocity"].value)
        middle = to_si(text, "m/s") if text.strip() else fit.fitted.runs[0].velocity
        session = self._session
        found = swept(fit, given, middle * np.array(SWEEP), lambda share: setattr(session, "share", share))

        def update() -> None:
            self._points.data = {
                "velocity": 1e6 * found["velocity"], "recurrence": found["recurrence"], "slip": 1e6 * found["slip"],
            }  # fmt: skip
            still = int(np.isnan(found["slip"]).sum())
            self._words.text = f"at {still} of {len(SWEEP)} velocities the block slides without slips" if still else ""

        return update

    def _write(self, fit: Fit, asked: list[str]) -> Callable[[], None]:
        from ..scenario import record

        number = 1
        while (folder := target(self._session, f"simulated-{number}")).exists():
            number += 1
        made = fit.scenario(asked, None, EVENTS)
        recording = record(made)
        folder.mkdir()
        write_campaign(folder, [made], [recording])
        text = f"written to {folder.name}: a synthetic vibrometer file and its campaign.toml"
        return partial(setattr, self._words, "text", text)
