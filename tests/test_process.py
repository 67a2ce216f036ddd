"""What a process of the program's own sets for itself."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time

import pytest

import stickslip as ss
from stickslip.errors import InputError
from stickslip.system import threads
from stickslip.system.threads import processors, side_by_side

FAULTS = """
import resource, sys
import numpy as np
from stickslip.system import process
if sys.argv[1] == "begun":
    process.begin()
np.ones(10**6)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(50):
    np.ones(10**6)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts page faults, and sets the GNU library")
def test_freed_memory_is_kept_and_not_cleared_anew():
    def faults(how: str) -> int:
        made = subprocess.run([sys.executable, "-c", FAULTS, how], capture_output=True, text=True, check=True)
        return int(made.stdout)

    assert faults("begun") < 0.1 * faults("plain")


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system gives every process all processors")
def test_only_processors_that_were_given_to_the_process_count(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 64)  # those of a cluster's node, of which a job has a few
    given = os.sched_getaffinity(0)
    assert processors() == len(given)
    os.sched_setaffinity(0, {min(given)})
    try:
        assert processors() == 1
    finally:
        os.sched_setaffinity(0, given)


def test_a_limit_of_processors_holds_for_what_is_within(monkeypatch):
    monkeypatch.setattr(threads, "_ALONE", True)
    if hasattr(os, "sched_getaffinity"):
        monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(8)))
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    at_once, most, lock = 0, 0, threading.Lock()

    def work(item):
        nonlocal at_once, most
        with lock:
            at_once += 1
            most = max(most, at_once)
        time.sleep(0.02)
        with lock:
            at_once -= 1
        return item**2

    found = {}
    for limit in (1, 2, 5, 20):
        most = 0
        with pytest.raises(KeyError), ss.processor_limit(5), ss.processor_limit(limit):
            assert side_by_side(work, range(10), range(10)) == [n**2 for n in range(10)]
            found[limit] = processors(), most
            raise KeyError
        assert processors() == 8
    assert found == {1: (1, 1), 2: (2, 2), 5: (5, 5), 20: (8, 8)}
    with pytest.raises(InputError, match=r"(?s)number.*allowed: 1, 2, 3"), ss.processor_limit(0):
        pass


@pytest.mark.parametrize("first", ["", "import jax"])
@pytest.mark.parametrize("asked", [None, "cuda"])
def test_no_graphics_processor_is_taken_unless_asked_for(first, asked):
    """Also where JAX was imported before: as in a worker, whose modules need it."""
    code = (
        f"{first}\nfrom stickslip.system import process\nprocess.begin()\nimport jax\nprint(jax.config.jax_platforms)"
    )
    environment = {k: v for k, v in os.environ.items() if k != "JAX_PLATFORMS"} | (
        {"JAX_PLATFORMS": asked} if asked else {}
    )
    made = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert made.stdout.strip() == (asked or "cpu")
