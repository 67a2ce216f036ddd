"""Many runs of the rig at once: by vmap and by processes, against one run after the other."""

from __future__ import annotations

import functools
import os
import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from joblib import Parallel, delayed

from stickslip.simulation.solve import Tolerance
from tests.solve.rig import tighter

from .case import Case
from .measuring import head, keep, last_table, row, timed
from .own import displacement

CHUNK = 10  # runs of one vmap; a graphics processor wants thousands
SPREAD = 0.05  # of the logarithms of the eight parameters


def parameters(sets: int) -> np.ndarray:
    """(sets, 8) logarithms of factors."""
    return np.random.default_rng(0).uniform(-SPREAD, SPREAD, (sets, 8))


@functools.cache
def _run(many: bool, factor: float) -> Callable[[jax.Array], jax.Array]:
    tolerance: Tolerance = tighter(factor)
    one = functools.partial(displacement, case=Case(), tolerance=tolerance)
    return jax.jit(jax.vmap(one) if many else one)


def one_by_one(theta: np.ndarray, factor: float) -> np.ndarray:
    """(sets, 2001) displacements (m)."""
    run = _run(False, factor)
    return np.stack([np.asarray(run(jnp.asarray(t))) for t in theta])


def by_vmap(theta: np.ndarray, factor: float, chunk: int = CHUNK) -> np.ndarray:
    """The same, so many runs in step with each other; the last chunk is filled up."""
    run, out = _run(True, factor), []
    for start in range(0, len(theta), chunk):
        part = theta[start : start + chunk]
        out.append(np.asarray(run(jnp.asarray(np.resize(part, (chunk, 8)))))[: len(part)])
    return np.concatenate(out)


def _share(theta: np.ndarray, factor: float) -> tuple[np.ndarray, float, float]:
    """A worker's share: result, processor time (s) of the start (imports, compiling) and of the runs."""
    one_by_one(theta[:1], factor)
    ready = time.process_time()
    return one_by_one(theta, factor), ready, time.process_time() - ready


def by_processes(theta: np.ndarray, factor: float, workers: int) -> tuple[np.ndarray, float, float]:
    """The same by fresh processes; and their processor time (s) for starting and for the runs, summed."""
    parts = np.array_split(theta, workers)
    found = Parallel(n_jobs=workers)(delayed(_share)(part, factor) for part in parts)
    return np.concatenate([f[0] for f in found]), sum(f[1] for f in found), sum(f[2] for f in found)


def vmap_alone(factor: float, chunk: int) -> None:
    """One chunk, timed after it was compiled; for a graphics processor, in whose place the others have no business."""
    theta = parameters(chunk)
    by_vmap(theta, factor, chunk)
    _, _, wall = timed(lambda: by_vmap(theta, factor, chunk), 2)
    print(f"vmap, {chunk} runs on {jax.devices()[0].device_kind}: {1e3 * wall / chunk:.3g} ms of wall time a run")


def report(factor: float, sets: int = 1000, chunk: int = CHUNK, kept: bool = True) -> dict[str, float]:
    """The table; vmap on ten chunks (its cost is the same for every chunk). ``kept``: among the results."""
    theta, workers = parameters(sets), os.cpu_count() or 1
    one_by_one(theta[:1], factor)
    _, single, _ = timed(lambda: one_by_one(theta[:1], factor), 7)
    print(f"\nBatches: {sets} parameter sets, 256 elements, 5 s of drive, default tolerance/{factor:g}.")
    head("way", "sets", "processor ms a run", "in single runs", "wall s in all", "of it started")
    row("one run", 1, f"{1e3 * single:.1f}", "1", "", "")
    exact, cpu, wall = timed(lambda: one_by_one(theta, factor), 1)
    row("one after the other", sets, f"{1e3 * cpu / sets:.1f}", f"{cpu / sets / single:.2f}", f"{wall:.1f}", "")
    spent = {"single": single, "one after the other": cpu / sets}
    (found, start, runs), _, wall = timed(lambda: by_processes(theta, factor, workers), 1)
    gaps = {"processes": _gap(found, exact)}
    row(
        f"{workers} processes", sets, f"{1e3 * runs / sets:.1f}", f"{runs / sets / single:.2f}", f"{wall:.1f}",
        f"{start / workers:.1f} s of processor time each",
    )  # fmt: skip
    spent["processes"] = runs / sets
    vmapped = min(10 * chunk, sets)
    by_vmap(theta[:1], factor, chunk)
    found, cpu, wall = timed(lambda: by_vmap(theta[:vmapped], factor, chunk), 1)
    gaps["vmap"] = _gap(found, exact[:vmapped])
    row(
        f"vmap, chunks of {chunk}", vmapped, f"{1e3 * cpu / vmapped:.1f}", f"{cpu / vmapped / single:.2f}",
        f"{wall:.1f}", "",
    )  # fmt: skip
    print(
        "largest difference of a displacement (in slips) to one run after the other: "
        + ", ".join(f"{name} {gap:.1e} m" for name, gap in gaps.items())
    )
    if kept:
        keep("batches", "batches", **last_table(), sets=sets, springs=Case().springs, largest_difference_m=gaps)
    return spent | {"vmap": cpu / vmapped}


def _gap(found: np.ndarray, exact: np.ndarray) -> float:
    """Largest difference (m): the same runs, so nothing but rounding and the steps it changes."""
    return float(np.max(np.abs(found - exact)))
