"""Files with effects of one's own, loaded anew whenever they are saved."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path

from .session import Session


def watch(session: Session, files: Sequence[Path]) -> threading.Event:
    """Have files watched in a thread until the event that is returned is set.

    Their folders are watched and not they themselves: many editors write a new file in place of the old one.
    """
    import watchfiles

    ended = threading.Event()
    known = {path.resolve() for path in files}

    def run() -> None:
        folders = sorted({path.parent for path in known})
        for changes in watchfiles.watch(*folders, recursive=False, stop_event=ended, debounce=200, step=50):
            saved = {Path(name).resolve() for _, name in changes} & known
            for path in sorted(saved):
                if path.is_file():
                    session.reload(path)

    threading.Thread(target=run, name="effects", daemon=True).start()
    return ended
