"""Long work on stderr: what is being done, how far it is, and how long it may still take."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

PATIENCE = 1.0  # s before anything is shown
Tell = Callable[..., None]


@contextmanager
def working(title: str) -> Iterator[Tell]:
    """A line with a bar on stderr; gives a function ``tell(text, share=None)``.

    ``share`` (0 to 1) is how much is done; time left follows from it. Nothing is shown where stderr is no terminal.
    """
    if not sys.stderr.isatty():
        yield lambda text, share=None: None
        return
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
    began, shown = time.monotonic(), False

    def tell(text: str, share: float | None = None) -> None:
        nonlocal shown
        spent = time.monotonic() - began
        if not shown and spent > PATIENCE:
            bar.start()
            shown = True
        left = f"{spent / share * (1 - share):.0f} s left" if share and share > 0.02 else ""
        total = 1.0 if share is not None else None
        bar.update(task, text=text, total=total, completed=share or 0.0, left=left)

    try:
        yield tell
    finally:
        if shown:
            bar.stop()
