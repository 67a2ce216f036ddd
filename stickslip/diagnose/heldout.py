"""The error on cycles no fit has seen, event-to-event variation taken out as far as its prior allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..features.layout import PHASES
from ..fit.common import Common
from ..fit.composition import START, run_of
from ..fit.inertial import HUBER, Fit
from ..fit.problem import Problem
from ..floors import event_widths
from .begin import beginning

ITERATIONS = 3
PHASES_TRIED, REFINED = 12, 4  # of a run that no fit has seen; halvings of the distance between two of them


@dataclass(frozen=True)
class HeldOut:
    """Residuals over floors of unseen cycles.

    Attributes:
        error: root mean square over phases, robust (Huber).
        score: its square, what gains are counted in.
        by_phase: phase -> error.
        per_cycle: score of every unseen cycle, in the order of the runs.
    """

    error: float
    score: float
    by_phase: dict[str, float]
    per_cycle: np.ndarray


def held_out(
    problem: Problem, fit: Fit, floor: np.ndarray, cycles: np.ndarray, features: np.ndarray | None = None
) -> HeldOut:
    """Evaluate a fit on ``cycles`` (R, n) with its event-wise factors there at their prior mean.

    In each cycle the two factors are then set to their most probable values, to first order. The elongation that a
    run begins with, and the phase that it begins at, are set by its recurrence, where no cycle of that run was fitted.
    What the unseen events have in common is taken from them alone and counts: it is as much a misfit there as where
    the fit has looked.
    """
    m = problem.measurement
    cycles = cycles & np.asarray(m.cycles.used)
    phase = m.layout.phase_index()
    model = problem.features(fit.z, fit.events) + fit.offsets if features is None else features
    event = problem.event_columns(fit.columns, fit.z, fit.events)
    widths = event_widths(m)
    left = np.zeros_like(m.values)
    model = _starts(problem, fit, cycles, model)
    for r, n in np.argwhere(cycles):
        ok = m.valid[r, n]
        res = np.nan_to_num((model[r, n] - m.values[r, n]) / floor[r, n], nan=1e4, posinf=1e4, neginf=-1e4)
        jac = np.nan_to_num(event[r, n] / floor[r, n][:, None])
        weight = np.where(np.abs(res) > HUBER, HUBER / np.maximum(np.abs(res), HUBER), 1.0) * ok
        normal = jac.T @ (weight[:, None] * jac) + np.diag(1.0 / widths[r, n] ** 2)
        shift = -np.linalg.solve(normal, jac.T @ (weight * res))
        left[r, n] = (res + jac @ shift) * floor[r, n] - fit.offsets[r, n]
    common = Common(m, floor, cycles)
    found = np.abs(common(left[common.valid]))
    loss = np.where(found <= HUBER, found**2, 2 * HUBER * found - HUBER**2)
    count = int(common.valid.sum())
    each = np.zeros(m.values.shape)
    each[common.valid] = loss[:count]
    alike = loss[count:].reshape(phase.size, -1).sum(axis=1)
    counts = np.array([common.valid[..., phase == i].sum() for i in range(len(PHASES))])
    share = np.array([alike[phase == i].sum() for i in range(len(PHASES))]) / np.maximum(counts, 1)
    by_phase = {
        p: float(np.sqrt(each[..., phase == i].sum() / counts[i] + share[i])) for i, p in enumerate(PHASES) if counts[i]
    }
    score = float(np.mean(np.square(list(by_phase.values())))) if by_phase else float("nan")
    scores = []
    for r, n in np.argwhere(cycles):
        own = {i: common.valid[r, n, phase == i] for i in range(len(PHASES))}
        rows = [each[r, n, phase == i][ok].mean() + share[i] for i, ok in own.items() if ok.any()]
        scores.append(float(np.mean(rows)) if rows else np.nan)
    return HeldOut(float(np.sqrt(score)), score, by_phase, np.array(scores))


def _starts(problem: Problem, fit: Fit, cycles: np.ndarray, model: np.ndarray) -> np.ndarray:
    """The features with what begins anew in runs that no fit has seen set by their recurrence, shape (R, n, F)."""
    m = problem.measurement
    at = m.layout.slices()["recurrence"].start
    own = [(i, r) for i, f in enumerate(fit.free) if (r := run_of(f.name)) is not None]
    z = fit.z.copy()
    for i, r in sorted(own, key=lambda pair: fit.free[pair[0]].name.startswith(START)):  # phases first
        seen = m.valid[r, :, at] & cycles[r] & np.asarray(m.cycles.used)[r]
        if (fit.use[r][:, None] & m.valid[r]).any() or not seen.any():
            continue
        if fit.free[i].name.startswith(START):
            for _ in range(ITERATIONS if np.any(fit.columns[r, seen, at, i]) else 0):
                z[i] = beginning(m, fit.free[i], z[i], model, fit.columns[..., i], m.values, seen)
                model = _again(problem, fit, z, r, model)
        else:
            z[i], model = _phase(problem, fit, z, i, r, seen, model)
    return model


def _again(problem: Problem, fit: Fit, z: np.ndarray, run: int, model: np.ndarray) -> np.ndarray:
    out = problem.again(z, fit.events, run, model)
    out[run] += fit.offsets[run]
    return out


def _phase(
    problem: Problem, fit: Fit, z: np.ndarray, i: int, run: int, seen: np.ndarray, model: np.ndarray
) -> tuple[float, np.ndarray]:
    """The phase ``z[i]`` of a run that describes its recurrences best, and the features with it: those after the first,
    which depends on what the run begins with."""
    m, f = problem.measurement, fit.free[i]
    at = m.layout.slices()["recurrence"].start
    later = np.flatnonzero(seen)[1:] if seen.sum() > 1 else np.flatnonzero(seen)

    def tried(phase: float) -> tuple[float, float, np.ndarray]:
        new = _again(problem, fit, np.where(np.arange(len(z)) == i, f.inward(phase), z), run, model)
        return float(np.nansum(np.abs(new[run, later, at] - m.values[run, later, at]))), phase, new

    offers = [tried(phase) for phase in 2 * np.pi * np.arange(PHASES_TRIED) / PHASES_TRIED - np.pi]
    for step in np.pi / PHASES_TRIED * 0.5 ** np.arange(REFINED):
        best = min(offers, key=lambda offer: offer[0])
        offers = [best, *(tried(best[1] + side * step) for side in (-1.0, 1.0))]
    _, phase, new = min(offers, key=lambda offer: offer[0])
    return f.inward(phase), new
