"""*Keep*: the history of steps, results as run folders, and the same as lines of Python and commands to copy."""

from __future__ import annotations

from datetime import datetime
from html import escape
from shlex import quote
from typing import Any

import panel as pn

from ..errors import StickslipError
from ..objects import Diagnosis, Fit
from ..system.units import shown_with
from . import kept
from .beside import Show, Tell, beside
from .controls import BUTTON, Message, Words
from .parts import Copy, Table, head, progress, row_of
from .session import Session, watch

TITLE = "Keep"
MODEL, DIAGNOSIS = "the model as it stands", "the diagnosis"
FIXED: dict[str, Any] = {"sizing_mode": "fixed"}
WIDE: dict[str, Any] = {"sizing_mode": "stretch_width"}


def page(session: Session) -> Any:
    """The page of a session."""
    folders = _Folders(session)
    left = pn.Column(*_history(session), *_lines(session), **WIDE)
    right = pn.Column(folders.view, margin=(0, 0, 0, 24), **WIDE)
    return pn.Column(pn.Row(left, right, **WIDE), folders.shown, margin=(8, 0, 24, 0), **WIDE)


def history(session: Session) -> list[list[str]]:
    """A row for each step, those that were undone among them."""
    rows = []
    for i, step in enumerate(session.steps):
        fit = step.fit
        unseen = "" if fit.by_hand else shown_with(fit.unseen_error, fit.unseen_error_std)
        undone = "undone" if i > session.at else "shown" if i == session.at else ""
        rows.append([str(i + 1), step.text, _when(step.when), shown_with(fit.error, fit.error_std), unseen, undone])
    return rows


def told(session: Session) -> dict[str, Any]:
    """The same for a run folder: the steps to the model as it stands, and lines and commands that do the same."""
    steps = [{"step": step.text, "when": step.when, "error": step.fit.error} for step in session.taken]
    return {"steps": steps, "python": session.code().splitlines(), "commands": commands(session).splitlines()}


def _when(text: str) -> str:
    """Day and time, without the day if that is today."""
    return text.removeprefix(datetime.now().strftime("%Y-%m-%d ")) if text else ""


def _history(session: Session) -> list[Any]:
    def heard(message: Message) -> None:
        number = row_of(message, len(session.steps))
        if number is not None:
            session.show(number)

    columns = ["step", "what was done", "when", "error / floors", "on unseen runs", ""]
    made = Table(columns=columns, heard=heard, tall=360, **WIDE)

    def update() -> None:
        made.param.update(rows=history(session), chosen=session.at)

    watch(session, ["steps", "at"], update)
    update()
    floors = Words(text="Errors are in floors of each step's own model: 1 is as good as the data allow.", **WIDE)
    return [head("History: a click shows the model after a step; the steps behind it can be had again"), made, floors]


def commands(session: Session) -> str:
    """Commands that come to the model as it stands, and to the diagnosis."""
    campaign, fit = session.campaign, session.fit
    if campaign is None:
        return ""
    file = quote(campaign.description.path.name)
    own = "".join(f" --effect {quote(session.shown(path))}" for path in session.effects)
    lines = []
    if fit is not None:
        by_hand = any("with_values" in step.code or "refit" in step.code for step in session.taken)
        added = "".join(f" --add {form}" for form in fit.effect_forms)
        lines.append(f"stickslip fit {file}{added}{own} --out fit")
        if by_hand:
            lines.append("# what was set by hand or locked has no command: the lines of Python have it")
    lines.append(f"stickslip diagnose {file}{own} --out diagnosis")
    return "\n".join(lines)


def _lines(session: Session) -> list[Any]:
    python, shell = Copy(**WIDE), Copy(**WIDE)

    def update() -> None:
        if session.campaign is not None:
            python.text, shell.text = session.code(), commands(session)

    watch(session, ["steps", "at", "campaign"], update)
    update()
    return [head("The same in Python, in the campaign's folder"), python, head("and as commands"), shell]


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


class _Folders:
    """Run folders beside the campaign.

    Attributes:
        view: what can be saved, and what was.
        shown: the report of one of them.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._work = beside(session, "saving")
        self._listed: list[kept.Kept] = []
        self.what = pn.widgets.RadioButtonGroup(
            options=[MODEL, DIAGNOSIS], value=MODEL, stylesheets=[BUTTON], width=270, margin=(18, 10, 0, 0), **FIXED
        )
        self.name: Any = pn.widgets.TextInput(
            name="name of the run folder", placeholder="first", width=160, margin=(0, 10, 0, 0), **FIXED
        )
        self._save = pn.widgets.Button(name="Save", width=80, stylesheets=[BUTTON], margin=(18, 0, 0, 0), **FIXED)
        self._save.on_click(lambda event: self.save())
        self._table = Table(
            columns=["run folder", "of", "verdict or error", "when"], heard=self._heard, tall=360, **WIDE
        )
        self._said = Words(**WIDE)
        self._frame = pn.pane.HTML("", **WIDE)
        self._tab = pn.widgets.Button(
            name="Open it in a tab of its own", width=220, visible=False, stylesheets=[BUTTON], **FIXED
        )
        self._tab.js_on_click(args={"pane": self._frame}, code=_OPEN)
        again = pn.widgets.Button(name="Look again", width=110, stylesheets=[BUTTON], **FIXED)
        again.on_click(lambda event: self.update())
        filed = session.campaign is not None and session.campaign.description.filed
        self.view = pn.Column(
            head("Save as a run folder beside the campaign: result.json, arrays.nc and report.html"),
            pn.FlexBox(self.what, self.name, self._save), progress(self._work),
            pn.Row(head("Run folders there; a click shows the report"), again, **WIDE),
            self._table, self._said, visible=filed, **WIDE,
        )  # fmt: skip
        self.shown = pn.Column(self._tab, self._frame, **WIDE)
        watch(self._work, ["doing"], self.update)
        watch(session, ["campaign", "steps", "diagnosis"], self.update)
        self.update()

    def save(self) -> None:
        """Save what is chosen."""
        session, name, what = self._session, self.name.value_input or self.name.value, self.what.value
        campaign = session.campaign
        found: Fit | Diagnosis | None = session.fit if what == MODEL else session.diagnosis
        if campaign is None:
            return
        if found is None:
            self._work.said = f"{what} is not there yet"
            return

        def make(tell: Tell, show: Show) -> Any:
            tell("saving", 0.0)
            folder = kept.save(found, campaign, name, tell, told(session))
            self._work.said = f"saved as {folder.name}"
            return folder

        self._work.do("saving", make)

    def update(self) -> None:
        """List what is there now."""
        campaign = self._session.campaign
        self._save.disabled = bool(self._work.doing)
        if campaign is None or not campaign.description.filed:
            return
        self._listed = kept.listed(campaign.description.folder)
        rows = [[k.name, k.kind, k.words, _when(k.when)] for k in self._listed]
        self._table.param.update(rows=rows, chosen=-1)

    def _heard(self, message: Message) -> None:
        number = row_of(message, len(self._listed))
        if number is None:
            return
        try:
            self._frame.object = framed(kept.report(self._listed[number]))
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

__all__ = ["TITLE", "page"]
