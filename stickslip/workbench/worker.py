"""Fits in a thread of their own and searches in a process of their own, so that the windows are served meanwhile."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from cloudpickle import dumps, loads

from ..errors import StickslipError
from ..objects.result_base import Tell
from ..system.progress import cancellable

PATIENCE = 3.0  # s that a process has to end after it gave its answer; its own workers may wait for more work
STEP = 10.0  # s that a step of a fit may take, the compilation of a program in it
QUIET = "ignore::UserWarning:joblib.externals.loky.backend.resource_tracker"  # of workers that were ended


class Worker:
    """A thread that does one job after the other.

    A job of a kind that still waits is replaced by a later one of that kind: of many places a hand goes through, the
    last is always reached, and no queue grows behind it.
    """

    def __init__(self) -> None:
        self._jobs: list[tuple[float, str, Callable[[], None]]] = []
        self._changed = threading.Condition()
        self._cancel = False
        self._busy = False
        threading.Thread(target=self._run, name="worker", daemon=True).start()

    def __call__(self, kind: str, job: Callable[[], None], after: float = 0.0) -> None:
        """Have a job done.

        Args:
            kind: "" is never replaced.
            job: what to do.
            after: seconds before which it is not begun; asked for again meanwhile, they begin anew.
        """
        with self._changed:
            if after > 0.0:
                self._jobs = [j for j in self._jobs if j[1] != kind]
            elif kind and self._jobs and self._jobs[-1][1] == kind:
                self._jobs.pop()
            self._jobs.append((time.monotonic() + after, kind, job))
            self._changed.notify()

    def _next(self) -> Callable[[], None] | None:
        now = time.monotonic()
        due = next((j for j in self._jobs if j[0] <= now), None)
        if due is None:
            return None
        self._jobs.remove(due)
        return due[2]

    def cancel(self) -> None:
        """End the job that is done now at its next step, and forget what waits."""
        with self._changed:
            self._jobs.clear()
            self._cancel = self._busy

    def close(self) -> None:
        """The same, and wait for that step: compiled code that still runs when the interpreter ends would abort it."""
        self.cancel()
        begun = time.monotonic()
        while self._busy and time.monotonic() - begun < STEP:
            time.sleep(0.02)

    def _run(self) -> None:
        while True:
            with self._changed:
                while (job := self._next()) is None:
                    first = min((j[0] for j in self._jobs), default=None)
                    self._changed.wait(None if first is None else max(first - time.monotonic(), 0.0))
                self._cancel, self._busy = False, True
            try:
                with cancellable(lambda: self._cancel):
                    job()
            except Exception:  # a job tells its own errors; what is left is a fault, and the thread must live
                _fault()
            self._busy = False


class AtOnce:
    """Does a job in the same thread, in place of a :class:`Worker`."""

    def __call__(self, kind: str, job: Callable[[], None], after: float = 0.0) -> None:
        """Do it."""
        job()

    def cancel(self) -> None:
        """Nothing goes on when it is called."""

    close = cancel


class Search:
    """Long work in a process of its own, with progress.

    Args:
        work: is called there with a function that tells progress, and returns what can be pickled.
        files: with effects of one's own, loaded there first.
        tell: told the progress, in a thread of this process.
        done: given what ``work`` returned.
        failed: given the sentence of an error.
    """

    def __init__(
        self, work: Callable[[Tell], Any], files: Sequence[Path], tell: Tell, done: Callable[[Any], None],
        failed: Callable[[str], None],
    ) -> None:  # fmt: skip
        context = get_context("spawn")
        here, there = context.Pipe()
        self._process = context.Process(
            target=_child, args=(there, dumps(work), tuple(map(str, files)), os.getpid()), name="search"
        )
        self._cancelled = False
        self._process.start()
        _going.add(self)
        there.close()
        threading.Thread(target=self._listen, args=(here, tell, done, failed), name="search", daemon=True).start()

    def cancel(self) -> None:
        """End it; what it has finished so far is kept where it keeps pieces."""
        self._cancelled = True
        self._end()

    def _end(self) -> None:
        with suppress(OSError, ValueError):
            self._process.terminate()

    def _listen(
        self, here: Connection, tell: Tell, done: Callable[[Any], None], failed: Callable[[str], None]
    ) -> None:  # fmt: skip
        try:
            while True:
                kind, content = loads(here.recv_bytes())
                if self._cancelled:
                    return
                if kind == "tell":
                    tell(*content)
                else:
                    (done if kind == "done" else failed)(content)
                    return
        except (EOFError, OSError):
            if not self._cancelled:
                failed("a process was ended by the system; did memory run out?")
        except Exception:  # of a page that was told
            _fault()
        finally:
            here.close()
            self._process.join(PATIENCE)
            self._end()
            _going.discard(self)


_going: set[Search] = set()


def end_all() -> None:
    """End every search of this process, which would wait for them at its end."""
    for search in list(_going):
        search.cancel()


def _child(there: Connection, work: bytes, files: Sequence[str], parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server's own; it ends this process
    os.environ.setdefault("PYTHONWARNINGS", QUIET)
    from ..system import process
    from ..system.parent_watch import end_with

    end_with(parent)
    process.begin()
    from ..simulation.conformance import load_effects

    def tell(text: str, share: float) -> None:
        there.send_bytes(dumps(("tell", (text, share))))

    try:
        load_effects(files)
        answer = ("done", loads(work)(tell))
    except StickslipError as error:
        answer = ("failed", str(error))
    except Exception as error:
        answer = ("failed", f"{type(error).__name__}: {error}")
    there.send_bytes(dumps(answer))
    there.close()


def _fault() -> None:
    import logging

    logging.getLogger(__name__).exception("the workbench")
