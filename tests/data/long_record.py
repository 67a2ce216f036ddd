"""A record of many samples, and scripts that read it in a process of their own."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.data.conftest import StickSlip

LSB = 7.91e-9


LONG = """
import resource, sys, time
from stickslip.data.campaign import load_campaign, load_traces
from stickslip.data.segment import reduce_trace, segment
start = time.process_time()
(trace,) = load_traces(load_campaign(sys.argv[1]))
found = segment(trace)
short = reduce_trace(trace, found)
print(trace.time.size, len(found.events), short.time.size, time.process_time() - start,
      resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
"""


INSPECT = """
import resource, subprocess, sys
done = subprocess.run([sys.executable, "-m", "stickslip.cli", "inspect", sys.argv[1]], stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(done.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024)
"""


def long_record(folder: Path, ending: str, n: int) -> Path:
    """A campaign of one record of so many samples at 50 kHz."""
    model = StickSlip(period=1.5, events=130)
    t = np.arange(n) / 50e3
    one = np.arange(0, 1.5, 2e-5)
    cycle = model.position(one)
    x = (
        np.floor(1e6 * (cycle[np.arange(n) % one.size] + model.v0 * 1.5 * (np.arange(n) // one.size)) / 7.91e-3)
        * 7.91e-3
    )
    if ending == "npy":
        np.save(folder / "a.npy", np.column_stack([t, x]))
    else:
        with (folder / "a.csv").open("w") as stream:
            stream.write("time [s],x [um]\n")
            for i in range(0, n, 200_000):
                np.savetxt(stream, np.column_stack([t[i : i + 200_000], x[i : i + 200_000]]), fmt="%.5f,%.5f")
    path = folder / "c.toml"
    path.write_text(
        f'schema = 1\n[[trace]]\nfile = "a.{ending}"\ntime = {{ column = 1, unit = "s" }}\n'
        'displacement = { column = 2, unit = "um" }\ndrive_velocity = "50 um/s"\n'
    )
    return path


def numbers(script: str, path: Path) -> list[float]:
    """What a script prints of a campaign, in a process of its own."""
    command = [sys.executable, "-c", script, str(path)]
    return [float(word) for word in subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()]
