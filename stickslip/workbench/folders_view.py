"""Run folders beside the campaign: what can be saved, what was, and the report of one of them."""

from __future__ import annotations

from html import escape
from typing import Any

import panel as pn

from ..errors import StickslipError
from . import run_folders, simulation_folders
from .background_work import Show, Tell, background
from .history_text import SIMULATIONS, told, when
from .page_parts import Table, head, progress, starter
from .session import Session, watch
from .widgets import Words, button, field

MODEL, DIAGNOSIS = "the model as it stands", "the diagnosis"
SIMULATED = dict(zip(("the simulation", "the sweep", "the experiments"), SIMULATIONS, strict=True))

CLOSED = (
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; img-src data:; font-src data:; style-src 'unsafe-inline'\">"
)


def framed(content: str) -> str:
    """A report within a page: nothing in it is run, and it reaches nothing."""
    closed = content.replace("<head>", f"<head>{CLOSED}", 1) if "<head>" in content else CLOSED + content
    return (
        f'<iframe sandbox srcdoc="{escape(closed, quote=True)}" title="report" '
        'style="width:100%;height:900px;border:1px solid var(--wb-line);background:white"></iframe>'
    )


class Folders:
    """Run folders beside the campaign.

    Attributes:
        view: what can be saved, and what was.
        shown: the report of one of them.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._work = background(session, "saving")
        self._listed: list[run_folders.RunFolder] = []
        self.what = field(pn.widgets.Select, "what is saved", 210, options=[MODEL, DIAGNOSIS, *SIMULATED], value=MODEL)
        self.name = field(pn.widgets.TextInput, "name of the run folder", 160, placeholder="first")
        self._table = Table(self._choose, columns=["run folder", "of", "verdict or error", "when"], tall=360)
        self._said = Words()
        self._frame = pn.pane.HTML("")
        self._tab = button("Open it in a tab of its own", lambda: None, 220, visible=False)
        self._tab.js_on_click(args={"pane": self._frame}, code=_OPEN)
        save = starter(self._work, "Save", self.save, 80, margin=(18, 0, 0, 0))
        again = button("Look again", self.update, 110)
        filed = session.data.description.filed
        self.view = pn.Column(
            head("Save as a run folder beside the campaign, as the command writes it"),
            pn.FlexBox(self.what, self.name, save), progress(self._work),
            pn.Row(head("Run folders there; a click shows the report"), again),
            self._table, self._said, visible=filed,
        )  # fmt: skip
        self.shown = pn.Column(self._tab, self._frame)
        watch(self._work, ["doing"], self.update)
        watch(session, ["campaign", "steps", "diagnosis"], self.update, now=True)

    def save(self) -> None:
        """Save what is chosen."""
        session, name, what = self._session, self.name.value_input or self.name.value, self.what.value
        found: Any = session.fit if what == MODEL else session.diagnosis if what == DIAGNOSIS else None
        if what in SIMULATED:
            found = background(session, SIMULATED[what]).found
        if found is None:
            self._work.said = f"not there yet: {what}"
            return

        def make(tell: Tell, show: Show) -> Any:
            tell("saving", 0.0)
            if what in SIMULATED:
                folder = simulation_folders.save(found, session.data, name, tell, session.options())
            else:
                folder = run_folders.save(found, session.data, name, tell, told(session))
            self._work.said = f"saved as {folder.name}"
            return folder

        self._work.do("saving", make)

    def update(self) -> None:
        """List what is there now."""
        described = self._session.data.description
        if not described.filed:
            return
        self._listed = run_folders.listed(described.folder)
        rows = [[k.name, k.kind, k.words, when(k.when)] for k in self._listed]
        self._table.param.update(rows=rows, chosen=-1)

    def _choose(self, number: int) -> None:
        try:
            self._frame.object = framed(run_folders.report(self._listed[number]))
            self._said.text, self._tab.visible, self._table.chosen = "", True, number
        except (StickslipError, OSError) as error:
            self._said.text, self._tab.visible, self._frame.object = str(error), False, ""


# a page of its own whose only content is the frame, in which nothing is run
_OPEN = """
const page = document.createElement("textarea")
page.innerHTML = pane.text
const frame = page.value.replace("height:900px", "height:97vh")
const head = "<!doctype html><meta charset='utf-8'><title>report</title><body style='margin:0'>"
const whole = new Blob([head + frame], {type: "text/html"})
window.open(URL.createObjectURL(whole), "_blank", "noopener")
"""
