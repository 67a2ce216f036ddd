"""Where work on many campaigns is done: a cluster of dask.distributed, of one's own or on this machine."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from ..errors import ArgumentError
from .extras import need
from .threads import processors

if TYPE_CHECKING:
    from distributed import Client

PATIENCE = 20.0  # s for a scheduler to answer
LOOK = 2.0  # s after which workers are counted again
LONELY = 30.0  # s without a worker after which it is said
_SETTINGS = {
    # else a worker that is between two lives so long after a death is given up for ever
    "distributed.deploy.lost-worker-timeout": "1000 days",
    # dask has memory given back at every chance; arrays taken anew in each evaluation made a fit a fifth slower so
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
}
_TALKERS = ("distributed.client", "distributed.core", "distributed.utils")


@contextmanager
def cluster(scheduler: str | None = None, workers: int | None = None) -> Iterator[Client]:
    """A client of the cluster.

    Args:
        scheduler: address of a running one, ``tcp://host:8786``; None starts one here with processes of one thread.
        workers: of the local cluster; default the number of processors that this process may use.

    Raises:
        ArgumentError: no scheduler answers there, or no number of workers.
        InputError: dask.distributed is missing.
    """
    need("work on many campaigns", "distributed", "dask", "distributed")
    import dask
    from distributed import Client, LocalCluster

    if scheduler is not None:
        if workers is not None:
            raise ArgumentError("an existing cluster has its own workers", key="workers", hint="leave it out")
        try:
            client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise ArgumentError(
                "no scheduler answers there", key="scheduler", value=scheduler, allowed="such as tcp://host:8786",
                hint="start one with 'dask scheduler', and workers with 'dask worker ADDRESS --nthreads 1'",
            ) from error  # fmt: skip
        with _quiet(), client:
            yield client
        return
    if workers is not None and workers < 1:
        raise ArgumentError("a cluster needs workers", key="workers", value=workers, allowed="1 or more")
    with (
        _quiet(),
        dask.config.set(_SETTINGS),
        LocalCluster(
            n_workers=workers or processors(),
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",  # no page, but a port of its own beside another run on this machine
            scheduler_kwargs={"dashboard": False},
            memory_limit=None,  # a case is all a worker holds; pausing it would not free anything
            silence_logs=logging.CRITICAL,
        ) as local,
        Client(local, set_as_default=False) as client,
    ):
        yield client


class Workers:
    """Who is there to work, counted every few seconds.

    Attributes:
        number: of workers. at_once: how many cases they can have under way together.
    """

    def __init__(self, client: Client, note: Callable[[str], None] | None = None) -> None:
        self._client, self._note = client, note
        self._address = getattr(client.scheduler, "address", "the scheduler")
        self._seen = self._asked = time.monotonic()
        self._told = False
        self.number = self.at_once = 0
        self._count()

    def look(self) -> None:
        """Count again where it is time, and say once where there has been no worker for long."""
        now = time.monotonic()
        if now - self._asked >= LOOK:
            self._asked = now
            self._count()
        if self.number:
            self._seen, self._told = now, False
        elif self._note is not None and not self._told and now - self._seen >= LONELY:
            self._told = True
            self._note(f"no worker is connected to {self._address}; waiting")

    def _count(self) -> None:
        if self._client.status != "running":
            return
        with suppress(Exception):  # whether the cluster is lost is found out by who waits for its answers
            threads = self._client.nthreads(callback_timeout=LOOK)
            self.number, self.at_once = len(threads), sum(threads.values())


@contextmanager
def _quiet() -> Iterator[None]:
    """What dask logs about lost connections is said in one message of our own."""
    before = {name: logging.getLogger(name).level for name in _TALKERS}
    for name in _TALKERS:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
