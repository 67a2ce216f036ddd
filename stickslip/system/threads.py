"""Threads: one for linear algebra, and as many as there are processors for pieces of compiled work side by side.

The former is set through environment variables before numpy is imported.

The matrices of a fit are a thousand by a hundred. On two processors their singular values took 24 to 97 ms with the
two threads that OpenBLAS takes, and 6 to 7 ms with one: threads that wait for each other, and for other work on the
machine, cost more than they share. It also makes last digits independent of how many processors there are.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import TypeVar

from ..errors import ArgumentError

T = TypeVar("T")
Found = TypeVar("Found")
LIBRARIES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_for_linear_algebra() -> None:
    """Have this process, and those it starts, do linear algebra in one thread, unless the user has said otherwise."""
    for name in LIBRARIES:
        os.environ.setdefault(name, "1")


_most: ContextVar[int | None] = ContextVar("most", default=None)


@contextmanager
def processor_limit(number: int) -> Iterator[None]:
    """Within it, work is shared among so many processors at most; what was before holds again after it.

    It is the default of ``jobs`` and ``workers`` everywhere, and holds for the threads of a fit. What one operation of
    JAX or of linear algebra uses is not counted, and other threads are not affected.

    Args:
        number: of processors.

    Raises:
        InputError: less than one.

    Examples:
        ``with ss.processor_limit(2): campaign.diagnose()`` leaves the others to your colleagues.
    """
    if not isinstance(number, int) or number < 1:
        raise ArgumentError("work needs a processor", key="number", value=number, allowed="1, 2, 3, ...")
    before = _most.set(number)
    try:
        yield
    finally:
        _most.reset(before)


def processors() -> int:
    """How many processors this process may use; a queue of jobs or ``taskset`` leaves it a few of the machine's."""
    given = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(given, _most.get() or given)


@lru_cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="side by side")


def side_by_side(call: Callable[[T], Found], items: Iterable[T], sizes: Sequence[int]) -> list[Found]:
    """What a function gives for each item; it must spend its time in compiled code, and not call this again.

    The largest are begun first, so that no processor waits for one that was begun last. In a process among others that
    share the processors (see :func:`alone`) one after the other.
    """
    given = list(items)
    threads = processors()
    if threads == 1 or not _ALONE:
        return [call(item) for item in given]
    order = sorted(range(len(given)), key=lambda i: -sizes[i])
    found = dict(zip(order, _pool(threads).map(call, [given[i] for i in order]), strict=True))
    return [found[i] for i in range(len(given))]


_ALONE = True


def alone(yes: bool) -> None:
    """Say whether this process has the processors for itself."""
    global _ALONE
    _ALONE = yes
