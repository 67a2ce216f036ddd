"""What is compared of a free simulation, event by event, and how far events scatter in it by themselves.

The measures are features of a cycle (:mod:`stickslip.inference.features`), of both data and model.

*How far they scatter by themselves.* In squares, of the sizes that the fit of the force found:

* strength, yield displacements and the sensor's error at the arrest differ from event to event. What that does to a
  measure is asked of the model: every second event is changed, then the others, which tells the influence of the own
  event from that of the one before (about F_s/(c_s v) in recurrence for a strength that is doubled). The level of a run
  (:data:`~stickslip.inference.force.problem.LEVEL`) is that of all its events together;
* a misfit of the force in the nucleation, a share e of the strength F_s, lets the slip begin at another force: it comes
  e F_s/(c_s v) later and is (1 + q) e F_s/c_s longer, where q is the share of its swing that the damping leaves of the
  second half (1 without damping). A misfit in the slip is a kinetic friction that differs: (1 + q) e F_s/c_s as well.
  A virgin contact creeps towards its slip as fast as others nucleate, and there the misfit of the creep counts too.
  What the parameters are not known for is such a misfit as well;
* the sensor, as for a fit of events.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from numpy.typing import NDArray

from ...simulation.shooting import Track, cut_short
from ..features.evaluate import of_tracks
from ..features.measurement import Measurement
from ..force.fit import Fit
from ..force.free_run import run_freely
from ..force.knots import NUCLEATION
from ..force.point import Point
from ..force.problem import LEVEL, Problem
from ..force.scatter import EVENTS

Array = NDArray[np.float64]
NAMES = ("recurrence", "cycle", "slip", "creep")
STEPS = (0.01, 0.05, 0.05, 2e-3)  # by which events are changed: ln strength, ln stretch, shape, offset over the slip
CHANGES = (*EVENTS[:-1], "ratio", EVENTS[-1])  # of single events; the ratio is that of kinetic to static friction


@dataclass(frozen=True)
class Measures:
    """Of every cycle of R runs; nan where there is nothing to compare.

    Attributes:
        recurrence: from the arrest before to the onset, where a twentieth of the slip is done (s), shape (R, n).
        cycle: from the arrest before to the arrest (s), shape (R, n).
        slip: from shortly before the onset to the arrest (m), shape (R, n).
        creep: moved since the arrest before, at log-spaced times before the onset (m), shape (R, n, c).
    """

    recurrence: Array
    cycle: Array
    slip: Array
    creep: Array

    def __getitem__(self, name: str) -> Array:
        found: Array = getattr(self, name)
        return found


def measures(m: Measurement, features: Array, arrests: Array) -> Measures:
    """From features (R, n, F) and arrests (R, n), those of the data or of a model."""
    s = m.layout.slices()
    valid = np.where(m.valid & np.asarray(m.cycles.used)[..., None], 1.0, np.nan)
    at, size, first = (s[name].start for name in ("recurrence", "size", "times"))
    creep = features[..., s["creep"]] * valid[..., s["creep"]]
    crept = np.nan_to_num(np.where(np.isnan(valid[..., s["creep"].start]), 0.0, features[..., s["creep"].start]))
    return Measures(
        (features[..., at] + features[..., first]) * valid[..., at] * valid[..., first],
        (arrests - np.asarray(m.cycles.start)) * valid[..., at],
        (features[..., size] - crept) * valid[..., size],
        creep,
    )


def measured(m: Measurement, last: Array) -> Measures:
    """Of the data; ``last`` is when each run's last used slip ends (s), shape (R,)."""
    start, used = np.asarray(m.cycles.start), np.asarray(m.cycles.used)
    arrests = np.concatenate([start[:, 1:], start[:, -1:]], axis=1)
    final = used.sum(axis=1) - 1
    arrests[np.arange(m.runs), final] = last
    return measures(m, m.values, arrests)


def simulated(
    m: Measurement,
    problem: Problem,
    point: Point,
    r: int,
    run: int,
    events: Array | None = None,
    offset: Array | None = None,
) -> tuple[Track, Array, NDArray[np.bool_]]:
    """One run simulated: its tracks, its features (n, F), and which cycles broke off or follow one that did (n,).

    Args:
        m: the measurement. problem, point: the model.
        r: number of the run in the measurement. run: the same in the problem.
        events, offset: changes of single events as of :func:`run_freely`, shape (n, 4), and of the positions at the
            arrests (m), shape (n,).
    """
    cycles, anchors = (jax.tree.map(lambda a: np.asarray(a)[r], part) for part in (m.cycles, m.anchors))
    if offset is not None:
        cycles = cycles._replace(position=cycles.position + offset)
    found = jax.tree.map(np.asarray, run_freely(problem, point, run, cycles, events))
    features = np.asarray(of_tracks(found, anchors, np.array([m.layout.settling, m.layout.shortest])))
    broken = cut_short(found, cycles) | (cycles.used & ~np.isfinite(features).all(axis=1))
    return found, features, np.logical_or.accumulate(broken)


def scatter(m: Measurement, fit: Fit, runs: list[int]) -> Measures:
    """Standard deviation of every measure that the campaign's own scatter and its sensor give it.

    Args:
        m: the measurement.
        fit: whose sizes of what is random are taken, and whose model says what they do.
        runs: number in the problem of each run of the measurement.
    """
    size = fit.scatter.named()
    n = np.shape(m.cycles.start)[1]
    even = (np.arange(n) % 2 == 0).astype(float)
    usual = float(np.median(m.values[..., m.layout.slices()["size"].start][np.asarray(m.cycles.used)]))
    steps = (*STEPS[:-1], STEPS[-1] * usual)
    plain = _all(m, fit, runs, np.zeros((n, len(CHANGES))))
    total = {k: a + b for (k, a), b in zip(_sensor(m).items(), _misfit(m, fit, runs), strict=True)}
    alone = dict(zip(CHANGES, np.eye(len(CHANGES)), strict=True))
    changes = [(alone[name], step, size[name]) for step, name in zip(steps, EVENTS, strict=True)]
    if fit.scatter.follows is not None:
        caps, ratio = alone["strength"] + alone["stretch"], alone["ratio"]  # stiffnesses stay
        level = {"both": caps, "static": caps - ratio, "sliding": ratio}[fit.scatter.follows.of]
        changes.append((level, steps[0], size["level"]))
    for j, (row, step, deviation) in enumerate(changes):
        every: Any = dict.fromkeys(NAMES, 0.0)
        for own in (even, 1.0 - even):
            moved = _all(m, fit, runs, step * own[:, None] * row)
            # the own event's influence where it was changed, that of the one before elsewhere
            influence = {k: np.nan_to_num(moved[k] - plain[k]) / step for k in NAMES}
            total = {k: total[k] + (influence[k] * deviation) ** 2 for k in NAMES}
            every = {k: every[k] + influence[k] for k in NAMES}
        if j == EVENTS.index("strength"):
            total = {k: total[k] + (every[k] * LEVEL) ** 2 for k in NAMES}
    return Measures(**{k: np.sqrt(total[k]) for k in NAMES})


def _all(m: Measurement, fit: Fit, runs: list[int], change: Array) -> Measures:
    features, arrests = np.zeros_like(m.values), np.zeros(np.shape(m.cycles.start))
    for r, run in enumerate(runs):
        track, features[r], broken = simulated(m, fit.problem, fit.point, r, run, change[:, :-1], change[:, -1])
        arrests[r] = track.arrest
        features[r, broken | ~track.arrested] = np.nan
    return measures(m, features, arrests)


def _misfit(m: Measurement, fit: Fit, runs: list[int]) -> tuple[Any, ...]:
    """Squares of what misfits of the force make of each measure, in the order of :data:`NAMES`."""
    values, size = fit.values, fit.scatter.named()
    own = np.array([fit.problem.runs[run].stiffness or values.get("rig.spring_stiffness", np.nan) for run in runs])
    spring = own[:, None]
    damping = values["rig.damping"] / (2.0 * np.sqrt(spring * values["rig.mass"]))
    left = np.where(damping < 1.0, np.exp(-np.pi * damping / np.sqrt(np.maximum(1.0 - damping**2, 1e-12))), 0.0)
    strength, shape = fit.known.strength, np.shape(m.cycles.start)
    onset = np.full(shape, size["nucleation"] * strength)
    onset[np.asarray(m.cycles.virgin), 0] = np.hypot(size["nucleation"], size["creep"]) * strength
    own_events = fit.problem.first[np.asarray(runs)][:, None] + np.arange(shape[1])
    onset = np.hypot(onset, _unsure(fit)[np.minimum(own_events, fit.problem.events - 1)])
    late = (onset / spring / _speed(m)) ** 2
    longer = ((1.0 + left) * np.hypot(onset, size["slip"] * strength) / spring) ** 2
    return late, late, longer, 0.0


def _unsure(fit: Fit) -> Array:
    """How far the force in every event's nucleation is off for what the parameters are not known (N), shape (E,)."""
    at = np.flatnonzero(fit.problem.phase == NUCLEATION)
    rows = fit.slopes.shared[at]
    variance = np.einsum("pi,ij,pj->p", rows, fit.covariance, rows)
    event, count = fit.problem.of[at], fit.problem.events
    return np.sqrt(np.bincount(event, variance, count) / np.maximum(np.bincount(event, minlength=count), 1))


def _speed(m: Measurement) -> Array:
    """Of the load point at the onsets (m/s), shape (R, n); the usual one where it is held."""
    at = np.asarray(m.cycles.start) + m.values[..., m.layout.slices()["recurrence"].start]
    out = np.empty_like(at)
    for r in range(m.runs):
        t, x = (np.asarray(a)[r] for a in (m.cycles.load_times, m.cycles.load_positions))
        piece = np.clip(np.searchsorted(t, at[r], side="right") - 1, 0, t.size - 2)
        out[r] = np.abs(np.diff(x) / np.diff(t))[piece]
    return np.where(out > 0.0, out, np.abs(m.velocities)[:, None])


def _sensor(m: Measurement) -> dict[str, Array]:
    """Squares of what the sensor makes of each measure."""
    s = m.layout.slices()
    clock = m.sensor[..., s["recurrence"].start] ** 2
    return {
        "recurrence": clock + m.sensor[..., s["times"].start] ** 2,
        "cycle": clock,
        "slip": m.sensor[..., s["size"].start] ** 2,
        "creep": m.sensor[..., s["creep"]] ** 2,
    }
