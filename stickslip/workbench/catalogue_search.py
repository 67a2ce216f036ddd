"""What runs for a session in separate processes: the evaluation of every effect, and the whole diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..inference.force.first_order import Promise
    from ..objects.diagnosis import Diagnosis
    from ..objects.fit import Fit
    from .session import Session
    from .worker import Search

KEPT = 8  # models whose promises are kept


class CatalogueSearch:
    """The processes of a session, which is told what they find.

    Args:
        session: whose ``promises``, ``listed``, ``diagnosis``, ``searching`` and ``searched`` are set.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._search: Search | None = None
        self._listing: Search | None = None
        self._at: tuple[Fit, int] | None = None
        self._known: dict[tuple[Fit, int], tuple[Promise, ...]] = {}

    def promises(self) -> None:
        """Evaluate every effect on top of the present model, unless that is running or known already."""
        from . import search_process

        session, fit = self._session, self._session.fitted
        if fit is None or (session.listed < 1.0 and self._at == (fit, session.loaded)):
            return
        self._at = at = (fit, session.loaded)
        if self._listing is not None:
            self._listing.cancel()
            self._listing = None
        if at in self._known:
            session.param.update(promises=self._known[at], listed=1.0)
            return
        session.param.update(promises=(), listed=0.0)
        begun: list[Search] = []

        def found(part: Sequence[Promise], share: float) -> None:
            if begun and self._listing is begun[0]:
                session.param.update(promises=(*session.promises, *part), listed=share)
                if share >= 1.0:
                    self._known = dict([*self._known.items()][1 - KEPT :]) | {at: session.promises}

        def failed(text: str) -> None:
            if begun and self._listing is begun[0]:
                session.listed, session.said = 1.0, f"the effects could not be evaluated: {text}"

        self._listing = search_process.promises(fit, session.effect_files, found, failed)
        begun.append(self._listing)

    def diagnose(self, out: Path | None) -> None:
        """The whole search, with ``out`` for its run folder; finished pieces are kept and used again."""
        from . import search_process

        session = self._session
        if session.searching:
            return
        session.param.update(searching="beginning", searched=0.0)

        def tell(text: str, share: float) -> None:
            session.param.update(searching=text.splitlines()[0], searched=share)

        def done(found: Diagnosis) -> None:
            self._search = None
            session.param.update(diagnosis=found, searching="")

        def failed(text: str) -> None:
            self._search = None
            session.param.update(searching="", said=f"the diagnosis ended: {text}")

        self._search = search_process.diagnosis(session.data, session.effect_files, out, tell, done, failed)

    def stop(self) -> None:
        """End the diagnosis; what it has finished is used when it is begun again."""
        if self._search is not None:
            self._search.cancel()
            self._search = None
        self._session.searching = ""

    def close(self) -> None:
        """End all of it."""
        self.stop()
        if self._listing is not None:
            self._listing.cancel()
