"""Workers that end with the process they work for: one that is killed cannot tell them, and they would wait."""

from __future__ import annotations

import os
import time
from functools import cache
from threading import Thread

EVERY = 1.0  # s between looks


@cache
def end_with(parent: int) -> None:
    """Have this process end when its ``parent`` (a process id) is gone; one that is no child of it is left alone."""
    if os.getppid() == parent:
        Thread(target=_watch, args=(parent,), name="parent watch", daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(EVERY)
    os._exit(1)
