"""The error on cycles no fit has seen, event-to-event variation taken out as far as its prior allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..features.layout import PHASES
from ..fit.composition import EVENT_WIDTHS, START
from ..fit.inertial import HUBER, Fit
from ..fit.problem import Problem

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
    run begins with is set by its recurrence, where no cycle of that run was fitted.
    """
    m = problem.measurement
    model = problem.features(fit.z, fit.events) if features is None else features
    event = problem.event_columns(fit.columns, fit.z, fit.events)
    widths = np.array(EVENT_WIDTHS)
    phase = m.layout.phase_index()
    cells, scores = [], []
    model = _starts(problem, fit, cycles, model)
    for r, n in np.argwhere(cycles & np.asarray(m.cycles.used)):
        ok = m.valid[r, n]
        res = np.nan_to_num((model[r, n] - m.values[r, n]) / floor[r, n], nan=1e4, posinf=1e4, neginf=-1e4)
        jac = np.nan_to_num(event[r, n] / floor[r, n][:, None])
        weight = np.where(np.abs(res) > HUBER, HUBER / np.maximum(np.abs(res), HUBER), 1.0) * ok
        normal = jac.T @ (weight[:, None] * jac) + np.diag(1.0 / widths**2)
        shift = -np.linalg.solve(normal, jac.T @ (weight * res))
        left = res + jac @ shift
        loss = np.where(np.abs(left) <= HUBER, left**2, 2 * HUBER * np.abs(left) - HUBER**2)
        row = [np.mean(loss[ok & (phase == i)]) if (ok & (phase == i)).any() else np.nan for i in range(len(PHASES))]
        cells.append(row)
        scores.append(np.nanmean(row))
    table = np.array(cells).reshape(-1, len(PHASES))
    seen = ~np.isnan(table).all(axis=0) if table.size else np.zeros(len(PHASES), bool)
    by_phase = {p: float(np.sqrt(np.nanmean(table[:, i]))) for i, p in enumerate(PHASES) if seen[i]}
    score = float(np.mean(np.square(list(by_phase.values())))) if by_phase else float("nan")
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
    return model
