"""The catalogue by its evidence, and the diagnosis that fills it."""

from __future__ import annotations

from html import escape
from typing import Any

import panel as pn

from .evidence import rows
from .ladder_view import CARD
from .residual_view import Residual
from .session import Session, watch
from .widgets import GAP, Catalogue, Message, Words, button


class Listed:
    """The catalogue, and the diagnosis that fills it."""

    def __init__(self, session: Session, residual: Residual) -> None:
        self._session, self._residual = session, residual
        what = "Fit every effect, judge each on unseen runs, add the best, repeat (minutes, in the background)"
        self._diagnose = button("Diagnose", session.diagnose, 110, margin=GAP, description=what)
        self._words = Words(margin=(6, 0, 0, 0))
        self.head = pn.Row(self._diagnose, self._words, margin=(16, 0, 8, 0))
        self.part = Catalogue(heard=self._heard)
        self.verdict = pn.pane.HTML("", margin=(8, 0, 0, 0))
        for field in (residual.against, residual.period):
            field.param.watch(lambda event: self.update(), "value")
        heard = ["steps", "at", "promises", "listed", "diagnosis", "busy", "searching", "loaded", "restored"]
        watch(session, heard, self.update)
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
            self._residual.choose("" if self._residual.chosen == tag else tag)
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
            f"evaluating the effects ({100 * session.listed:.0f} %)"
            if session.listed < 1.0
            else "ordered by expected fall of the cost; click to overlay an effect on the residual"
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
