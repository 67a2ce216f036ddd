"""How pages follow a session: in the document of their window, once for many changes, and only while they are seen."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any

import param


class Place:
    """Where a page is: seen, or behind another, where it need not follow until it is seen again."""

    def __init__(self) -> None:
        self._seen = True
        self._late: dict[Callable[[], Any], None] = {}

    def call(self, update: Callable[[], Any]) -> None:
        """Call it now, or when the page is seen."""
        if self._seen:
            update()
        else:
            self._late[update] = None

    def show(self) -> None:
        """The page is seen."""
        self._seen = True
        late, self._late = list(self._late), {}
        for update in late:
            update()

    def hide(self) -> None:
        """Another page is seen."""
        self._seen = False


_place: ContextVar[Place | None] = ContextVar("place", default=None)


@contextmanager
def placed(place: Place) -> Iterator[None]:
    """What is watched within it belongs to a page at this place."""
    before = _place.set(place)
    try:
        yield
    finally:
        _place.reset(before)


def watch(session: param.Parameterized, names: Sequence[str], call: Callable[[], Any], now: bool = False) -> None:
    """Call a function whenever some of these parameters of a session change, and now where that is asked for.

    In a window it is called in its document, once for all changes since the last call, and later if its page is not
    seen; else at once. What changes while the window is being made is followed when it is there: before, a document
    loses what it is asked to call.
    """
    import panel as pn

    doc = pn.state.curdoc
    if doc is None or doc.session_context is None:
        session.param.watch(lambda *events: call(), list(names))
    else:
        _watch_within(doc, session, names, call)
    if now:
        call()


def _watch_within(doc: Any, session: param.Parameterized, names: Sequence[str], call: Callable[[], Any]) -> None:
    import panel as pn
    from panel.io import hold

    place = _place.get()
    guard = threading.Lock()
    loaded, waiting = False, False

    def run() -> None:
        nonlocal waiting
        with guard:
            waiting = False
        with hold(doc):  # in one message, which cannot overtake the one that brings the page
            if place is None:
                call()
            else:
                place.call(call)

    def changed(*events: Any) -> None:
        nonlocal waiting
        with guard:
            ask, waiting = loaded and not waiting, True
        if ask:
            doc.add_next_tick_callback(run)

    def begin() -> None:
        nonlocal loaded
        with guard:
            loaded, missed = True, waiting
        if missed:
            run()

    watcher = session.param.watch(changed, list(names))

    def gone(context: Any) -> None:
        with suppress(Exception):
            session.param.unwatch(watcher)

    doc.on_session_destroyed(gone)
    pn.state.onload(begin)
