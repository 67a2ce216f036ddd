"""The model's reading beside the measured one: the tracks of every cycle at an optimum."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from numpy.typing import NDArray

from ..forward import cut_short
from .problem import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModelledRun:
    """Reading of the model in every used cycle of a run.

    Attributes:
        times, readings: one array for each cycle, s and m. Each cycle begins at the measured arrest before it.
        arrests: times at which the model's cycles end (s).
        cut: numbers (from 0) of the cycles that could not be integrated to their end.
    """

    times: tuple[Array, ...]
    readings: tuple[Array, ...]
    arrests: tuple[float, ...]
    cut: tuple[int, ...] = ()

    def reading(self, time: Array, starts: Array) -> Array:
        """Reading (m) at times (s), each taken from the cycle it lies in; NaN beyond the last cycle.

        Args:
            starts: of the measured cycles, s.
        """
        out = np.full(np.shape(time), np.nan)
        cycle = np.searchsorted(starts, time, side="right") - 1
        for n, (t, y) in enumerate(zip(self.times, self.readings, strict=True)):
            here = (cycle == n) & (time <= t[-1])
            out[here] = np.interp(np.asarray(time)[here], t, y)
        return out


def modelled_runs(problem: Problem, z: Array, events: Array) -> list[ModelledRun]:
    """The model through every run at parameters ``z`` (search scale) and event-wise factors ``events`` (R, n, 2)."""
    out = []
    for r in range(problem.measurement.runs):
        cycles = jax.tree.map(lambda a, r=r: a[r], problem.measurement.cycles)
        found = problem.track(np.asarray(z), np.asarray(events), r)
        used = np.flatnonzero(np.asarray(cycles.used))
        t, y, n = (np.asarray(a) for a in (found.t, found.reading, found.steps))
        ends = [max(int(n[i]), 2) for i in used]
        out.append(
            ModelledRun(
                tuple(t[i, :e] for i, e in zip(used, ends, strict=True)),
                tuple(y[i, :e] for i, e in zip(used, ends, strict=True)),
                tuple(float(found.arrest[i]) for i in used),
                tuple(np.flatnonzero(cut_short(found, cycles)).tolist()),
            )
        )
    return out
