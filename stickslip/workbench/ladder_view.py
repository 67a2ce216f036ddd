"""The ladder: fitted and unseen error of every model on the way to the present one."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import FixedTicker, HoverTool
from bokeh.models.annotations import Span

from ..system.units import shown_with
from .figures import figure, legend, look, source
from .session import Session, watch

MANY = 4  # models of a ladder, above which their names are written aslant
FLOORS = (
    "Errors are in floors: 1 is as good as noise and scatter of the data allow. All errors here are divided by the "
    "floors of the last model, so those of earlier models differ from the errors in the head and the history. Gain: by "
    "how much the cost (chi-square, no unit) fell."
)
CARD = "background: var(--wb-surface); border: 1px solid var(--wb-line); border-radius: 4px; padding: 8px 12px;"


class Ladder:
    """Fitted and unseen error of every model on the way here."""

    def __init__(self, session: Session) -> None:
        self._session = session
        theme = look()
        self._of: Any = None
        self._data = source(rung=[], fitted=[], unseen=[], rung_value=[], fitted_text=[], unseen_text=[])
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
            HoverTool(tooltips=[("step", "@rung_value"), ("fitted", "@fitted_text"), ("unseen", "@unseen_text")])
        )
        self.figure.x_range.range_padding = 0.4
        self.figure.y_range.start = 0.0
        legend(self.figure)
        self.table = pn.pane.HTML("")
        watch(session, ["steps", "at"], self.update, now=True)

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
            "rung_value": steps, "fitted_text": _texts(shown, "error", "error std"),
            "unseen_text": _texts(shown, "unseen error", "unseen std"),
        }  # fmt: skip
        self.figure.xaxis.ticker = FixedTicker(ticks=at)
        self.figure.xaxis.major_label_orientation = 0.3 if len(at) > MANY else 0.0
        self.figure.xaxis.major_label_overrides = {
            i: f"+ {step}" if not step.startswith("without") else step for i, step in zip(at, steps, strict=True)
        }
        self.table.object = _table(every)


def _texts(rungs: Any, own: str, std: str) -> list[str]:
    return [_text(value, deviation) for value, deviation in zip(rungs[own], rungs[std], strict=True)]


def _text(value: float, deviation: float) -> str:
    return shown_with(value, deviation) if np.isfinite(value) else ""


def _table(every: Any) -> str:
    cell = "padding: 2px 14px 2px 0; text-align: right; font-variant-numeric: tabular-nums"
    head = "".join(f'<th style="{cell}">{name}</th>' for name in ("fitted", "unseen", "gain"))
    lines = [f'<tr><th style="text-align: left">model</th>{head}</tr>']
    for _, row in every.iterrows():
        texts = [_text(row[own], row[std]) for own, std in (("error", "error std"), ("unseen error", "unseen std"))]
        texts.append(f"{row['gain']:.0f}" if np.isfinite(row["gain"]) else "")
        numbers = "".join(f'<td style="{cell}">{t}</td>' for t in texts)
        lines.append(f'<tr><td style="padding-right: 14px">{escape(str(row["step"]))}</td>{numbers}</tr>')
    note = f'<div style="color: var(--wb-soft); font-size: 12px; margin-top: 6px">{FLOORS}</div>'
    return f'<div style="{CARD} color: var(--wb-text); font-size: 13px"><table>{"".join(lines)}</table>{note}</div>'
