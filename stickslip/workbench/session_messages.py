"""Messages of a session: what it is doing, and what went wrong."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

from ..errors import StickslipError
from ..system.progress import Cancelled, showing

if TYPE_CHECKING:
    from .session import Session


class Note(str):
    """What is said where nothing is wrong."""


@contextmanager
def long(session: Session, text: str = "") -> Iterator[None]:
    """Within it the session is busy; errors that are made on purpose are said, others go on."""

    def show(share: float) -> None:
        session.share = max(share, session.share)

    if text:
        session.param.update(busy=text, share=0.0)
    try:
        with showing(show) if text else nullcontext():
            yield
    except Cancelled:
        session.said = Note("cancelled; the model is as it was")
    except StickslipError as error:
        session.said = str(error)
    except Exception as error:
        from ..simulation.conformance import blamed

        if (found := blamed(error)) is None:
            session.said = f"a fault of the program, the model is as it was: {type(error).__name__}: {error}"
            raise
        session.said = f"{found}; the model is as it was"
    finally:
        if text:
            session.busy = ""
