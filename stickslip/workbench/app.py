"""What one window shows: the head with what is going on, and the pages under it, each made when first looked at."""

from __future__ import annotations

import importlib
import importlib.util
import logging
from types import ModuleType
from typing import Any

import panel as pn

from .controls import Frame, Message
from .figures import dark, look
from .selection import follow
from .session import Session, judged, watch

PAGES = ("data_page", "model_page", "missing_page", "simulate_page", "keep_page")
STYLE = """
body { margin: 0; padding: 12px 18px; font-family: system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
"""
TABS = """
:host { --tab: var(--wb-text); }
.bk-tab { color: var(--wb-text); font-size: 15px; padding: 6px 14px; }
.bk-tab.bk-active { color: var(--wb-accent); background: var(--wb-surface); border-color: var(--wb-line); }
"""


def ready() -> None:
    """Panel as the workbench needs it: nothing from the network, one design."""
    pn.extension(design="native", notifications=False, sizing_mode="stretch_width", raw_css=[STYLE])


def modules() -> list[ModuleType]:
    """The pages there are."""
    found = (f"{__package__}.{name}" for name in PAGES)
    return [importlib.import_module(name) for name in found if importlib.util.find_spec(name) is not None]


def view(session: Session) -> Any:
    """The whole window of a session."""
    head = frame(session)
    every = modules()
    places = [pn.Column(sizing_mode="stretch_width", min_height=500) for _ in every]
    tabs = pn.Tabs(
        *((module.TITLE, place) for module, place in zip(every, places, strict=True)),
        sizing_mode="stretch_width", stylesheets=[TABS],
    )  # fmt: skip
    if pn.state.location is not None:
        pn.state.location.sync(tabs, {"active": "page"})

    def show(*events: Any) -> None:
        place = places[tabs.active]
        if not place.objects:
            place.append(_made(every[tabs.active], session))

    show()
    tabs.param.watch(show, "active")
    return pn.Column(head, tabs, sizing_mode="stretch_width")


def _made(module: ModuleType, session: Session) -> Any:
    try:
        return module.page(session)
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
    colours = {name: getattr(theme, name) for name in ("text", "soft", "line", "surface", "page", "band", "model")}
    made = Frame(heard=heard, dark=dark(), colours={**colours, "accent": theme.accent}, sizing_mode="stretch_width")

    def update() -> None:
        fit, campaign = session.fit, session.campaign
        step = f"   ({session.at + 1} of {len(session.steps)}: {session.taken[-1].text})" if session.taken else ""
        made.param.update(
            title=campaign.title if campaign is not None else "",
            model="" if fit is None else " + ".join(fit.parts) + step,
            busy=session.busy,
            share=session.share,
            searching=f"Diagnose: {session.searching}" if session.searching else "",
            searched=session.searched,
            said=session.said,
        )

    def errors() -> None:
        fit = session.fit
        unseen = f"{fit.unseen_error:.3f}" if fit is not None and judged(fit) else "..."
        made.errors = "" if fit is None else f"error {fit.error:.3f} fitted, {unseen} unseen"

    watch(session, ["campaign", "steps", "at", "busy", "share", "searching", "searched", "said"], update)
    watch(session, ["steps", "at", "judged"], errors)
    update()
    errors()
    return made
