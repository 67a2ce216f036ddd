"""Features of all runs for a vector of parameters, and their Jacobian.

The Jacobian is taken by differences over steps that move the features moderately. A forward-mode derivative of an
adaptive integration is exact for the discrete solution, which has a fine saw-tooth where kinks of the contact cross the
borders of steps: its slope is not the slope of the curve it follows. (Measured, docs/verification: it is right within
one slip, and that of the second event's time is wrong in sign at every tolerance.)
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, export

from ..features.evaluate import of_tracks
from ..features.measurement import Measurement
from ..forward import Cycles, Track, run_cycles
from ..solve.stepper import Tolerance
from .common import Common
from .composition import Composition, Family, Numbers, of_this_package, run_of
from .program import Program

FINE = Tolerance(3e-4, 6e-12, 6e-9, 6e-3, 1e-7)  # errors below a floor
COARSE = Tolerance(2e-3, 2e-11, 2e-8, 1.2e-2, 3e-7)  # of one to two: for floors that are widened more than that
STRICT = Tolerance(5e-5, 1e-13, 1e-10)  # errors that no difference sees: for derivatives that say how certain a fit is
STRICT_STEPS = 5  # times as many as usual
STEP = 0.01  # of a difference, on the search scale, until it is known better
TINY = 0.1  # share of a step that is taken beyond a border where there is no room to either side
BROKEN = 0.3  # change of a slip's size within such a step that can only be another event
THREADS = max(1, min(4, os.cpu_count() or 1))
export.register_namedtuple_serialization(Track, serialized_name="stickslip.forward.Track")  # what is kept returns one


class Problem:
    """One composition against one measurement.

    Args:
        composition: the family of models.
        measurement: the data.
        tolerance: of the solver.
        threads: runs integrated at the same time.

    Attributes:
        seen: cycles whose features are those of the model, shape (R, n); see :meth:`seeing`.
    """

    def __init__(
        self,
        composition: Composition,
        measurement: Measurement,
        tolerance: Tolerance | None = None,
        threads: int = THREADS,
    ) -> None:
        self.composition, self.measurement, self.threads = composition, measurement, threads
        self.tolerance = FINE if tolerance is None else tolerance
        self.runs_done = 0
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        both = (measurement.cycles, measurement.anchors)
        self._data = [jax.tree.map(lambda a, r=r: a[r], both) for r in range(measurement.runs)]
        self.seen = np.ones(np.shape(measurement.cycles.used), bool)

    def coarser(self) -> Problem:
        """The same at a tolerance that suffices where floors are widened."""
        if self.tolerance is COARSE:
            return self
        other = copy(self)
        other.tolerance, other._last = COARSE, None
        return other

    def strict(self) -> Problem:
        """The same at a tolerance whose noise differences do not see."""
        if self.tolerance.relative <= STRICT.relative:
            return self
        other = copy(self)
        other.tolerance, other._last = STRICT, None
        other.composition = replace(self.composition, most_steps=STRICT_STEPS * self.composition.most_steps)
        return other

    def seeing(self, cycles: np.ndarray) -> Problem:
        """The same for some cycles, shape (R, n): a run is integrated as far as the last of them, and one without any
        not at all. Features of the others are those of the data, or of the ``base`` that is given.
        """
        if not np.any(self.seen & ~cycles):
            return self
        other = copy(self)
        other.seen, other._last = cycles & self.seen, None
        needed = np.logical_or.accumulate(other.seen[:, ::-1], axis=1)[:, ::-1]
        other._data = [
            (c._replace(used=c.used & until), anchors) for (c, anchors), until in zip(self._data, needed, strict=True)
        ]
        return other

    def common(self, floor: np.ndarray, use: np.ndarray, factor: float = 1.0) -> Common:
        """What events may have in common besides the model: as rough lines do that a bank stands for."""
        return Common(self.measurement, floor, use, factor)

    def features(self, z: np.ndarray, events: np.ndarray) -> np.ndarray:
        """Features of the model, shape (R, n, F); those asked for last are remembered."""
        last = self._last
        if last is None or not (np.array_equal(last[0], z) and np.array_equal(last[1], events)):
            found = self._call([(np.asarray(z, float), events)])[0]
            self._last = last = np.array(z, float), np.array(events), found
        return last[2].copy()

    def again(self, z: np.ndarray, events: np.ndarray, run: int, base: np.ndarray) -> np.ndarray:
        """The features ``base`` with those of one run taken anew, shape (R, n, F)."""
        return self._call([(np.asarray(z, float), events)], [run], base)[0]

    def columns(
        self,
        z: np.ndarray,
        events: np.ndarray,
        which: Sequence[int],
        base: np.ndarray,
        steps: np.ndarray | None = None,
    ) -> np.ndarray:
        """Derivatives of the features in some of the free parameters, shape (R, n, F, len(which)).

        ``base`` are the features at ``z``, ``steps`` the differences on the search scale, shape (len(which),). A step
        that would leave the bounds is taken the other way. Where a slip becomes another one within a step (it falls on
        the other side of a hold), nothing is known of the slope and it is set to zero.
        """
        which = list(which)
        sizes = np.full(len(which), STEP) if steps is None else np.asarray(steps, float)
        soft = self.coupled()
        extra = soft is not None and soft[0] in which and soft[1] not in which
        if soft is not None and extra:
            which, sizes = [*which, soft[1]], np.append(sizes, sizes[which.index(soft[0])])
        directions = np.eye(len(z))[:, which]
        if soft is not None and soft[0] in which:
            directions[soft[1], which.index(soft[0])] = 1.0
        out = self.slopes(z, events, directions, base, sizes)
        if soft is not None and soft[0] in which:
            out[..., which.index(soft[0])] -= out[..., which.index(soft[1])]
        return out[..., :-1] if extra else out

    def slopes(
        self, z: np.ndarray, events: np.ndarray, directions: np.ndarray, base: np.ndarray, steps: np.ndarray
    ) -> np.ndarray:
        """Derivatives of the features along ``directions`` (k, d), shape (R, n, F, d); else as :meth:`columns`."""
        low, high = np.array([f.bounds for f in self.composition.free]).T
        lanes, taken, only = [], [], []
        for direction, size in zip(directions.T, steps, strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                border = np.where(direction > 0, [high - z, z - low], [z - low, high - z]) / np.abs(direction)
            room = np.where(direction == 0, np.inf, border).min(axis=1)
            ahead = room[0] >= min(size, room[1])
            step = (1.0 if ahead else -1.0) * max(min(float(size), float(max(room))), TINY * float(size))
            moved = np.where(direction != 0.0, np.clip(z + step * direction, low, high), z)
            lanes.append((moved, events))
            taken.append(step)
            touched = np.flatnonzero(direction)
            only.append(self._alone(int(touched[0])) if touched.size == 1 else None)
        found = self._call(lanes, only, base)
        out = np.stack([(o - base) / h for o, h in zip(found, taken, strict=True)], axis=-1)
        at = self.measurement.layout.slices()["size"]
        jump = np.abs(out[:, :, at] * np.array(taken)) > BROKEN * np.abs(base[:, :, at, None])
        return np.where(jump, 0.0, out)

    def track(self, z: np.ndarray, events: np.ndarray, run: int) -> Track:
        """The model through one run at ``z`` with the event-wise factors ``events`` (R, n, 2)."""
        return self._track(z, events, run)

    def _track(self, z: np.ndarray, events: np.ndarray, run: int) -> Track:
        cycles = self._data[run][0]
        number = int(cycles.run)
        numbers = self.composition.numbers(z, number)
        later = np.float64(self.composition.later(z, number))
        program = _tracks(self.composition.family())
        found: Track = program(numbers, jnp.asarray(events[run]), cycles, later, self.tolerance)
        return found

    def coupled(self) -> tuple[int, int] | None:
        """Positions of the spring's stiffness and the contact's strength where both are free.

        The recurrence fixes their ratio to a thousandth, so neither can move alone; what both do together is lost in
        the difference of two derivatives taken apart.
        """
        names = [f.name for f in self.composition.free]
        pair = ("rig.spring_stiffness", "contact.strength")
        return (names.index(pair[0]), names.index(pair[1])) if set(pair) <= set(names) else None

    def event_columns(self, columns: np.ndarray, z: np.ndarray, events: np.ndarray) -> np.ndarray:
        """Derivatives in the two event-wise factors, each in its own cycle, shape (R, n, F, 2).

        They are those of u_max and p themselves: a factor of one cycle changes that cycle as the common one does.
        """
        names = [f.name for f in self.composition.free]
        u, p = names.index("contact.u_max"), names.index("contact.p")
        exponent = float(np.exp(z[p]))
        share = (exponent - 1.0) / exponent
        return np.stack([columns[..., u], columns[..., p] * share], axis=-1)

    def _alone(self, i: int) -> int | None:
        """The run that a parameter acts on, or None if it acts on all."""
        return run_of(self.composition.free[i].name)

    def _call(
        self,
        lanes: list[tuple[np.ndarray, np.ndarray]],
        only: Sequence[int | None] = (),
        base: np.ndarray | None = None,
    ) -> list[np.ndarray]:
        """Features of every lane; a lane that concerns one run only has those of ``base`` in the others."""
        m = self.measurement
        only = only or [None] * len(lanes)
        times = jnp.asarray([m.layout.settling, m.layout.shortest])

        def one(task: tuple[int, int]) -> np.ndarray:
            lane, r = task
            z, events = lanes[lane]
            return np.asarray(of_tracks(self._track(z, events, r), self._data[r][1], times))

        # the longest runs first, so that no thread is left with one at the end
        order = np.argsort([-np.count_nonzero(cycles.used) for cycles, _ in self._data])
        order = order[self.seen[order].any(axis=1)]
        tasks = [(lane, int(r)) for r in order for lane in range(len(lanes)) if only[lane] in (None, r)]
        self.runs_done += len(tasks)
        if self.threads == 1:
            done = {task: one(task) for task in tasks}
        else:
            with ThreadPoolExecutor(self.threads) as pool:
                done = dict(zip(tasks, pool.map(one, tasks), strict=True))
        out = [np.array(m.values if base is None else base) for _ in lanes]
        for (lane, r), found in done.items():
            out[lane][r, self.seen[r]] = found[self.seen[r]]
        return out


@lru_cache(maxsize=128)
def _tracks(family: Family) -> Any:
    """The compiled integration of one run. What the features ask of it is compiled apart, once for all models.

    Of effects from elsewhere no trace is kept: what their law depends on is not known.
    """

    def one_run(numbers: Numbers, events: Array, cycles: Cycles, later: Any, tolerance: Tolerance) -> Track:
        start = (later, cycles.virgin, cycles.stretch)
        return run_cycles(
            lambda event, nodes: family.model(numbers, event, nodes, cycles.stiffness, start),
            events,
            cycles,
            tolerance,
            family.most_steps,
        )

    return Program(one_run, repr(family) if of_this_package(family.structure) else None)
