"""Long work on stderr or in a notebook: what is being done, how far it is, and how long it may still take."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from html import escape

from ..errors import ArgumentError, StickslipError

PATIENCE = 1.0  # s before anything is shown
LEAST = 0.05  # share of a stage that tells how long the rest takes
REFRESH = 0.2  # s between two states of a bar under a cell
EVERY = 30.0  # s between lines where there is no terminal
Tell = Callable[[str, float], None]  # what is being done, and the share of it that is done (0 to 1)


def silent(text: str, share: float | None = None) -> None:
    """Progress that nobody is told."""


def paced(
    show: Callable[[str, float | None, float, float | None], None],
    least: float = 0.0,
    every: float = 0.0,
    clock: Callable[[], float] | None = None,
) -> Tell:
    """Tells of long work now and then.

    Args:
        show: called with the text, the share that is done, the seconds since the beginning and those left of the stage.
        least: seconds from the beginning to the first word.
        every: seconds between two.
        clock: gives the time (s); default the one of the system that never goes back.
    """
    clock = clock or time.monotonic
    began = since = clock()  # of the whole work, and of the stage: a new one begins where the share falls
    first = before = 0.0  # shares of the stage
    last = -math.inf

    def tell(text: str, share: float | None = None) -> None:
        nonlocal since, first, before, last
        now, left = clock(), None
        if share is not None:
            if share < before:
                since, first = now, share
            before, done = share, share - first
            left = (now - since) * (1.0 - share) / done if done > LEAST and share < 1.0 else None
        if now - began >= least and now - last >= every:
            last = now
            show(text, share, now - began, left)

    return tell


@contextmanager
def working(title: str) -> Iterator[Tell]:
    """A line with a bar on stderr; gives a function ``tell(text, share=None)``.

    ``share`` (0 to 1) is how much is done; time left follows from it. A notebook shows the bar under the cell; where
    stderr is neither that nor a terminal a line is written every half minute.
    """
    if _in_notebook():
        with _cell(title) as tell:
            yield tell
    elif sys.stderr.isatty():
        with _bar(title) as tell:
            yield tell
    else:
        yield _lines(title)


def part(tell: Tell, number: int, of: int, words: str = "") -> Tell:
    """Tells the progress of one of so many parts, its number from 0, after ``words``, as that of the whole."""
    return lambda text, share: tell(f"{words}{text}", (number + share) / of)


@contextmanager
def reporting(title: str, progress: Tell | None) -> Iterator[Tell]:
    """Gives ``progress``, or what :func:`progress_to` says; where there is neither, a bar in a terminal or a notebook.

    Work that can be ended from elsewhere, as in the workbench, shows its progress there.
    """
    progress = _told.get() if progress is None else _function(progress, "progress")
    if progress is not None:
        yield progress
    elif _asked.get() is None and (_in_notebook() or sys.stderr.isatty()):
        with working(title) as tell:
            yield tell
    else:
        yield silent


def _function(tell: Tell, key: str) -> Tell:
    """What is to be told; an error where that cannot be called."""
    if not callable(tell):
        allowed = "a function of a text and the share done (0 to 1), or None"
        raise ArgumentError("progress is told to a function", key=key, value=tell, allowed=allowed)
    return tell


def _in_notebook() -> bool:
    """Whether a kernel runs this, whose front end shows what is displayed."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")


@contextmanager
def _cell(title: str) -> Iterator[Tell]:
    """A bar under the cell of a notebook, taken away when the work is done."""
    from IPython.display import HTML, display

    shown = None

    def show(text: str, share: float | None, spent: float, left: float | None) -> None:
        nonlocal shown
        rest = "" if left is None else f", {left:.0f} s left"
        done = "" if share is None else f' value="{share:.3f}"'
        page = HTML(f"{escape(title)} <progress{done}></progress> {escape(text)} ({spent:.0f} s{rest})")
        if shown is None:
            shown = display(page, display_id=True)
        else:
            shown.update(page)

    try:
        yield paced(show, PATIENCE, REFRESH)
    finally:
        if shown is not None:
            shown.update(HTML(""))


@contextmanager
def _bar(title: str) -> Iterator[Tell]:
    """A bar on a terminal."""
    from rich import progress as bars
    from rich.console import Console
    from rich.text import Text

    class Words(bars.ProgressColumn):
        def render(self, task: bars.Task) -> Text:
            return Text(str(task.fields.get("text", "")), no_wrap=True, overflow="ellipsis")

    bar = bars.Progress(
        bars.TextColumn("{task.description}", markup=False),
        bars.BarColumn(bar_width=10),
        Words(),
        bars.TimeElapsedColumn(),
        bars.TextColumn("{task.fields[left]}", markup=False),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task(title, total=None, text="", left="")
    shown = False

    def show(text: str, share: float | None, spent: float, left: float | None) -> None:
        nonlocal shown
        if not shown and spent > PATIENCE:
            bar.start()
            shown = True
        rest = "" if left is None else f"{left:.0f} s left"
        bar.update(task, text=text, total=None if share is None else 1.0, completed=share or 0.0, left=rest)

    try:
        yield paced(show)
    finally:
        if shown:
            bar.stop()


def _lines(title: str) -> Tell:
    """Tells by a line on stderr now and then, for a log."""

    def show(text: str, share: float | None, spent: float, left: float | None) -> None:
        rest = "" if left is None else f", about {left:.0f} s left of this stage"
        print(f"{title}: {text} ({spent:.0f} s{rest})", file=sys.stderr, flush=True)

    return paced(show, EVERY, EVERY)


class Cancelled(StickslipError):
    """Long work was told to end."""


_told: ContextVar[Tell | None] = ContextVar("told", default=None)
_asked: ContextVar[Callable[[], bool] | None] = ContextVar("asked", default=None)
_shown: ContextVar[Callable[[float], None] | None] = ContextVar("shown", default=None)


@contextmanager
def _within(variable: ContextVar, value: object) -> Iterator[None]:
    before = variable.set(value)
    try:
        yield
    finally:
        variable.reset(before)


def progress_to(tell: Tell | None) -> AbstractContextManager[None]:
    """Within it, long work that is given no ``progress`` of its own tells this function, and shows no bar.

    Args:
        tell: called with what is being done and the share of it that is done (0 to 1).
            None: nobody is told.

    Returns:
        What a ``with`` takes; what was before holds again after it. Other threads are not affected.

    Raises:
        ArgumentError: no function.

    Examples:
        >>> import stickslip as ss
        >>> with ss.progress_to(None):
        ...     campaign = ss.load_example()
    """
    return _within(_told, silent if tell is None else _function(tell, "tell"))


def cancellable(asked: Callable[[], bool]) -> AbstractContextManager[None]:
    """Within it :func:`breathe` raises :class:`Cancelled` once ``asked`` is true."""
    return _within(_asked, asked)


def showing(show: Callable[[float], None]) -> AbstractContextManager[None]:
    """Within it ``show`` is told which share (0 to 1) of the work is done."""
    return _within(_shown, show)


def portion(low: float, high: float, tell: Callable[[float], None] | None = None) -> AbstractContextManager[None]:
    """Within it shares count from ``low`` to ``high`` of the work around it, whose part this is; ``tell`` hears too."""
    shows = [show for show in (_shown.get(), tell) if show is not None]

    def show(share: float) -> None:
        for each in shows:
            each(low + (high - low) * share)

    return showing(show)


def breathe(share: float | None = None) -> None:
    """Called between the steps of long work, which ends here if that was asked for.

    Args:
        share: of the work that is done at most (0 to 1), where that can be said.

    Raises:
        Cancelled: it was.
    """
    asked, show = _asked.get(), _shown.get()
    if asked is not None and asked():
        raise Cancelled("cancelled")
    if share is not None and show is not None:
        show(share)
