"""*Keep*: the history of steps, results as run folders, and the same as lines of Python and commands to copy."""

from __future__ import annotations

from typing import Any

import panel as pn

from . import history_text
from .background_work import background
from .folders_view import Folders
from .page_parts import Copy, Table, head
from .session import Session, watch
from .widgets import Words


def page(session: Session) -> Any:
    """The page of a session."""
    folders = Folders(session)
    both = pn.Row(pn.Column(*_history(session), *_lines(session)), pn.Column(folders.view, margin=(0, 0, 0, 24)))
    return pn.Column(both, folders.shown, margin=(8, 0, 24, 0))


def _history(session: Session) -> list[Any]:
    columns = ["step", "what was done", "when", "error / floors", "on unseen runs", ""]
    made = Table(session.show, columns=columns, tall=360)

    def update() -> None:
        made.param.update(rows=history_text.rows(session), chosen=session.at)

    watch(session, ["steps", "at"], update, now=True)
    floors = Words(text="Errors are in floors of each step's own model: 1 is as good as the data allow.")
    return [head("History: a click shows the model after a step; later steps remain available"), made, floors]


def _lines(session: Session) -> list[Any]:
    python, shell = Copy(), Copy()

    def update() -> None:
        python.text, shell.text = history_text.python(session), history_text.commands(session)

    for name in history_text.SIMULATIONS:
        watch(background(session, name), ["doing"], update)
    watch(session, ["steps", "at", "campaign"], update, now=True)
    return [head("The same in Python, in the campaign's folder"), python, head("and as commands"), shell]
