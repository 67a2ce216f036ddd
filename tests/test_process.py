"""What a process of the program's own sets for itself."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from stickslip.system.threads import processors

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
