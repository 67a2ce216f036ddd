"""Further parts of the pages: a table, sentences, work that goes on, lines to copy. All text is shown as it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import panel as pn
import param
from panel.custom import JSComponent

from .background_work import BackgroundWork
from .session_callbacks import watch
from .widgets import Message, Spoken, button, static

_STYLE = [static("table.css")]


class Table(Spoken):
    """A table.

    Attributes:
        columns, rows: texts.
        chosen: number of the row that is marked, -1 for none.
        choosing: whether a row can be chosen.
        tall: pixels after which it scrolls, 0 for never.

    Args:
        choose: is told the number of a row that was chosen; None where none can be.
        given: as above.
    """

    columns = param.List([])
    rows = param.List([])
    chosen = param.Integer(-1)
    choosing = param.Boolean(False)
    tall = param.Integer(0)

    _esm = static("table.js")
    _stylesheets = _STYLE

    def __init__(self, choose: Callable[[int], None] | None = None, **given: Any) -> None:
        super().__init__(heard=self._heard, choosing=choose is not None, **given)
        self._choose = choose

    def _heard(self, message: Message) -> None:
        number: Any = message.get("row")
        whole = isinstance(number, int) and not isinstance(number, bool)
        if self._choose is not None and message.get("kind") == "row" and whole and 0 <= number < len(self.rows):
            self._choose(number)


class Sentences(JSComponent):
    """Sentences under headings.

    Attributes:
        groups: tables with ``head``, ``items`` and ``mark`` ("good", "bad" or "").
        tall: pixels after which it scrolls, 0 for never.
    """

    groups = param.List([])
    tall = param.Integer(0)

    _esm = static("list.js")
    _stylesheets = _STYLE


def head(text: str) -> Sentences:
    """The heading of a part of a page."""
    return Sentences(groups=[{"head": text, "items": [], "mark": ""}], margin=(16, 0, 4, 0))


class Progress(Spoken):
    """What is being done, with a way to end it, and what came of it."""

    doing = param.String("")
    share = param.Number(0.0)
    said = param.String("")
    stopping = param.Boolean(True)

    _esm = static("work.js")
    _stylesheets = _STYLE


class Copy(JSComponent):
    """Lines with a button that copies them."""

    text = param.String("")

    _esm = static("copy.js")
    _stylesheets = _STYLE


def starter(
    work: BackgroundWork, name: str, call: Callable[[], None], width: int = 150, **more: Any
) -> pn.widgets.Button:
    """A button that begins a piece of work, and cannot be pressed while that goes on."""
    made = button(name, call, width, **{"margin": (22, 8, 0, 0), **more})

    def update() -> None:
        made.disabled = bool(work.doing)

    watch(work, ["doing"], update, now=True)
    return made


def progress(work: BackgroundWork, stopping: bool = True) -> Progress:
    """Of a piece of work."""

    def heard(message: Message) -> None:
        if message.get("kind") == "cancel":
            work.cancel()

    made = Progress(heard=heard, stopping=stopping)

    def update() -> None:
        made.param.update(doing=work.doing, share=work.share, said=work.said)

    watch(work, ["doing", "share", "said"], update, now=True)
    return made
