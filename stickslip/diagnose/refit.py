"""A candidate refitted from where its search began, everything else free, in stages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..effects.base import Effect
from ..errors import StickslipError
from ..features.measurement import Measurement
from ..fit.composition import Composition
from ..fit.inertial import Fit, certain, fit
from ..fit.problem import Problem
from ..params import specs
from .begin import with_starts
from .candidate import Candidate, ease, with_fit
from .search import plausible, score, silent

HOPEFUL = 0.2  # share of the misfit gone at the start from which a search that led nowhere is begun anew
FEW = 9  # evaluations for those that promise something
MORE = 12  # more for the better half of them
MOST = 30  # for the leaders
LARGER = 2.0, 1.5  # times its amplitude: where a leader is begun again, each as long as it leads on
AGAIN, SETTLED = 10, 0.97  # a leader is begun or refined again until that takes less than 3 % off its cost
WIDELY = ((7.0, 8), (2.5, 8), (1.0, 14))  # by way of wide floors: a search that stands still in a bent valley goes on
FAR = ((30.0, 8), *WIDELY)  # the same from another amplitude


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
    """Score one effect on top of the base and refit everything with it to the end.

    Args:
        effect: with its form chosen.
        base, optimum: the base composition and its fit.
        measurement, floor: the data.
        train: cycles that may be fitted, shape (R, n).
        threads: runs integrated at the same time.
        progress: told what goes on.
    """
    found = score(effect, base, optimum, measurement, floor, train, threads=threads, progress=progress)
    found = refine(found, measurement, floor, train, FEW, threads=threads, progress=progress)
    return settle(found, measurement, floor, train, threads=threads, progress=progress)


def refine(
    candidate: Candidate,
    measurement: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    evaluations: int,
    *,
    stages: tuple[tuple[float, int], ...] = (),
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Candidate:
    """The same candidate after at most so many ``evaluations`` more: first at floors as wide as the misfit asks for.

    ``stages`` (factors on the floors, evaluations) are taken in place of those.
    """
    if candidate.fit is None or candidate.composition is None:
        return candidate
    problem = Problem(candidate.composition, measurement, threads=threads)
    old = candidate.fit
    wide = ease(old, measurement, floor)
    straight = ((1.0, evaluations),)
    if not stages:
        half = evaluations // 2
        stages = ((wide, half), (1.0, evaluations - half)) if wide > 1.5 else straight
    try:
        # derivatives in the effect's own parameters are known where everything was refitted around it
        own = [i for i, f in enumerate(old.free) if f.name.startswith(f"{candidate.tag}.")]
        known = old.columns if np.any(old.columns[..., own]) else None
        new = fit(problem, floor, z=old.z, events=old.events, stages=stages, use=train, columns=known)
        if new.cost >= old.cost and len(stages) > 1 and candidate.promise > HOPEFUL:
            # wide floors led away from a good place: straight on from there
            new = fit(problem, floor, z=old.z, events=old.events, stages=straight, use=train, columns=known)
    except StickslipError as error:
        return replace(candidate, note=str(error))
    (progress or silent)(f"{candidate.tag}: cost {old.cost:.0f} -> {new.cost:.0f}")
    better = new if new.cost < old.cost or candidate.note else old
    return with_fit(replace(candidate, note=""), better, problem, floor, train)


def settle(
    candidate: Candidate,
    measurement: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    worth: float = np.inf,
    *,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Candidate:
    """The same candidate refined to the end, from where it is and from its other starts; the best of them.

    It is followed by way of wide floors only where its cost is below ``worth`` by then: from twice its amplitude again
    and again, until that leads no further, from half as much more, and then from where it is, until it stands still.
    Its standard deviations are those of :func:`stickslip.fit.inertial.certain`.
    """

    def go(candidate: Candidate, most: int, stages: tuple[tuple[float, int], ...] = ()) -> Candidate:
        return refine(candidate, measurement, floor, train, most, stages=stages, threads=threads, progress=progress)

    best = go(candidate, MOST)
    if best.fit is None:
        return best
    for z, events in candidate.others:
        start = replace(candidate, fit=replace(best.fit, z=z, events=events), note="not refitted")
        other = go(start, FEW + MORE)
        if other.cost < best.cost:
            best = other
    if best.fit is None or best.composition is None:
        return best
    problem = Problem(best.composition, measurement, threads=threads)
    steps = list(LARGER) if _amplitude(best) is not None else []
    for _ in range(AGAIN if best.cost < worth else 0):
        before = best.cost
        begins, stages = (_larger(best, steps[0], problem, train), FAR) if steps else (best, WIDELY)
        best = min(best, go(begins, MOST, stages), key=lambda c: c.cost)
        if best.cost > SETTLED * before:
            if not steps:
                break
            steps.pop(0)
    assert best.fit is not None
    sure = certain(problem, floor, best.fit)
    # its errors were taken with the derivatives it has
    return replace(best, fit=replace(best.fit, covariance=sure.covariance), settled=True)


def afar(
    candidate: Candidate,
    optimum: Fit,
    measurement: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    *,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Candidate:
    """The candidate refitted from the best of its plausible amplitudes, and all else as in the ``optimum`` without it.

    It is the way of :func:`stickslip.diagnose.search.score` with derivatives of its own, and with events that begin at
    their prior's mean: where an effect is strong, those of the optimum lead nowhere. One that was not refitted yet is
    from where its search began as well, and the better of both is taken: from afar a weak one is overshot. A periodic
    effect has a phase, and no start afar.
    """
    if candidate.note:
        candidate = refine(candidate, measurement, floor, train, FEW + MORE, threads=threads, progress=progress)
    if candidate.fit is None or candidate.composition is None or candidate.effect.periodic is not None:
        return candidate
    problem = Problem(candidate.composition, measurement, threads=threads)
    events = np.zeros_like(optimum.events)
    try:
        far = plausible(candidate, optimum, measurement, floor, train, threads)
        tried = [fit(problem, floor, z=z, events=events, stages=FAR[:2], use=train) for z in far]
        first = min(tried, key=lambda f: f.cost)
        new = fit(problem, floor, z=first.z, events=first.events, stages=FAR[2:], use=train, columns=first.columns)
    except StickslipError as error:
        return replace(candidate, note=str(error)) if candidate.note else candidate
    (progress or silent)(f"{candidate.tag}: cost {candidate.cost:.0f}, from afar {new.cost:.0f}")
    if new.cost >= candidate.cost and not candidate.note:
        return candidate
    # its other starts are from where this one is not
    return with_fit(replace(candidate, note="", settled=False, others=()), new, problem, floor, train)


def _amplitude(candidate: Candidate) -> int | None:
    """Which of the free parameters is the amplitude of the effect, or none where that is not free."""
    assert candidate.fit is not None
    own = (i for i, f in enumerate(candidate.fit.free) if f.amplitude and f.name.startswith(f"{candidate.tag}."))
    return next(own, None)


def _larger(candidate: Candidate, times: float, problem: Problem, train: np.ndarray) -> Candidate:
    """The candidate at a larger amplitude, to be refitted: a small one may be a bend of the valley that leads on.

    Its events begin anew at their prior's mean: they have bent themselves to what the smaller amplitude leaves.
    """
    assert candidate.fit is not None
    old, i = candidate.fit, _amplitude(candidate)
    assert i is not None
    use = train & np.asarray(problem.measurement.cycles.used)
    free, spec = old.free[i], specs(candidate.effect)[old.free[i].name.split(".", 1)[1]]
    null = free.inward(spec.null or 0.0)
    z = old.z.copy()
    z[i] = np.clip(null + times * (z[i] - null), *np.array(free.bounds) + np.array([1e-6, -1e-6]))
    events = np.zeros_like(old.events)
    z = with_starts(problem.seeing(use), z, events, old.columns, old.free, problem.measurement.values, use)
    # the derivatives are those of another place, and its cost is not this one's
    far = replace(old, z=z, events=events, cost=np.inf, columns=np.zeros_like(old.columns))
    return replace(candidate, fit=far, note="not refitted")
