"""How a session tells what goes on in it, and what went wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import param

from ..errors import StickslipError
from ..system.progress import Cancelled, showing

if TYPE_CHECKING:
    from .session import Session


class Note(str):
    """What is said where nothing is wrong."""


class Long:
    """While it lasts the session is busy; errors that are made on purpose are said, others go on."""

    def __init__(self, session: Session, text: str = "") -> None:
        self._session, self._text = session, text
        self._shows = showing(self._show)

    def _show(self, share: float) -> None:
        self._session.share = max(share, self._session.share)

    def __enter__(self) -> None:
        if self._text:
            with param.parameterized.batch_call_watchers(self._session):
                self._session.busy, self._session.share = self._text, 0.0
            self._shows.__enter__()

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> bool:
        if self._text:
            self._shows.__exit__(None, None, None)
            self._session.busy = ""
        if isinstance(error, Cancelled):
            self._session.said = Note("cancelled; the model is as it was")
            return True
        if isinstance(error, StickslipError):
            self._session.said = str(error)
            return True
        if isinstance(error, Exception):
            from ..simulation.conformance import blamed

            if (found := blamed(error)) is not None:
                self._session.said = f"{found}; the model is as it was"
                return True
            self._session.said = f"a fault of the program, the model is as it was: {type(error).__name__}: {error}"
        return False
