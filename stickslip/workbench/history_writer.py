"""Writing the history of a session beside its campaign, as long as no other workbench does."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from ..errors import RunFolderError
from ..objects.campaign import Campaign
from ..system.runstore import alone
from .history_file import HistoryFile

if TYPE_CHECKING:
    from .session import Session

TAKEN = "another workbench has this campaign open, or nothing can be written beside it: changes here will not be saved"


class HistoryWriter:
    """Of one session.

    Attributes:
        journal: in which its history is kept; None where it is kept nowhere.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self.journal: HistoryFile | None = None
        self._held = ExitStack()
        self._written: tuple[Any, ...] = ()

    def begin(self, campaign: Campaign) -> None:
        """Keep that of a campaign with a file, in place of one that was open before."""
        journal = HistoryFile(campaign)
        self._held.close()
        self.journal, self._written = None, ()
        try:
            self._held.enter_context(alone(journal.file))
            self.journal = journal
        except RunFolderError:
            self._session.said = TAKEN

    def write(self) -> None:
        """Write the history, if there is one and it changed."""
        session = self._session
        now = (session.steps, session.at, session.run, session.event, session.locked, session.view)
        if self.journal is None or not session.steps or now == self._written:
            return
        self._written = now
        rows = [
            {"text": s.text, "code": s.code, "command": s.command, "changed": dict(s.changed), "when": s.when}
            for s in session.steps
        ]
        more = {
            "at": session.at, "run": session.run, "event": session.event, "locked": sorted(session.locked),
            "view": session.view,
        }  # fmt: skip
        try:
            self.journal.write(rows, [s.fit for s in session.steps], more)
        except OSError as error:
            self.journal = None
            session.said = f"the history cannot be kept beside the campaign ({error.strerror or error})"

    def close(self) -> None:
        """Let another workbench keep it."""
        self._held.close()
