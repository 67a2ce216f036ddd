"""What one window shows: the head with what is going on, and the pages under it, each made when first looked at."""

from __future__ import annotations

import importlib
import logging
from functools import partial
from types import ModuleType
from typing import Any

import panel as pn
from bokeh.models import CustomJS
from panel.theme.base import Inherit
from panel.theme.native import Native

from ..objects.example import copied
from ..system.units import shown_with
from .figures import dark, look
from .new_run_form import FirstRun
from .selection import follow
from .session import Note, Session, watch
from .session_callbacks import Place, placed
from .widgets import Frame, Message, Words, button

TITLES = {
    "data_page": "Data", "model_page": "Model against measurement", "missing_page": "What is missing",
    "simulate_page": "Simulate", "keep_page": "Keep",
}  # fmt: skip
PAGES = tuple(TITLES)
KEYED = ("data_page", "model_page")  # where the arrows go through cycles and runs
DRAWN = "This page is being drawn."  # in place of a page until it is there
STYLE = """
body { margin: 0; padding: 12px 18px; font-family: system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
"""
FIELDS = """
.bk-input::placeholder { color: var(--wb-soft); opacity: 1; }
.bk-spin-btn { --color: var(--wb-soft); }
select.bk-input:not([multiple]) {
  background-image: linear-gradient(45deg, transparent 50%, var(--wb-soft) 50%),
    linear-gradient(-45deg, transparent 50%, var(--wb-soft) 50%);
  background-position: right 12px center, right 7px center; background-size: 5px 5px;
}
"""
TABS = """
:host { --tab: var(--wb-text); }
.bk-tab { color: var(--wb-text); font-size: 15px; padding: 6px 14px; }
:host > [style*="hidden"] { height: 0; min-height: 0 !important; overflow: hidden; }
.bk-tab.bk-active { color: var(--wb-accent); background: var(--wb-surface); border-color: var(--wb-line); }
"""


GONE = """
document.getElementById("gone")?.remove()
const line = document.createElement("div")
line.id = "gone"
line.textContent = "the server does not answer: reload this page, or start it again and go on at the address " +
  "that it prints"
line.style = "position: fixed; inset: 0 0 auto 0; z-index: 99; padding: 8px 18px; font-weight: 600; " +
  "background: var(--wb-surface); color: var(--wb-text); border-bottom: 4px solid var(--wb-model)"
document.body.append(line)
"""
BACK = 'document.getElementById("gone")?.remove()'


class Plain(Native):
    """Panel's own look, with fields that can be read in both themes."""

    modifiers = {**Native.modifiers, pn.widgets.Widget: {"stylesheets": [Inherit, FIELDS]}}


def ready() -> None:
    """Panel as the workbench needs it: one design, all without a width of its own as wide as its place.

    Not by Panel's extension, which loads from the network in a notebook.
    """
    importlib.import_module("panel.models.file_dropper")  # its script is then in every window, also where none drops
    pn.config.param.update(design=Plain, notifications=False, sizing_mode="stretch_width", raw_css=[STYLE])


def module(name: str) -> ModuleType:
    """That of a page, loaded when it is first looked at: models and what fits them take seconds."""
    return importlib.import_module(f"{__package__}.{name}")


def view(session: Session) -> Any:
    """The whole window of a session."""
    head, body = frame(session), pn.Column()

    def show() -> None:
        if session.campaign is None:
            body[:] = [offers(session)]
        elif not body.objects or not isinstance(body[0], pn.Tabs):
            made = tabs(session)
            made.param.watch(lambda event: keyed(made), "active")
            keyed(made)
            body[:] = [made]

    def keyed(made: pn.Tabs) -> None:
        head.keyed = PAGES[made.active] in KEYED

    show()
    if session.campaign is None:
        watch(session, ["campaign"], show)
    if pn.state.curdoc is not None:
        pn.state.curdoc.js_on_event("connection_lost", CustomJS(code=GONE))
        pn.state.curdoc.js_on_event("client_reconnected", CustomJS(code=BACK))
    return pn.Column(head, body)


def offers(session: Session) -> Any:
    """What can be opened, to choose from, and a place to drop the first run of a campaign."""
    made: list[Any] = []
    if not session.offers:
        made.append(pn.pane.HTML(
            "No campaign file is in this folder. Write one with <code>stickslip new campaign</code>, or name one: "
            "<code>stickslip open campaign.toml</code>"
        ))  # fmt: skip
    for i, path in enumerate(session.offers):
        words = "the shipped example, in a copy below this folder" if copied(path, session.home) else str(path)
        made.append(button(f"Open {words}", partial(session.open, i), 560))
    if session.home is not None:
        made.append(FirstRun(session).view)
    return pn.Column(*made, margin=(16, 0))


def tabs(session: Session) -> pn.Tabs:
    """The pages, each made when it is first looked at."""
    places = [pn.Column(Words(text=DRAWN, margin=(24, 0)), min_height=500) for _ in PAGES]
    made_at: set[int] = set()
    made = pn.Tabs(*zip(TITLES.values(), places, strict=True), stylesheets=[TABS])
    asked = pn.state.location is not None and "page=" in str(pn.state.location.search)

    def restore() -> None:
        page = session.view.get("page")
        if not asked and not made.active and page in PAGES:  # who has turned to a page meanwhile stays there
            made.active = PAGES.index(page)

    restore()
    if pn.state.location is not None:
        pn.state.location.sync(made, {"active": "page"})

    seen = [Place() for _ in PAGES]

    def show(*events: Any) -> None:
        for i, place in enumerate(seen):
            if i != made.active:
                place.hide()
        seen[made.active].show()
        if made.active not in made_at:
            made_at.add(made.active)
            with placed(seen[made.active]):
                places[made.active][:] = [_made(PAGES[made.active], session)]

    show()
    made.param.watch(show, "active")
    made.param.watch(lambda event: session.remember("page", PAGES[event.new]), "active")
    watch(session, ["restored"], restore)
    return made


def _made(name: str, session: Session) -> Any:
    try:
        return module(name).page(session)
    except Exception as error:  # a page that fails leaves the others alive
        logging.getLogger(__name__).exception("a page")
        return pn.pane.Str(f"this page cannot be shown: {type(error).__name__}: {error}")


def frame(session: Session) -> Frame:
    """The head of the window."""

    def heard(message: Message) -> None:
        kind = message.get("kind")
        if kind == "cancel":
            session.cancel()
        elif kind == "stop":
            session.stop()
        elif kind == "dismiss":
            session.said = ""
        elif kind == "key":
            follow(session, str(message.get("key")))

    theme = look()
    colours = {
        name: getattr(theme, name) for name in ("text", "soft", "line", "surface", "page", "band", "model", "accent")
    }
    made = Frame(heard=heard, dark=dark(), colours=colours)

    def update() -> None:
        fit, campaign = session.fit, session.campaign
        step = f"   ({session.at + 1} of {len(session.steps)}: {session.taken[-1].text})" if session.taken else ""
        made.param.update(
            title=campaign.title if campaign is not None else "",
            model=_absent(session) if fit is None else " + ".join(fit.parts) + step,
            busy=session.busy,
            share=session.share,
            searching=f"Diagnose: {session.searching}" if session.searching else "",
            searched=session.searched,
            said=session.said,
            well=isinstance(session.said, Note),
        )

    def errors() -> None:
        fit, fitted = session.fit, session.fitted
        if fit is None or fitted is None:
            made.errors = ""
            return
        told = (
            f"{shown_with(fitted.error, fitted.error_std)} fitted, "
            f"{shown_with(fitted.unseen_error, fitted.unseen_error_std)} unseen"
        )
        own = shown_with(fit.error, fit.error_std)
        made.errors = f"error {own} by hand (before: {told})" if fit.by_hand else f"error {told}"

    watch(session, ["campaign", "steps", "at", "busy", "share", "searching", "searched", "said"], update, now=True)
    watch(session, ["steps", "at"], errors, now=True)
    return made


def _absent(session: Session) -> str:
    """What stands in the place of a model where there is none."""
    if session.campaign is None or session.busy:
        return ""
    return "no model yet: Fit (Model against measurement) fits the base model"
