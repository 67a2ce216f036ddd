"""*What is missing*: the residual against a variable, the catalogue by its evidence, the ladder, the backbone."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import BasicTicker, FixedTicker, HoverTool
from bokeh.models.annotations import Span
from scipy.interpolate import make_smoothing_spline

from ..errors import InputError
from ..objects import Fit
from ..objects.picture import AGAINST, PARTS, WIDEST
from ..system.units import shown, shown_with
from . import folding
from .controls import BUTTON, Catalogue, Message, Words
from .evidence import bins, law, rows
from .figures import figure, label, legend, look, of_run, source, unit_of
from .folding import PHASE
from .session import Session, watch

TITLE = "What is missing"
WORDS = {"age": "time in contact", "place": "displacement", "event": "number of the event"}
MANY = 4  # models of a ladder, above which their names are written aslant
BENT = ("age", "velocity")  # variables whose small values matter as much as their large ones
KNOTS, FEWEST = 40, 5  # medians of the smooth curve, and how many different ones it needs
FLOORS = (
    "Errors are in floors: 1 is as good as noise and scatter of the data allow. All rungs are held against the floors "
    "of the last model, so earlier ones differ from the errors that the head and the history gave them. Gain: by how "
    "much the cost (chi-square, no unit) fell."
)
CARD = "background: var(--wb-surface); border: 1px solid var(--wb-line); border-radius: 4px; padding: 8px 12px;"


def page(session: Session) -> Any:
    """The page of a session."""
    residual, ladder, bone = _Residual(session), _Ladder(session), _Backbone(session)
    listed = _Listed(session, residual)
    left = pn.Column(
        pn.Row(residual.against, residual.period, sizing_mode="stretch_width"),
        pn.pane.Bokeh(residual.figure, sizing_mode="stretch_width"),
        pn.pane.Bokeh(ladder.figure, sizing_mode="stretch_width"),
        ladder.table,
        pn.pane.Bokeh(bone.figure, sizing_mode="stretch_width"),
        bone.words,
        sizing_mode="stretch_width", margin=(8, 12, 0, 0),
    )  # fmt: skip
    right = pn.Column(listed.head, listed.part, listed.verdict, sizing_mode="stretch_width", margin=(8, 0, 0, 0))
    return pn.Row(left, right, sizing_mode="stretch_width")


class _Residual:
    """Residual force over its floor against a variable, by run, with the smooth curve of all and the effect's law.

    Attributes:
        chosen: tag of the effect that is laid over it, "" for none.
        drawn: the variable (of ``AGAINST``), and the period (SI) it is folded over, None for none.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self.chosen, self._wrong = "", ""
        self.drawn: tuple[str, float | None] = "age", None
        theme = look()
        self.against = pn.widgets.Select(
            name="residual force against", options={WORDS.get(a, a): a for a in (*AGAINST, PHASE)}, value="age",
            width=220, sizing_mode="fixed",
        )  # fmt: skip
        self.period = pn.widgets.TextInput(
            name="folded over a period of", value="", width=260, sizing_mode="fixed",
            description="Shows the phase of a lead screw's turn, of a vibration, of a modulation, of a worn track",
        )  # fmt: skip
        self.figure = figure(y="residual force / floor", height=330)
        self._points: dict[str, Any] = {}
        self._medians: dict[str, Any] = {}
        self._law, self._smooth = source(x=[], y=[]), source(x=[], y=[])
        self.figure.add_layout(Span(location=0.0, dimension="width", line_color=theme.soft, line_width=1))
        asked = self.figure.line(
            "x", "y", source=self._smooth, color=theme.text, line_width=3.5, legend_label="what all runs ask for",
        )  # fmt: skip
        chosen = self.figure.line(
            "x", "y", source=self._law, color=theme.model, line_width=4, line_dash="dashed",
            legend_label="what the chosen effect takes off",
        )  # fmt: skip
        self._curves = (asked, chosen)
        self.figure.y_range.start, self.figure.y_range.end = -WIDEST, WIDEST
        self._draw_runs()
        legend(self.figure, "below", ncols=4)
        self.against.param.watch(lambda event: self.update(), "value")
        self.period.param.watch(lambda event: self.update(), "value")
        watch(session, ["steps", "at", "promises", "campaign"], self.update)
        self.update()

    def _draw_runs(self) -> None:
        """A colour and a dash for every run that has none yet, under the two curves of all runs."""
        for name in self._session.campaign.names if self._session.campaign is not None else ():
            if name not in self._points:
                more = {**of_run(len(self._points)), "legend_label": name[:24]}
                self._points[name], self._medians[name] = source(x=[], y=[]), source(x=[], y=[])
                marks = {"color": more["color"], "legend_label": more["legend_label"]}
                self.figure.scatter("x", "y", source=self._points[name], size=3, alpha=0.35, **marks)
                self.figure.line("x", "y", source=self._medians[name], line_width=2.5, **more)
        self.figure.renderers = [*(r for r in self.figure.renderers if r not in self._curves), *self._curves]

    def update(self) -> None:
        """Draw it anew; only numbers change."""
        self._draw_runs()
        fit = self._session.fit
        if fit is None:
            return
        self.drawn = against, period = self._over(fit)
        data = fit.force
        name = AGAINST[against]
        x = np.asarray(data[name].values, float)
        floor, use = data.floor.values, ~data.left_out.values
        z = data.residual.values / floor
        if period is not None:
            x, k, unit = np.mod(x / period, 1.0), 1.0, "periods"
        else:
            k, unit = (1.0, "") if name == "event" else unit_of(x, str(data[name].attrs["units"]))
        x = x * k + (1.0 if name == "event" else 0.0)
        axis, text = (_bent(x), unit) if against in BENT else (x, unit)
        for run in self._points:
            own = np.flatnonzero((data.run.values == run) & use)
            own = own[np.argsort(x[own], kind="stable")]
            parts = [p for p in np.array_split(own, PARTS) if p.size]
            self._points[run].data = {"x": axis[own], "y": np.clip(z[own], -1.5 * WIDEST, 1.5 * WIDEST)}
            self._medians[run].data = {
                "x": np.array([np.median(axis[p]) for p in parts]), "y": np.array([np.median(z[p]) for p in parts]),
            }  # fmt: skip
        self._smooth.data = dict(zip("xy", smooth(axis[use], z[use]), strict=True))
        words = WORDS.get(against, against)
        if period is not None:
            words = f"phase of {words} over {shown(period, str(data[name].attrs['units']), 3)}"
        self.figure.xaxis.axis_label = label(words, text)
        if against in BENT:
            ticks, labels = _ticks(x)
            self.figure.xaxis.ticker = FixedTicker(ticks=ticks)
            self.figure.xaxis.major_label_overrides = labels
        else:
            self.figure.xaxis.ticker = BasicTicker()
            self.figure.xaxis.major_label_overrides = {}
        taken = law(fit, self._session.promises, self.chosen)
        if taken is None or taken.size != z.size:
            self._law.data = {"x": [], "y": []}
        else:
            parts = bins(fit, against, period)
            self._law.data = {
                "x": [float(np.median(axis[p])) for p in parts],
                "y": [float(np.median(taken[p] / floor[p])) for p in parts],
            }

    def _over(self, fit: Fit) -> tuple[str, float | None]:
        """The variable that is drawn (of ``AGAINST``), and the period (SI) it is folded over; None for none."""
        against, text = self.against.value, str(self.period.value or "").strip()
        drive = against == PHASE
        self.period.disabled = not drive and against not in folding.WAYS
        example = "100 um, 20 ms, 50 Hz; empty: of the model" if drive else "100 um or 20 ms; empty: none"
        self.period.placeholder, period, wrong = example, None, ""
        try:
            if drive:
                against = "load point"
                against, period = folding.drive(text, fit)
            elif text and not self.period.disabled:
                period = folding.period(text, str(fit.force[AGAINST[against]].attrs["units"]))
        except InputError as error:
            wrong = str(error)
        if wrong or self._session.said == self._wrong:  # what was wrong is mended
            self._session.said = wrong
        self._wrong = wrong
        return against, period


def smooth(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A smooth curve through medians of y over x, by generalised cross-validation; empty where there is too little."""
    parts = [p for p in np.array_split(np.argsort(x, kind="stable"), KNOTS) if p.size]
    at = np.array([np.median(x[p]) for p in parts])
    middle = np.array([np.median(y[p]) for p in parts])
    apart = np.unique(np.round(at / max(np.ptp(at), 1e-300), 4), return_index=True)[1] if at.size else at.astype(int)
    if apart.size < FEWEST:
        return np.zeros(0), np.zeros(0)
    along = np.linspace(at[apart[0]], at[apart[-1]], 200)
    return along, make_smoothing_spline(at[apart], middle[apart])(along)


def _knee(x: np.ndarray) -> float:
    return max(0.002 * float(np.abs(x).max(initial=0.0)), 1e-300)


def _bent(x: np.ndarray) -> np.ndarray:
    """On a scale that is linear around zero and logarithmic beyond."""
    return np.asarray(np.arcsinh(x / _knee(x)))


def _ticks(x: np.ndarray) -> tuple[list[float], dict[float, str]]:
    """Places and texts of powers of ten on that scale."""
    knee, top = _knee(x), float(np.abs(x).max(initial=0.0))
    powers = [10.0**p for p in range(int(np.ceil(np.log10(knee))), int(np.floor(np.log10(max(top, knee)))) + 1)]
    values = [0.0, *powers, *(-p for p in powers if x.min(initial=0.0) < -p)]
    at = [float(np.arcsinh(v / knee)) for v in values]
    return at, {a: f"{v:g}" for a, v in zip(at, values, strict=True)}


class _Listed:
    """The catalogue, and the diagnosis that fills it."""

    def __init__(self, session: Session, residual: _Residual) -> None:
        self._session, self._residual = session, residual
        self._diagnose = pn.widgets.Button(
            name="Diagnose", stylesheets=[BUTTON], width=110, sizing_mode="fixed", margin=(0, 10, 0, 0),
            description="Fit every effect, judge each on unseen runs, add the best, repeat (minutes, beside)",
        )  # fmt: skip
        self._diagnose.on_click(lambda event: session.diagnose())
        self._words = Words(sizing_mode="stretch_width", margin=(6, 0, 0, 0))
        self.head = pn.Row(self._diagnose, self._words, sizing_mode="stretch_width", margin=(16, 0, 8, 0))
        self.part = Catalogue(heard=self._heard, sizing_mode="stretch_width")
        self.verdict = pn.pane.HTML("", sizing_mode="stretch_width", margin=(8, 0, 0, 0))
        for field in (residual.against, residual.period):
            field.param.watch(lambda event: self.update(), "value")
        watch(session, ["steps", "at", "promises", "listed", "diagnosis", "busy", "searching", "loaded"], self.update)
        watch(session, ["steps", "at", "loaded"], self._look)
        self._looked: Any = None
        self._look()
        self.update()

    def _look(self) -> None:
        """Have the effects looked at again where the model was fitted anew."""
        fitted = self._session.fitted
        if fitted is not None and (fitted, self._session.loaded) != self._looked:
            self._looked = (fitted, self._session.loaded)
            self._session.list_promises()

    def _heard(self, message: Message) -> None:
        kind, tag, form = message.get("kind"), str(message.get("tag")), str(message.get("form"))
        if kind == "on":
            self._session.add(form)
        elif kind == "off":
            self._session.remove(tag)
        elif kind == "choose":
            self._residual.chosen = "" if self._residual.chosen == tag else tag
            self._residual.update()
            self.update()

    def update(self) -> None:
        """Fill the list anew."""
        session = self._session
        fit = session.fitted
        if fit is None:
            return
        diagnosis = session.diagnosis if not fit.effects else None  # its gains are those on top of the base
        self.part.param.update(
            rows=rows(fit, session.promises, diagnosis, *self._residual.drawn, self._residual.chosen),
            closed=bool(session.busy),
        )
        self._diagnose.disabled = bool(session.searching)
        self._words.text = (
            f"looking at the effects ({100 * session.listed:.0f} %)"
            if session.listed < 1.0
            else "by the fall of the cost (chi-square) that each promises; a click lays one over the residual"
        )
        self.verdict.object = _verdict(session.diagnosis)


def _verdict(diagnosis: Any) -> str:
    """The verdict of a diagnosis and the next experiment, as HTML."""
    if diagnosis is None:
        return ""
    told, proposed = diagnosis.verdict, diagnosis.next_experiment
    lines = [f"<b>{escape(str(told['kind']))}</b>: {escape(str(told['text']))}"]
    if proposed is not None:
        lines.append(f"<b>next experiment</b>: {escape(str(proposed['text']))}")
    return (
        f'<div class="verdict" style="{CARD} color: var(--wb-text); font-size: 14px">' + "<br>".join(lines) + "</div>"
    )


class _Ladder:
    """Fitted and unseen error of every model on the way here."""

    def __init__(self, session: Session) -> None:
        self._session = session
        theme = look()
        self._of: Any = None
        self._data = source(rung=[], fitted=[], unseen=[], step=[])
        self.figure = figure(
            "the ladder: error of every model on the way here", "model: what each rung added", "error / floors",
            height=246, output_backend="canvas",
        )  # fmt: skip
        for name, colour, dash, mark in (
            ("fitted", theme.measured, "solid", "circle"),
            ("unseen", theme.model, "dashed", "square"),
        ):
            self.figure.line(
                "rung", name, source=self._data, color=colour, line_dash=dash, line_width=2, legend_label=name
            )
            self.figure.scatter("rung", name, source=self._data, color=colour, size=8, marker=mark, legend_label=name)
        self.figure.add_layout(Span(location=1.0, dimension="width", line_color=theme.soft, line_dash="dotted"))
        self.figure.add_tools(
            HoverTool(tooltips=[("step", "@step"), ("fitted", "@fitted{0.000}"), ("unseen", "@unseen{0.000}")])
        )
        self.figure.x_range.range_padding = 0.4
        self.figure.y_range.start = 0.0
        legend(self.figure)
        self.table = pn.pane.HTML("", sizing_mode="stretch_width")
        watch(session, ["steps", "at"], self.update)
        self.update()

    def update(self) -> None:
        """Draw it anew."""
        fit = self._session.fitted
        if fit is None or fit is self._of:
            return
        self._of = fit
        every = fit.ladder
        shown = every.iloc[1:]  # the static model is far above all others, and would press them together
        at = [float(i) for i in range(len(shown))]
        steps = [str(s).removeprefix("+ ") for s in shown["step"]]
        self._data.data = {
            "rung": at, "fitted": shown["error"].to_numpy(float), "unseen": shown["unseen error"].to_numpy(float),
            "step": steps,
        }  # fmt: skip
        self.figure.xaxis.ticker = FixedTicker(ticks=at)
        self.figure.xaxis.major_label_orientation = 0.3 if len(at) > MANY else 0.0
        self.figure.xaxis.major_label_overrides = {
            i: f"+ {step}" if not step.startswith("without") else step for i, step in zip(at, steps, strict=True)
        }
        self.table.object = _table(every)


def _table(every: Any) -> str:
    cell = "padding: 2px 14px 2px 0; text-align: right; font-variant-numeric: tabular-nums"
    head = "".join(f'<th style="{cell}">{name}</th>' for name in ("fitted", "unseen", "gain"))
    lines = [f'<tr><th style="text-align: left">model</th>{head}</tr>']
    for _, row in every.iterrows():
        pairs = (("error", "error std"), ("unseen error", "unseen std"))
        texts = [shown_with(row[own], row[std]) if np.isfinite(row[own]) else "" for own, std in pairs]
        texts.append(f"{row['gain']:.0f}" if np.isfinite(row["gain"]) else "")
        numbers = "".join(f'<td style="{cell}">{t}</td>' for t in texts)
        lines.append(f'<tr><td style="padding-right: 14px">{escape(str(row["step"]))}</td>{numbers}</tr>')
    note = f'<div style="color: var(--wb-soft); font-size: 12px; margin-top: 6px">{FLOORS}</div>'
    return f'<div style="{CARD} color: var(--wb-text); font-size: 13px"><table>{"".join(lines)}</table>{note}</div>'


class _Backbone:
    """The contact's backbone as measured, with its band, a rough contact's law, and the nearest rough lines."""

    def __init__(self, session: Session) -> None:
        self._session = session
        theme = look()
        self._data = source(u=[], force=[], low=[], high=[], law=[])
        self._line = source(u=[], force=[], low=[], high=[])
        self._of: Any = None
        self._scale, self._told, self._widest = (1.0, 1.0), "", 0.0
        self.figure = figure("backbone of the contact", height=260, output_backend="canvas")
        self.figure.varea(
            "u",
            "low",
            "high",
            source=self._data,
            color=theme.band,
            fill_alpha=0.45,
            legend_label="two standard deviations",
        )
        self.figure.line("u", "force", source=self._data, color=theme.measured, line_width=2.5, legend_label="measured")
        self.figure.line(
            "u", "law", source=self._data, color=theme.model, line_width=2, line_dash="dashed",
            legend_label="rough contact: 1 - (1 - u/u_max)^p",
        )  # fmt: skip
        for edge in ("low", "high"):
            self.figure.line("u", edge, source=self._line, color=theme.soft, line_width=1, line_dash="dotted")
        self.figure.line(
            "u", "force", source=self._line, color=theme.runs[2], line_width=2, line_dash="dotdash",
            legend_label="nearest rough lines",
        )  # fmt: skip
        legend(self.figure, ncols=2)
        self.words = Words(sizing_mode="stretch_width", margin=(0, 0, 0, 12))
        watch(session, ["steps", "at"], self.update)
        watch(session, ["rough"], self.draw_line)
        self.update()

    def update(self) -> None:
        """Draw that of the last model that was fitted."""
        fit = self._session.fitted
        if fit is None or fit is self._of:
            return
        self._of = fit
        data = fit.backbone
        u_max = float(data.attrs["u_max"])
        use = data.displacement.values <= 1.6 * u_max
        u, force, std, law = (
            a[use] for a in (data.displacement.values, data.force.values, data["std"].values, data.law.values)
        )
        k, unit = unit_of(force, "N")
        m, length = unit_of(u, "m")
        self._data.data = {
            "u": u * m, "force": force * k, "low": (force - 2 * std) * k, "high": (force + 2 * std) * k, "law": law * k,
        }  # fmt: skip
        self.figure.xaxis.axis_label = label("displacement from the force-free contact", length)
        self.figure.yaxis.axis_label = label("force", unit)
        own = data.attrs
        self._scale = m, k
        self._told = f"u_max = {shown_with(u_max, own['u_max_std'], 'm')}, p = {shown_with(own['p'], own['p_std'])}"
        self._widest = float(u[-1])
        self.words.text = self._told
        self._session.find_rough_line()
        self.draw_line()

    def draw_line(self) -> None:
        """Draw the rough lines nearest to it, once they are found."""
        fit, line = self._session.rough
        if fit is None or fit is not self._of or line is None:
            self._line.data = {"u": [], "force": [], "low": [], "high": []}
            return
        m, k = self._scale
        own = line.isel(displacement=np.flatnonzero(line.displacement.values <= self._widest))
        self._line.data = {
            "u": own.displacement.values * m, "force": own.force.values * k, "low": own.later.values * k,
            "high": own.sooner.values * k,
        }  # fmt: skip
        a = line.attrs
        self.words.text = (
            f"{self._told}; nearest rough lines: H = {shown_with(a['H'], a['H_std'])}, h_rms = "
            f"{shown_with(a['h_rms'], a['h_rms_std'], 'm')} (dotted: how such contacts differ)"
        )


__all__ = ["TITLE", "page"]
