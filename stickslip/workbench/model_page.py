"""*Model against measurement*: sliders of every parameter, one cycle measured and modelled, where the error lies."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import panel as pn

from ..objects.fit import Fit
from ..objects.fit_plots import balanced, expected_band, one_cycle
from .error_map import ErrorMap
from .figures import FEW, compared, crosshair, figure, label, legend, look, source, unit_of
from .free_panel import Free
from .parameter_sliders import Knob, given, knobs, rows
from .selection import choose, cycles, selected
from .session import Session, watch
from .widgets import NATURAL, Knobs, Message, Words, button, field


def page(session: Session) -> Any:
    """The page of a session."""
    sliders, buttons = _sliders(session), _buttons(session)
    cycle = Cycle(session)
    error_map = ErrorMap(session)
    free = Free(session)
    left = pn.Column(buttons, sliders, width=350, margin=(8, 12, 0, 0))
    below = pn.Row(pn.Column(cycle.creep, free.figure, free.words), pn.Column(error_map.kind, error_map.figure))
    return pn.Row(left, pn.Column(cycle.chooser, cycle.force, cycle.residual, below, margin=(8, 0, 0, 0)))


def _buttons(session: Session) -> Any:
    made = {
        "Fit": (session.refit, "Fit all parameters that are not locked, from where they stand"),
        "Undo": (session.undo, "Show the step before"),
        "Redo": (session.redo, "Show the step after"),
        "Base": (session.back, "Show the base model again"),
    }
    found = {n: button(n, call, 76, description=words, margin=(0, 6, 0, 0)) for n, (call, words) in made.items()}

    def update() -> None:
        found["Fit"].disabled = bool(session.busy) or session.campaign is None
        found["Undo"].disabled = session.at <= 0
        found["Redo"].disabled = session.at >= len(session.steps) - 1
        found["Base"].disabled = session.at <= 0

    watch(session, ["steps", "at", "busy", "campaign"], update, now=True)
    return pn.Row(*found.values(), **NATURAL)


def _sliders(session: Session) -> Knobs:
    made: dict[str, Knob] = {}
    of: list[Fit | None] = [None]

    def heard(message: Message) -> None:
        name, kind = str(message.get("name")), message.get("kind")
        if name not in made:
            return
        place = message.get("place")
        if kind == "move" and isinstance(place, (int, float)) and np.isfinite(place):
            session.by_hand({name: made[name].value(float(place))}, over=not message.get("first"))
        elif kind == "lock":
            session.lock(name, bool(message.get("on")))

    part = Knobs(heard=heard, margin=(8, 0, 0, 0))

    def update() -> None:
        fit = session.fit
        if fit is None:
            return
        fitted = session.fitted or fit
        if fitted is not of[0]:
            of[0] = fitted
            made.clear()
            made.update(knobs(fitted))
            part.given = given(fitted)
        part.param.update(rows=rows(fit, fitted, made, session.locked), closed=bool(session.busy))

    watch(session, ["steps", "at", "locked", "busy"], update, now=True)
    return part


class Cycle:
    """One cycle: force with the residual under it, and the creep before the onset.

    Args:
        session: whose model it is.
        keys: words on the keys that choose a cycle; "" where none do.
    """

    def __init__(self, session: Session, keys: str = "   (keys: ← → cycles, ↑ ↓ runs)") -> None:
        self._session, self._keys = session, keys
        theme = look()
        self._run = field(pn.widgets.Select, "", 180, options=[], margin=(0, 8, 0, 0))
        self._where = Words(margin=(6, 0, 0, 8))
        steps = [
            button(sign, partial(self._go, step), 44, description=words, margin=(0, 4, 0, 0))
            for sign, step, words in (("◀", -1, "Cycle before (←)"), ("▶", 1, "Next cycle (→)"))
        ]
        self.chooser = pn.Row(self._run, *steps, self._where)
        self._data = source(t=[], measured=[], model=[], residual=[], low=[], high=[])
        self._data.name = "cycle"
        self._creep = source(t=[], measured=[], model=[])

        time = label("time in the cycle", "s")
        self.force = figure(y="force of the contact", height=270, output_backend=FEW, tags=[time])
        compared(self.force, self._data, self._data, ("measured", "model"), "model")
        self.force.xaxis.major_label_text_font_size = "0px"
        self.residual = figure(x=time, y="measured - model", height=190, x_range=self.force.x_range, output_backend=FEW)
        self.residual.varea(
            "t", "low", "high", source=self._data, color=theme.band, fill_alpha=0.35,
            legend_label="two standard deviations of noise and scatter",
        )  # fmt: skip
        self.residual.line("t", "residual", source=self._data, color=theme.model, line_width=1.5)
        self.residual.scatter("t", "residual", source=self._data, color=theme.model, size=3)
        self.creep = figure("creep before the onset", height=300, output_backend=FEW)
        compared(self.creep, self._creep, self._creep, ("measured", "model"), "model in balance")
        for made in (self.force, self.residual, self.creep):
            legend(made)
        self.force.min_border_left = self.residual.min_border_left = 72
        crosshair(self.force, self.residual)

        self._run.param.watch(self._chosen, "value")
        watch(session, ["steps", "at", "run", "event"], self.update, now=True)

    def _chosen(self, event: Any) -> None:
        if event.new and event.new != selected(self._session)[0]:
            choose(self._session, event.new, selected(self._session)[1])

    def _go(self, step: int) -> None:
        name, event = selected(self._session)
        choose(self._session, name, event + step)

    def update(self) -> None:
        """Draw the selected cycle; only numbers change."""
        fit = self._session.fit
        if fit is None:
            return
        name, event = selected(self._session)
        counts = cycles(self._session)
        self._run.param.update(options=list(counts), value=name)
        self._where.text = f"cycle {event + 1} of {counts[name]}{self._keys}"
        part = one_cycle(fit.force, name, event)
        t = part.time.values - part.time.values[0]
        k, force = unit_of(part.measured.values, "N")
        band = expected_band(part)
        r, small = unit_of(np.concatenate([part.residual.values, band]), "N")
        band = band * r
        self._data.data = {
            "t": t, "measured": part.measured.values * k, "model": part.model.values * k,
            "residual": part.residual.values * r, "low": -band, "high": band,
        }  # fmt: skip
        self.force.yaxis.axis_label = label("force of the contact", force)
        self.residual.yaxis.axis_label = label("measured - model", small)
        self._draw_creep(fit, part, name)

    def _draw_creep(self, fit: Fit, part: Any, name: str) -> None:
        own = part.isel(point=np.flatnonzero(part.phase.values == "creep"))
        if own.sizes["point"] < 2:
            self._creep.data = {"t": [], "measured": [], "model": []}
            return
        runs = {k.name: k for k in fit.force_fit.problem.runs}
        spring = runs[name].stiffness or fit.values["rig.spring_stiffness"]
        x, t = own.displacement.values, own.time.values
        k, unit = unit_of(x - x[0], "m")
        self._creep.data = {
            "t": t - t[-1], "measured": (x - x[0]) * k, "model": (balanced(own, spring) - x[0]) * k,
        }  # fmt: skip
        self.creep.xaxis.axis_label = label("time before the onset", "s")
        self.creep.yaxis.axis_label = label("creep", unit)
