"""One candidate: scored at the fitted base, then refitted with everything else free, in stages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..effects import catalogue
from ..effects.base import Effect
from ..errors import StickslipError
from ..features.measurement import Measurement
from ..fit.composition import EVENT_WIDTHS, Composition
from ..fit.inertial import Fit, fit, robust
from ..fit.parameters import Free, effect_parameters
from ..fit.problem import Problem
from ..params import specs
from ..residual import Misfit, misfit
from .heldout import HeldOut, held_out

START = 0.05  # of the amplitude's range; the linear step finds size and sign
MOST_STARTS = 9
WIDE = ((7.0, 4), (2.5, 5))  # factors on the floors and evaluations, for all candidates
REFIT = ((1.0, 8),)  # for those that explain something
HOPELESS = 0.93  # share of the base's cost that must be undercut at wide floors to be followed further


@dataclass(frozen=True)
class Candidate:
    """What became of one effect.

    Attributes:
        tag: of the effect.
        form: of its law.
        effect: the instance whose free fields the composition overwrites.
        score: share of the base's misfit that a change of amplitude explains to first order (R squared).
        fit: the refit, or None where the effect was dropped before.
        train: errors on the cycles fitted.
        held: errors on the others.
        note: why it was dropped, if it was.
    """

    tag: str
    form: dict[str, str]
    effect: Effect
    score: float
    composition: Composition | None = None
    fit: Fit | None = None
    train: Misfit | None = None
    held: HeldOut | None = None
    note: str = ""

    @property
    def amplitude(self) -> Free | None:
        """The free parameter that is the amplitude."""
        if self.fit is None:
            return None
        return next((f for f in self.fit.free if f.amplitude and f.name.startswith(f"{self.tag}.")), None)


def starts(effect: Effect) -> list[dict[str, float]]:
    """Values of the effect's parameters to begin a search from: a small amplitude, a grid of the inner ones."""
    table = specs(effect)
    spec = table[effect.amplitude]
    null = spec.null or 0.0
    reach = spec.upper - null if spec.upper > null else spec.lower - null
    inner = {k: s.grid for k, s in table.items() if k != effect.amplitude and s.grid}
    grid = [dict(zip(inner, values, strict=True)) for values in product(*inner.values())]
    grid = grid[:: int(np.ceil(len(grid) / MOST_STARTS))]
    return [{effect.amplitude: null + START * reach, **g} for g in grid]


def try_effect(
    effect: Effect,
    base: Composition,
    optimum: Fit,
    measurement: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    *,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Candidate:
    """Score and refit one effect on top of the base.

    Args:
        effect: with its form chosen.
        base, optimum: the base composition and its fit.
        measurement, floor: the data.
        train: cycles that may be fitted, shape (R, n).
        threads: runs integrated at the same time.
        progress: told what goes on.
    """
    form = {k: str(v) for k, v in vars(effect).items() if isinstance(v, str)}
    try:
        return _try(effect, form, base, optimum, measurement, floor, train, threads, progress)
    except StickslipError as error:
        return Candidate(effect.tag, form, effect, 0.0, note=str(error))


def _try(effect, form, base, optimum, measurement, floor, train, threads, progress) -> Candidate:
    free = effect_parameters(effect)
    composition = base.with_effect(effect, free)
    problem = Problem(composition, measurement, threads=threads)
    k = len(base.free)
    use = train & np.asarray(measurement.cycles.used)
    valid = measurement.valid & use[..., None]
    tell = progress or (lambda text: None)

    # score and starts: from each start one linear step of everything, which says what could be reached from there
    project = _Projection(problem, optimum, floor, valid)
    best: tuple[float, np.ndarray, np.ndarray] | None = None
    score = 0.0
    for values in starts(effect):
        begun = [f.starting(values.get(f.name.split(".", 1)[1], f.start)) for f in free]
        z = np.concatenate([optimum.z, [f.inward(f.start) for f in begun]])
        features = problem.features(z, optimum.events)
        if not np.isfinite(features[valid]).all():
            continue
        amplitude = k + next(i for i, f in enumerate(free) if f.amplitude)
        null = free[amplitude - k].inward(specs(effect)[effect.amplitude].null or 0.0)
        direction = (features - optimum.features) / (z[amplitude] - null)
        share, cost, step = project.line(direction)
        score = max(score, share)
        low, high = free[amplitude - k].bounds
        landing = float(np.clip(null + step, low + 1e-6, high - 1e-6))
        tell(f"{effect.tag}: start {values}, explains {100 * share:.0f} %")
        if best is None or cost < best[0]:
            at = z.copy()
            # not all the way: far steps of a nonlinear effect overshoot
            at[amplitude] = landing if abs(landing - null) < 3 * abs(z[amplitude] - null) else z[amplitude]
            best = (cost, at, features)
    if best is None:
        return Candidate(effect.tag, form, effect, score, composition, note="the model could not be evaluated with it")
    z = best[1]
    base_cost = optimum.cost
    features = problem.features(z, optimum.events)
    columns = np.concatenate(
        [optimum.columns, problem.columns(z, optimum.events, range(k, len(composition.free)), features)], axis=-1
    )
    found = fit(problem, floor, z=z, events=optimum.events, stages=WIDE, use=train, columns=columns, anew=False)
    tell(f"{effect.tag}: cost {base_cost:.0f} -> {found.cost:.0f} at wide floors")
    wide = WIDE[-1][0]
    note = ""
    if cost_at(found, measurement, floor, wide) > HOPELESS * cost_at(optimum, measurement, floor, wide):
        note = "explains little"
    else:
        found = fit(problem, floor, z=found.z, events=found.events, stages=REFIT, use=train, columns=found.columns)
        tell(f"{effect.tag}: cost {base_cost:.0f} -> {found.cost:.0f}")
    unseen = np.asarray(measurement.cycles.used) & ~train
    shown = replace(measurement, valid=valid)
    return Candidate(
        effect.tag,
        form,
        effect,
        score,
        composition,
        found,
        misfit(shown, found.features, floor),
        held_out(problem, found, floor, unseen, found.features),
        note,
    )


def cost_at(found: Fit, measurement: Measurement, floor: np.ndarray, factor: float) -> float:
    """Robust chi-square of the fitted cycles with all floors times ``factor``, event-wise priors included."""
    valid = measurement.valid & found.use[..., None]
    r = (found.features - measurement.values) / (factor * floor)
    event = found.events[found.use] / np.array(EVENT_WIDTHS)
    return robust(np.nan_to_num(r[valid], nan=1e4)) + float(np.sum(event**2))


class _Projection:
    """The base's residual and Jacobian, whitened, with priors: what a direction explains beyond refitting the base."""

    def __init__(self, problem: Problem, optimum: Fit, floor: np.ndarray, valid: np.ndarray) -> None:
        m = problem.measurement
        self.valid, self.floor = valid, floor
        r = (m.values - optimum.features) / floor
        self.weight = np.where(np.abs(r) > 3.0, np.sqrt(3.0 / np.maximum(np.abs(r), 3.0)), 1.0)
        event = problem.event_columns(optimum.columns, optimum.z, optimum.events)
        w = (self.weight / floor)[..., None]
        shared = np.nan_to_num(optimum.columns * w)[valid]
        cells = np.argwhere(valid.any(axis=-1))
        blocks = np.zeros((int(valid.sum()), 2 * len(cells)))
        index = np.full(valid.shape[:2], -1)
        index[valid.any(axis=-1)] = np.arange(len(cells))
        owner = np.broadcast_to(index[..., None], valid.shape)[valid]
        rows = np.arange(len(owner))
        e = np.nan_to_num(event * w)[valid]
        blocks[rows, 2 * owner], blocks[rows, 2 * owner + 1] = e[:, 0], e[:, 1]
        jac = np.hstack([shared, blocks])
        prior = np.concatenate(
            [[1.0 / min(f.width, 1e3) for f in optimum.free], np.tile(1.0 / np.array(EVENT_WIDTHS), len(cells))]
        )
        self.q, _ = np.linalg.qr(np.vstack([jac, np.diag(prior)]))
        self.pad = np.zeros(len(prior))
        self.residual = self._clean((r * self.weight)[valid])

    def _clean(self, column: np.ndarray) -> np.ndarray:
        padded = np.concatenate([column, self.pad])
        return padded - self.q @ (self.q.T @ padded)

    def line(self, direction: np.ndarray) -> tuple[float, float, float]:
        """Share of the residual a direction explains, the cost then left, and the best step along it."""
        d = self._clean(np.nan_to_num(direction * self.weight / self.floor)[self.valid])
        norm = float(d @ d)
        total = float(self.residual @ self.residual)
        if norm < 1e-20 or total <= 0:
            return 0.0, robust(self.residual), 0.0
        step = float(d @ self.residual) / norm
        share = step * step * norm / total
        return share, total * (1.0 - share), step


def forms_of(tag: str) -> list[Effect]:
    """The effect in every form of its law, the usual one first."""
    cls = catalogue.get(tag)
    return [cls(**form) for form in catalogue.forms(cls)]
