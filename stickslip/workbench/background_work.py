"""Analyses of the data and simulations in threads of their own, so that sliders and fits are not held up."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary

import param

from ..errors import StickslipError
from ..system.progress import Cancelled, breathe
from .session import Session
from .worker import Tell

Show = Callable[[Any], None]


class BackgroundWork(param.Parameterized):
    """One piece of work at a time, which all windows of a session show.

    Attributes:
        doing, share: what is being done ("" for nothing), and how much of it is.
        found: what it gave last, or so far.
        said: an error in words, or what was done.
    """

    doing = param.String("")
    share = param.Number(0.0)
    found = param.Parameter(None)
    said = param.String("")

    def __init__(self, worker: Any) -> None:
        super().__init__()
        self._worker = worker

    def do(self, text: str, make: Callable[[Tell, Show], Any]) -> None:
        """Begin it, unless something is going on.

        Args:
            text: what is done, in words.
            make: is given a function that tells progress (and ends it when it was cancelled), and one that shows what
                there is so far; returns what it found, None for what was shown already.
        """
        if self.doing:
            return
        self.param.update(doing=text, share=0.0, said="")

        def tell(words: str, share: float) -> None:
            breathe()
            self.param.update(doing=words or text, share=min(max(share, 0.0), 1.0))

        def show(found: Any) -> None:
            self.found = found

        def job() -> None:
            said = ""
            try:
                found = make(tell, show)
                if found is not None:
                    self.found = found
            except Cancelled:
                said = "cancelled"
            except StickslipError as error:
                said = str(error)
            except OSError as error:
                said = f"it cannot be written or read ({error.strerror or error})"
            except Exception as error:
                said = f"a fault of the program: {type(error).__name__}: {error}"
                raise
            finally:
                self.param.update(doing="", said=said or self.said)

        self._worker("", job)

    def cancel(self) -> None:
        """End it at its next step."""
        self._worker.cancel()

    def close(self) -> None:
        """End it, and wait for that step."""
        self._worker.close()


_kept: WeakKeyDictionary[Session, dict[str, BackgroundWork]] = WeakKeyDictionary()


def background(session: Session, name: str) -> BackgroundWork:
    """The work of that name of a session."""
    own = _kept.setdefault(session, {})
    if name not in own:
        own[name] = BackgroundWork(type(session.worker)())
    return own[name]


def close_all(session: Session) -> None:
    """End all of that work of a session."""
    every = list(_kept.get(session, {}).values())
    for work in every:
        work.cancel()
    for work in every:
        work.close()
