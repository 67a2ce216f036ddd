"""The error on cycles no fit has seen, event-to-event variation taken out as far as its prior allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..features.layout import PHASES
from ..fit.common import Common
from ..fit.composition import START
from ..fit.inertial import HUBER, Fit
from ..fit.problem import Problem
from ..floors import event_widths

ITERATIONS = 3


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
    run begins with is set by its recurrence, where no cycle of that run was fitted. What the unseen events have in
    common is taken from them alone and counts: it is as much a misfit there as where the fit has looked.
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
    """The features with the starts of runs that no fit has seen set by their recurrence, shape (R, n, F)."""
    m = problem.measurement
    at = m.layout.slices()["recurrence"].start
    for i, f in enumerate(fit.free):
        if not f.name.startswith(START):
            continue
        r = int(f.name[len(START) :])
        if (fit.use[r][:, None] & m.valid[r]).any():
            continue
        ok = m.valid[r, :, at] & cycles[r] & np.asarray(m.cycles.used)[r] & (np.abs(fit.columns[r, :, at, i]) > 0)
        if not ok.any():
            continue
        z = fit.z.copy()
        for _ in range(ITERATIONS):
            late = (m.values[r, ok, at] - model[r, ok, at]) / fit.columns[r, ok, at, i]
            z[i] = np.clip(z[i] + np.median(late), *f.bounds)
            model = problem.again(z, fit.events, r, model)
            model[r] += fit.offsets[r]
    return model
