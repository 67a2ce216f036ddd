"""*Simulate*: the model run freely beside a measured run, over velocities, and rival effects in one experiment."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import panel as pn
from bokeh.core.properties import value
from bokeh.models import FixedTicker

from ..data.trace import Trace
from ..errors import InputError
from ..inference.force.candidates import every_form
from ..objects import Fit
from ..physics.effects import catalogue
from ..simulation.scenario.recording import Recording
from ..system.units import shown, shown_with, to_si
from . import experiments
from .beside import Show, Tell, beside
from .controls import BUTTON, Message, Words
from .evidence import LEAST, best_forms
from .experiments import MEASURES, Setting, Swept, Telling
from .figures import crosshair, figure, label, legend, look, of_run, source, unit_of
from .overview import record, reduced
from .parts import Table, head, progress, row_of
from .picked import chosen
from .session import Session, watch

TITLE = "Simulate"
POINTS = 4000  # that are drawn of a curve
LEFT = 76
RIVALS = 4  # effects that are told apart at once
FALLBACK = 1e-4  # m/s, where a run has no velocity of its own
DONE = "Each is fitted, and run freely in experiments that are easily made."
FIXED: dict[str, Any] = {"sizing_mode": "fixed"}
WIDE: dict[str, Any] = {"sizing_mode": "stretch_width"}


@dataclass(frozen=True)
class Simulated:
    """One simulated run, and what it was."""

    fit: Fit
    setting: Setting
    recording: Recording


def page(session: Session) -> Any:
    """The page of a session."""
    asked = _Asked(session)
    return pn.Column(
        asked.view, _Beside(session, asked).view, _Sweep(session, asked).view, _Experiment(session, asked).view,
        _Synthetic(session, asked).view, margin=(8, 0, 24, 0), **WIDE,
    )  # fmt: skip


def _button(name: str, call: Any, width: int = 150) -> pn.widgets.Button:
    made = pn.widgets.Button(name=name, width=width, stylesheets=[BUTTON], margin=(22, 8, 0, 0), **FIXED)
    made.on_click(lambda event: call())
    return made


class _Asked:
    """What is to be simulated."""

    def __init__(self, session: Session) -> None:
        self._session = session
        text: Any = partial(pn.widgets.TextInput, width=150, margin=(0, 10, 0, 0), **FIXED)
        self.run: Any = pn.widgets.Select(name="beside the run", options=[], width=170, margin=(0, 10, 0, 0), **FIXED)
        self.velocity = text(name="velocity of the drive")
        self.hold = text(name="a hold of", placeholder="such as 10 s")
        self.step = text(name="a step to the velocity", placeholder="such as 1 mm/s")
        self.spring, self.mass = text(name="spring"), text(name="mass")
        self.events = pn.widgets.IntInput(
            name="number of slips",
            description="At a velocity written here, and in the sweep",
            value=7,
            start=1,
            end=100,
            width=150,
            margin=(0, 10, 0, 0),
            **FIXED,
        )
        asked = (self.run, self.velocity, self.hold, self.step, self.spring, self.mass, self.events)
        self.row = pn.FlexBox(*asked, gap="6px 0")
        self.view = pn.Column(head("What is left empty is as in the measured run."), self.row, **WIDE)
        self.run.param.watch(lambda event: self._placeholders(), "value")
        watch(session, ["campaign", "run"], self._runs)
        watch(session, ["steps", "at"], self._placeholders)
        self._runs()

    def _runs(self) -> None:
        campaign, fit = self._session.campaign, self._session.fit
        if campaign is None:
            return
        names = campaign.names if fit is None else [k.name for k in fit.climbed.prepared.runs]
        run = chosen(self._session)[0]
        self.run.param.update(options=names, value=run if run in names else names[0])
        self._placeholders()

    def _placeholders(self) -> None:
        """What it is in the measured run."""
        campaign, fit = self._session.campaign, self._session.fit
        if campaign is None or self.run.value not in campaign.names:
            return
        trace = campaign[self.run.value]
        holds = trace.drive is not None and trace.drive.breakpoints.size > 0
        speed = trace.drive_velocity
        self.velocity.placeholder = "as measured" if speed is None or holds else shown(speed, "m/s")
        if fit is not None:
            spring = trace.spring_stiffness or fit.values.get("rig.spring_stiffness")
            self.spring.placeholder = "" if spring is None else shown(spring, "N/m")
            mass = fit.values.get("rig.mass", campaign.rig.mass)
            self.mass.placeholder = shown(mass, "kg") if isinstance(mass, float) else ""

    def setting(self) -> Setting:
        """As it is written now."""
        return Setting(
            str(self.run.value), self.velocity.value, self.hold.value, self.spring.value, self.mass.value,
            int(self.events.value or 1), self.step.value,
        )  # fmt: skip


def needed(session: Session) -> Fit:
    """The model as it stands.

    Raises:
        InputError: there is none yet.
    """
    if session.fit is None:
        raise InputError("there is no model yet", hint="wait until the base model is fitted")
    return session.fit


def named(fit: Fit, now: Fit | None) -> str:
    """What a curve is of: the model as it stands, or one that stood before."""
    parts = " + ".join(fit.parts)
    return f"model: {parts}" if fit is now else f"a model before: {parts}"


class _Beside:
    """One run of the model beside the measured one."""

    def __init__(self, session: Session, asked: _Asked) -> None:
        self._session, self._asked = session, asked
        self._work = beside(session, "simulation")
        theme = look()
        self._measured = source(t=[], x=[], gap=[])
        self._model = source(t=[], x=[], gap=[])
        self._model.name = "simulated"
        self.figures: dict[str, Any] = {}
        for key in ("x", "gap"):
            linked = {"x_range": self.figures["x"].x_range} if self.figures else {}
            made = figure(height=230, window_axis="x", output_backend="canvas", **linked)
            for name, data, colour, dash in (
                ("measured", self._measured, theme.measured, "solid"),
                ("model", self._model, theme.model, "dashed"),
            ):
                made.line(
                    "t", key, source=data, color=colour, line_width=2, line_dash=dash, legend_label=name,
                )  # fmt: skip
            made.min_border_left = LEFT
            self.figures[key] = made
        self.figures["x"].xaxis.major_label_text_font_size = "0px"  # it has that of the figure below
        legend(self.figures["x"])
        self._name = self.figures["x"].legend[0].items[1]
        self.figures["gap"].legend.visible = False
        crosshair(*self.figures.values())
        self._table = Table(choosing=False, **WIDE)
        self._button = _button("Simulate", self.start)
        asked.row.append(self._button)
        self.view = pn.Column(
            progress(self._work), *(pn.pane.Bokeh(f, **WIDE) for f in self.figures.values()), self._table, **WIDE
        )
        asked.run.param.watch(lambda event: self.update(), "value")
        watch(self._work, ["found", "doing"], self.update)
        watch(session, ["campaign", "steps", "at"], self.update)
        self.update()

    def start(self) -> None:
        """Simulate what is asked for."""
        setting = self._asked.setting()

        def make(tell: Tell, show: Show) -> Simulated:
            fit = needed(self._session)
            tell("simulating", 0.0)
            return Simulated(fit, setting, experiments.run(experiments.scenario(fit, setting), tell))

        self._work.do("simulating", make)

    def update(self) -> None:
        """Draw both."""
        self._button.disabled = bool(self._work.doing)
        campaign, run = self._session.campaign, self._asked.run.value
        if campaign is None or run not in campaign.names:
            return
        trace = campaign[run]
        found: Simulated | None = self._work.found
        if found is not None and (found.setting.run != run or found.fit.campaign is not campaign):
            found = None
        t, x, gap = _motion(trace, campaign.events[campaign.names.index(run)])
        k, unit = unit_of(x, "m")
        g, small = unit_of(gap, "m")
        self._measured.data = _thinned(t, x * k, gap * g)
        self.figures["x"].yaxis.axis_label = label("displacement", unit)
        self.figures["gap"].yaxis.axis_label = label("load point - block", small)
        self.figures["gap"].xaxis.axis_label = label("time from the start", "s")
        if found is None:
            self._model.data = {"t": [], "x": [], "gap": []}
        else:
            self._name.label = value(named(found.fit, self._session.fit))
            r = found.recording
            moved = r["displacement"].values
            self._model.data = _thinned(r["time"].values, moved * k, (r["drive_position"].values - moved) * g)
        own = experiments.measured(trace, campaign.events[campaign.names.index(run)])
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


def _thinned(t: np.ndarray, x: np.ndarray, gap: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a source: samples that keep the course of both."""
    if not np.isfinite(x).any():
        return {"t": np.array([]), "x": np.array([]), "gap": np.array([])}
    begin, end = float(t[0]), float(t[-1])
    kept = [np.searchsorted(t, reduced(t, np.ascontiguousarray(v), begin, end, POINTS)[0]) for v in (x, gap)]
    own = np.unique(np.concatenate(kept))
    return {"t": t[own], "x": x[own], "gap": gap[own]}


def event_rows(
    measured: dict[str, tuple[float, float, int]], found: Simulated | None, trace: Trace, now: Fit | None
) -> tuple[list[str], list[list[str]]]:  # fmt: skip
    """Means over the slips after the first, measured (in a trace) and simulated; ``now`` is the model as it stands."""
    columns = ["means ± scatter, without the first slip", *(key.replace("_", " ") for key in MEASURES)]
    if found is None:
        return columns, [["measured", *_cells(measured)]]
    model = [named(found.fit, now), *_cells(experiments.simulated(found.recording, trace))]
    verdict = str(found.recording.attrs.get("verdict", ""))
    return [*columns, "what happens"], [["measured", *_cells(measured), ""], [*model, verdict]]


SAME = 1e-6  # share of a mean below which a deviation is rounding


def _cells(values: dict[str, tuple[float, float, int]]) -> list[str]:
    out = []
    for key, unit in MEASURES.items():
        mean, std, count = values.get(key, (np.nan, np.nan, 0))
        alike = f"{shown(mean, unit, 4)} all alike"
        out.append("-" if not count else shown_with(mean, std, unit) if std > SAME * abs(mean) else alike)
    return out


def ticks(values: np.ndarray) -> list[float]:
    """Numbers 1, 2 and 5 of every decade, around some values, for a logarithmic axis."""
    known = values[np.isfinite(values) & (values > 0)]
    if not known.size:
        return []
    low, high = float(known.min()), float(known.max())
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    every = [float(f"{m}e{d}") for d in decades for m in (1, 2, 5)]
    return [v for v in every if 0.4 * low <= v <= 2.5 * high]


class _Sweep:
    """Recurrence and slip over the velocity, measured and simulated."""

    def __init__(self, session: Session, asked: _Asked) -> None:
        self._session, self._asked = session, asked
        self._work = beside(session, "sweep")
        theme = look()
        text: Any = partial(pn.widgets.TextInput, width=130, margin=(0, 10, 0, 0), **FIXED)
        self.low, self.high = text(name="velocities from"), text(name="to")
        self.points = pn.widgets.IntInput(
            name="how many", value=6, start=2, end=40, width=90, margin=(0, 10, 0, 0), **FIXED
        )
        self._button = _button("Sweep", self.start)
        self._model = source(v=[], recurrence=[], slip=[])
        self._model.name = "sweep"
        self._measured = source(v=[], recurrence=[], slip=[], run=[])
        self._bars = {key: source(xs=[], ys=[]) for key in ("recurrence", "slip")}
        self.figures: dict[str, Any] = {}
        for key in ("recurrence", "slip"):
            scales = {"x_axis_type": "log", "y_axis_type": "log" if key == "recurrence" else "linear"}
            made = figure(height=280, output_backend="canvas", **scales)
            made.line("v", key, source=self._model, color=theme.model, line_width=2, line_dash="dashed")
            made.scatter("v", key, source=self._model, color=theme.model, size=7, marker="square", legend_label="model")
            made.multi_line("xs", "ys", source=self._bars[key], color=theme.measured, line_width=1.5)
            made.scatter("v", key, source=self._measured, color=theme.measured, size=9, legend_label="measured")
            legend(made)
            self.figures[key] = made
        self._names = [made.legend[0].items[0] for made in self.figures.values()]
        self.view = pn.Column(
            head("A sweep of the velocity: means over the slips after the first, with their scatter"),
            pn.FlexBox(self.low, self.high, self.points, self._button, gap="6px 0"),
            progress(self._work),
            pn.Row(*(pn.pane.Bokeh(f, **WIDE) for f in self.figures.values()), **WIDE),
            **WIDE,
        )
        watch(self._work, ["found", "doing"], self.update)
        watch(session, ["campaign"], self._anew)
        watch(session, ["steps", "at"], self.update)
        self._prepare()

    def _anew(self) -> None:
        self._work.found = None
        self._prepare()

    def _prepare(self) -> None:
        campaign = self._session.campaign
        if campaign is None:
            return
        self._steady = experiments.steady_runs(campaign)
        speeds = [v for v, _ in self._steady.values()] or [t.drive_velocity or 1e-4 for t in campaign.traces]
        self.low.value = shown(0.5 * min(speeds), "m/s", 3).replace("µ", "u")
        self.high.value = shown(2.0 * max(speeds), "m/s", 3).replace("µ", "u")
        self.update()

    def start(self) -> None:
        """Simulate one velocity after the other."""
        setting, low, high, points = self._asked.setting(), self.low.value, self.high.value, int(self.points.value or 0)

        def make(tell: Tell, show: Show) -> Any:
            return experiments.sweep(needed(self._session), setting, low, high, points, tell, show)

        self._work.do("sweeping the velocity", make)

    def update(self) -> None:
        """Draw what there is."""
        self._button.disabled = bool(self._work.doing)
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
            self._bars[key].data = {
                "xs": [[v * k, v * k] for v in every],
                "ys": [[max(m - s, 1e-3 * m) * f, (m + s) * f] for m, s in zip(own, std, strict=True)],
            }
            self.figures[key].yaxis.axis_label = label(key, written)
            self.figures[key].xaxis.axis_label = label("velocity of the drive", unit)
            self.figures[key].xaxis.ticker = FixedTicker(ticks=ticks(velocities * k))
            if key == "recurrence":
                self.figures[key].yaxis.ticker = FixedTicker(ticks=ticks(np.concatenate([own, theirs]) * f))
        self._model.data, self._measured.data = model, measured
        if found is not None:
            for item in self._names:
                item.label = value(named(found.fit, self._session.fit))


class _Experiment:
    """Rival effects in every experiment that is easily made, so that one sees which would tell them apart."""

    def __init__(self, session: Session, asked: _Asked) -> None:
        self._session, self._asked = session, asked
        self._work = beside(session, "rivals")
        self._sets: list[tuple[tuple[str, ...], str]] = []
        self._drawn: Telling | None = None
        self._offered: list[str] = []
        self.which = pn.widgets.Select(
            name="effects that these data cannot tell apart", options=[], width=420, margin=(0, 10, 0, 0), **FIXED
        )
        self.effects: Any = pn.widgets.MultiChoice(
            name="effects to tell apart, each in the model in place of the others", options=[], value=[],
            max_items=RIVALS, width=420, margin=(0, 10, 0, 0), **FIXED,
        )  # fmt: skip
        self._button = _button("Simulate each", self.start)
        self._said = Words(**WIDE)
        self._table = Table(heard=self._heard, columns=[], rows=[], **WIDE)
        self._place = pn.Column(**WIDE)
        self.view = pn.Column(
            head("The experiment that would tell candidates apart"), self._said,
            pn.FlexBox(self.which, self.effects, self._button, gap="6px 10px"), progress(self._work), self._table,
            self._place, **WIDE,
        )  # fmt: skip
        self.which.param.watch(lambda event: self._propose(), "value")
        watch(session, ["diagnosis", "promises", "loaded"], self._offer)
        watch(session, ["campaign"], self._anew)
        watch(self._work, ["found", "doing"], self.update)
        self._offer()
        self.update()

    def _anew(self) -> None:
        self._work.found = None
        self._drawn, self._place[:], self._table.rows = None, [], []

    def _offer(self) -> None:
        self._sets = experiments.undecided(self._session.diagnosis)
        options = {" or ".join(tags): i for i, (tags, _) in enumerate(self._sets)}
        self.which.param.update(options=options, value=0 if options else None)
        self.which.visible = bool(options)
        self.effects.options = sorted({tag for tag, _ in every_form(catalogue.tags())})
        self._propose()

    def _propose(self) -> None:
        if self._sets:
            tags, text = self._sets[int(self.which.value or 0)]
            self.effects.value = [tag for tag in tags if tag in self.effects.options][:RIVALS]
            self._said.text = f"The diagnosis proposes: {text}. {DONE}"
            return
        if self.effects.value == self._offered:  # nobody chose others
            best = [p.tag for p in best_forms(self._session.promises) if p.fall > LEAST]
            self._offered = self.effects.value = [tag for tag in best if tag in self.effects.options][:2]
        self._said.text = f"The effects that promise most are offered; others can be chosen. {DONE}"

    def start(self) -> None:
        """Fit the model with each effect and simulate every experiment."""
        campaign, tags, asked = self._session.campaign, list(self.effects.value), self._asked.setting()
        if campaign is None:
            return
        if len(tags) < 2:
            self._work.said = "choose two effects at least"
            return
        told = {} if self._session.diagnosis is None else self._session.diagnosis.verdict.get("forms", {})

        def make(tell: Tell, show: Show) -> list[Telling]:
            fit = needed(self._session)
            scenario = experiments.scenario(fit, asked)
            velocity = campaign[asked.run].drive_velocity or scenario.file.drive.velocity or FALLBACK
            velocity = to_si(asked.velocity, "m/s", key="velocity") if asked.velocity.strip() else velocity
            block = scenario.file.block
            options = experiments.usual(asked, abs(velocity), block.spring_stiffness, block.mass)
            if not asked.as_measured:
                options = {"as asked for above": asked, **options}
            fits = experiments.rivals(fit, tags, told, tell)
            return experiments.tell_apart(fits, options, experiments.scatter(campaign), tell, show)

        self._work.do("fitting each of them", make)

    def _heard(self, message: Message) -> None:
        number = row_of(message, len(self._work.found or ()))
        if number is not None:
            self._draw(self._work.found[number])

    def update(self) -> None:
        """List the experiments, and draw the one in which they differ most."""
        self._button.disabled = bool(self._work.doing)
        found: list[Telling] | None = self._work.found
        if not found:
            return
        columns = ["experiment: a click draws it", "they differ most in", "by", "in scatters of one event"]
        rows = [
            [t.words, t.note or f"{t.measure.replace('_', ' ')} of slip {t.slip}",
             "" if t.note else f"{100 * t.share:.2g} %", "" if t.note else f"{t.scatters:.2g}"]
            for t in found
        ]  # fmt: skip
        self._table.param.update(columns=columns, rows=rows)
        self._draw(found[0])

    def _draw(self, telling: Telling) -> None:
        """The models side by side in one experiment."""
        found: list[Telling] = self._work.found
        campaign = self._session.campaign
        self._table.chosen = next((i for i, t in enumerate(found) if t is telling), -1)
        if telling is self._drawn or not telling.recordings or campaign is None:
            return
        self._drawn = telling
        made = [figure(name, height=280, output_backend="canvas") for name in ("displacement", "load point - block")]
        moved = {tag: r["displacement"].values for tag, r in telling.recordings.items()}
        k, unit = unit_of(np.concatenate([*moved.values()]), "m")
        for i, (tag, r) in enumerate(telling.recordings.items()):
            data = _thinned(r["time"].values, moved[tag] * k, (r["drive_position"].values - moved[tag]) * k)
            for name, own in zip(("x", "gap"), made, strict=True):
                own.line(data["t"], data[name], line_width=2, legend_label=tag, **of_run(i))
        for name, own in zip(("displacement", "load point - block"), made, strict=True):
            own.xaxis.axis_label, own.yaxis.axis_label = label("time from the start", "s"), label(name, unit)
            legend(own)
        made[1].x_range = made[0].x_range
        trace = campaign[telling.setting.run]
        rows = [[tag, *_cells(experiments.simulated(r, trace))] for tag, r in telling.recordings.items()]
        columns = [
            f"{telling.words}: means ± scatter, without the first slip", *(key.replace("_", " ") for key in MEASURES)
        ]  # fmt: skip
        table = Table(columns=columns, rows=rows, choosing=False, **WIDE)
        words = Words(text=experiments.difference(telling.recordings), **WIDE)
        self._place[:] = [words, pn.Row(*(pn.pane.Bokeh(f, **WIDE) for f in made), **WIDE), table]


class _Synthetic:
    """A synthetic record of what is asked for, in a folder of its own."""

    def __init__(self, session: Session, asked: _Asked) -> None:
        self._session, self._asked = session, asked
        self._work = beside(session, "synthetic")
        self.name: Any = pn.widgets.TextInput(
            name="folder beside the campaign", value="synthetic", width=240, margin=(0, 10, 0, 0), **FIXED
        )
        self._button = _button("Write a record", self.start)
        filed = session.campaign is not None and session.campaign.description.filed
        words = "What is asked for above as a vibrometer would record it: record.csv and campaign.toml in a new folder"
        self.view = pn.Column(
            head(words), pn.FlexBox(self.name, self._button, gap="6px 10px"), progress(self._work), visible=filed,
            **WIDE,
        )  # fmt: skip
        watch(self._work, ["doing"], self.update)

    def start(self) -> None:
        """Simulate and write it."""
        setting, name, campaign = self._asked.setting(), self.name.value, self._session.campaign
        if campaign is None:
            return

        def make(tell: Tell, show: Show) -> Any:
            folder = experiments.write(needed(self._session), setting, campaign, name, tell)
            self._work.said = f"written: stickslip open {folder.name}/campaign.toml"
            return folder

        self._work.do("simulating the record", make)

    def update(self) -> None:
        """Whether it can be pressed."""
        self._button.disabled = bool(self._work.doing)


__all__ = ["TITLE", "page"]
