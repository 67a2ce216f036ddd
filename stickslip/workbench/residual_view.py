"""Residual force against a variable of choice, by run, with what all runs ask for and what an effect takes off."""

from __future__ import annotations

from typing import Any

import numpy as np
import panel as pn
from bokeh.models import BasicTicker, FixedTicker
from bokeh.models.annotations import Span

from ..errors import InputError
from ..objects.fit import Fit
from ..objects.fit_plots import AGAINST, WIDEST
from ..show.plots.style import PARTS
from ..system.units import shown
from . import phase_period
from .curves import bent, bent_ticks, smooth, straight
from .evidence import bins, law
from .figures import figure, label, legend, look, of_run, source, unit_of
from .phase_period import PHASE
from .saved_fields import SavedFields
from .session import Session, watch
from .widgets import field

WORDS = {"age": "time in contact", "place": "displacement", "event": "number of the event"}
CHOSEN = "effect"  # of what is remembered
BENT = ("age", "velocity")  # variables whose small values matter as much as their large ones


class Residual:
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
        options = {WORDS.get(a, a): a for a in (*AGAINST, PHASE)}
        self.against = field(
            pn.widgets.Select, "residual force against", 220, options=options, value="age", margin=(5, 10)
        )
        self.period = field(
            pn.widgets.TextInput, "folded over a period of", 260, margin=(5, 10),
            description="Shows the phase of a lead screw's turn, of a vibration, of a modulation, of a worn track",
        )  # fmt: skip
        self.figure = figure(y="residual force / floor", height=330)
        self._points: dict[str, Any] = {}
        self._medians: dict[str, Any] = {}
        self._law, self._smooth = source(x=[], y=[]), source(x=[], y=[])
        self.figure.add_layout(Span(location=0.0, dimension="width", line_color=theme.soft, line_width=1))
        asked = self.figure.line(
            "x", "y", source=self._smooth, color=theme.text, line_width=3.5,
            legend_label="smoothed median over all runs",
        )  # fmt: skip
        chosen = self.figure.line(
            "x", "y", source=self._law, color=theme.model, line_width=4, line_dash="dashed",
            legend_label="part explained by the chosen effect",
        )  # fmt: skip
        self._curves = (asked, chosen)
        self.figure.y_range.start, self.figure.y_range.end = -WIDEST, WIDEST
        self._draw_runs()
        legend(self.figure, "below", ncols=4)
        SavedFields(session, "residual", {"against": self.against, "period": self.period})
        self.against.param.watch(lambda event: self.update(), "value")
        self.period.param.watch(lambda event: self.update(), "value")
        watch(session, ["steps", "at", "promises", "campaign"], self.update)
        watch(session, ["restored"], self._restore)
        self._restore()

    def choose(self, tag: str) -> None:
        """Lay an effect over it; "" for none."""
        self.chosen = tag
        self._session.remember(CHOSEN, tag)
        self.update()

    def _restore(self) -> None:
        """Lay over it what was laid over it before."""
        tag = self._session.view.get(CHOSEN, "")
        self.chosen = tag if isinstance(tag, str) else ""
        self.update()

    def _draw_runs(self) -> None:
        """A colour and a dash for every run that has none yet, under the two curves of all runs."""
        for name in self._session.data.names:
            if name not in self._points:
                more = {**of_run(len(self._points)), "legend_label": name[:24]}
                self._points[name], self._medians[name] = source(x=[], y=[]), source(x=[], y=[])
                marks = {"color": more["color"], "legend_label": more["legend_label"]}
                self.figure.scatter("x", "y", source=self._points[name], size=3, alpha=0.35, name=name, **marks)
                self.figure.line("x", "y", source=self._medians[name], line_width=2.5, name=f"{name}, medians", **more)
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
        axis, text = (bent(x), unit) if against in BENT else (x, unit)

        def across(at: np.ndarray) -> dict[str, np.ndarray]:
            return {"x": at, "x_value": straight(at, x) if against in BENT else at}

        for run in self._points:
            own = np.flatnonzero((data.run.values == run) & use)
            own = own[np.argsort(x[own], kind="stable")]
            parts = [p for p in np.array_split(own, PARTS) if p.size]
            within = np.clip(z[own], -1.5 * WIDEST, 1.5 * WIDEST)
            self._points[run].data = {**across(axis[own]), "y": within, "y_value": z[own]}
            self._medians[run].data = {
                **across(np.array([np.median(axis[p]) for p in parts])),
                "y": np.array([np.median(z[p]) for p in parts]),
            }
        at, middle = smooth(axis[use], z[use])
        self._smooth.data = {**across(at), "y": middle}
        words = WORDS.get(against, against)
        if period is not None:
            words = f"phase of {words} over {shown(period, str(data[name].attrs['units']), 3)}"
        self.figure.xaxis.axis_label = label(words, text)
        if against in BENT:
            ticks, labels = bent_ticks(x)
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
                **across(np.array([np.median(axis[p]) for p in parts])),
                "y": [float(np.median(taken[p] / floor[p])) for p in parts],
            }

    def _over(self, fit: Fit) -> tuple[str, float | None]:
        """The variable that is drawn (of ``AGAINST``), and the period (SI) it is folded over; None for none."""
        against, text = self.against.value, str(self.period.value or "").strip()
        drive = against == PHASE
        self.period.disabled = not drive and against not in phase_period.WAYS
        example = "100 um, 20 ms, 50 Hz; empty: of the model" if drive else "100 um or 20 ms; empty: none"
        self.period.placeholder, period, wrong = example, None, ""
        try:
            if drive:
                against = "load point"
                against, period = phase_period.drive(text, fit)
            elif text and not self.period.disabled:
                period = phase_period.period(text, str(fit.force[AGAINST[against]].attrs["units"]))
        except InputError as error:
            wrong = str(error)
        if wrong or self._session.said == self._wrong:  # what was wrong is mended
            self._session.said = wrong
        self._wrong = wrong
        return against, period
