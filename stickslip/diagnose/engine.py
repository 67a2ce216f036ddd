"""The diagnosis: fit the base, try every effect, name one or say why not, add it, and repeat."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..campaign import Campaign
from ..effects import catalogue
from ..errors import InputError
from ..features.measurement import Measurement, measure
from ..fit.composition import Composition
from ..fit.inertial import Fit, certain, errors, fit
from ..fit.multistart import FURTHER, best_of
from ..fit.problem import Problem
from ..fit.start import FALLBACK_PERIOD, UNHEARD, base_composition, ringing
from ..floors import floors
from ..residual import Misfit, misfit
from ..segment import Segmentation, segment
from ..trace import Trace
from .candidate import MORE, MOST, Candidate
from .heldout import HeldOut, held_out
from .holdout import training_cycles
from .pieces import fit_arrays, fit_from
from .static_rung import static_features
from .sweep import Ground, Store, Sweep
from .thresholds import THRESHOLDS, Thresholds
from .verdict import (
    Judged,
    Verdict,
    confidence,
    decide,
    finished,
    is_adequate,
    is_complete,
    judge,
    nearly,
    nothing,
    undecided,
    worst_phase,
)

MOST_CYCLES = 14
BASE_AGAIN = ((3.0, 4), (1.0, MORE)), ((1.0, MORE),)  # stages: by way of wide floors, and straight on
FURTHER_FITS, ARRIVED = 4, 0.97  # of a model with a named effect, until one takes less than 3 % off its cost


@dataclass(frozen=True)
class Rung:
    """One step of the ladder of models.

    Attributes:
        model: tags of what is in it.
        added: what this rung added.
        train, held: errors on the cycles fitted and on the others.
        fit, composition: None for the static model.
        features: of the model (R, n, F).
    """

    model: tuple[str, ...]
    added: str | None
    train: Misfit
    held: HeldOut | None
    composition: Composition | None
    fit: Fit | None
    features: np.ndarray


@dataclass(frozen=True)
class Round:
    """One sweep over the catalogue.

    Attributes:
        candidates: every tag in its best form.
        every: every form that was fitted.
        judged: the conditions each candidate meets.
        base: what they were tried on.
    """

    candidates: tuple[Candidate, ...]
    every: tuple[Candidate, ...]
    judged: tuple[Judged, ...]
    base: Rung


@dataclass(frozen=True)
class Diagnosis:
    """Everything a report needs."""

    verdict: Verdict
    ladder: tuple[Rung, ...]
    rounds: tuple[Round, ...]
    measurement: Measurement
    floor: np.ndarray
    train: np.ndarray
    dropped: tuple[str, ...] = field(default=())


def diagnose(
    campaign: Campaign,
    traces: Sequence[Trace],
    segmentations: Sequence[Segmentation] | None = None,
    *,
    candidates: Sequence[str] | None = None,
    max_effects: int = 4,
    holdout: Sequence[str] = (),
    jobs: int | None = None,
    store: Store | None = None,
    limits: Thresholds = THRESHOLDS,
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """Find out what the base model lacks.

    Args:
        campaign, traces, segmentations: the measurement.
        candidates: tags to try; default the whole catalogue.
        max_effects: at most so many are added one after the other.
        holdout: runs no fit may see; default those whose role in the campaign is "held-out", or, where there are none,
            a middle velocity and the later part of runs with holds, of those whose role is not "train".
        jobs: parallel processes; default the number of cores.
        store: keeps finished pieces.
        limits: thresholds of the verdict.
        progress: told the stage and the share of the work done.

    Raises:
        InputError: the campaign lacks what the dynamic model needs.
    """
    tell = progress or (lambda text, share: None)
    segmentations = [segment(t) for t in traces] if segmentations is None else segmentations
    pairs = zip(traces, segmentations, strict=True)
    usable = [(t, s) for t, s in pairs if t.displacement is not None and t.drive is not None]
    dropped = [f"{t.name}: no displacement in it" for t in traces if t.displacement is None]
    dropped += [f"{t.name}: no drive is given" for t in traces if t.displacement is not None and t.drive is None]
    if not usable:
        raise InputError(
            "a diagnosis needs the displacement of the block and the motion of the drive", key="trace.displacement",
            hint="others can be inspected and fitted with --model static",
        )  # fmt: skip
    traces, segmentations = zip(*usable, strict=True)
    heard = ringing(traces, segmentations)
    if heard is None:
        dropped.append(UNHEARD)
    data = measure(
        traces,
        segmentations,
        ring_period=heard or FALLBACK_PERIOD,
        most_cycles=MOST_CYCLES,
        contacts=campaign.rig.contacts,
    )
    holdout = holdout or [t.name for t in traces if t.role == "held-out" and t.name in data.names]
    train = training_cycles(data, holdout, [t.name for t in traces if t.role == "train"])
    floor = floors(data)
    tags = catalogue.tags() if candidates is None else [catalogue.get(t).tag for t in candidates]
    jobs = (os.cpu_count() or 1) if jobs is None else jobs

    base = base_composition(campaign, data)
    tell("fitting the base model", 0.0)
    optimum = _kept(
        store,
        "base",
        lambda: best_of(
            Problem(base, data), floor, train, progress=lambda text, share: tell(f"base model, {text}", share)
        ),
    )
    rung = _rung(("static", "inertia"), "inertia", base, optimum, data, floor, train)
    stiffness = base.fixed.get("rig.spring_stiffness", optimum.values.get("rig.spring_stiffness", np.nan))
    ladder = [_static(data, floor, train, optimum, float(stiffness)), rung]
    rounds: list[Round] = []
    named: list[str] = []
    sure = 1.0
    while True:
        assert rung.held is not None
        for again in range(FURTHER_FITS if named else 0):
            # before another effect is looked for: is it the fit that has not arrived?
            if rung.held is None or rung.fit is None or is_complete(rung.train, rung.held, limits):
                break
            tell("the last model once more", 1.0)
            before = rung.fit.cost
            ladder[-1] = rung = _further(
                rung, rung.fit, FURTHER, data, floor, train, store, f"named{len(named)}-{again + 1}"
            )
            if rung.fit is None or rung.fit.cost > ARRIVED * before:
                break
        assert rung.held is not None
        phase, worst = worst_phase(rung.train, rung.held, limits)
        if is_complete(rung.train, rung.held, limits):
            verdict = finished(named)
            break
        if named and is_adequate(rung.train, rung.held, limits, limits.remainder):
            verdict = nearly(named, phase, worst, tried=False)  # too little is left to name another effect by
            break
        if not named and worst > limits.failed:
            verdict = Verdict(
                "unknown", text=f"The base model could not be fitted ({phase} is off by {worst:.0f} floors), so no "
                "effect was ranked. Look at `stickslip inspect` for units, missed events and the rig's values.",
            )  # fmt: skip
            break
        if len(named) >= max_effects:
            verdict = Verdict(
                "unknown", tuple(named), tuple(named),
                f"{len(named)} effects were added and {phase} is still off by {worst:.1f} floors.",
            )  # fmt: skip
            break
        rung, done = _round(
            [t for t in tags if t not in named], rung, data, floor, train, jobs, store, len(rounds), tell
        )
        ladder[-1] = rung
        assert rung.fit is not None
        assert rung.held is not None
        judged = [judge(c, rung.fit.cost, rung.held, limits) for c in done[0] if c.fit is not None and not c.note]
        rounds.append(Round(tuple(done[0]), tuple(done[1]), tuple(judged), rung))
        best, close = decide(judged, limits)
        if best is None:
            verdict = nothing(named, judged, rung, limits)
            break
        new = _add(rung, best.candidate, data, floor, train)
        ladder.append(new)
        assert new.held is not None
        if len(close) > 1 and is_adequate(new.train, new.held, limits):
            verdict = undecided(named, close)
            sure *= confidence(judged, close)
            break
        sure *= confidence(judged, [best])
        named.append(best.candidate.tag)
        rung = new
    if verdict.kind == "missing" and len(named) > 1:
        tell("trying to do without each effect", 1.0)
        ladder, left = _without(ladder, named, data, floor, train, limits)
        if len(left) < len(named):
            verdict = replace(finished(left), reasons=verdict.reasons)
    if verdict.kind in ("missing", "ambiguous"):
        verdict = replace(verdict, confidence=sure)
    top = ladder[-1]
    settled = [optimum, *(c.fit for r in rounds for c in r.candidates)]  # their standard deviations are known
    if top.fit is not None and top.composition is not None and not any(top.fit is f for f in settled):
        tell("standard deviations", 1.0)
        last, composition = top.fit, top.composition
        ladder[-1] = replace(top, fit=_kept(store, "last", lambda: certain(Problem(composition, data), floor, last)))
    return Diagnosis(verdict, tuple(ladder), tuple(rounds), data, floor, train, (*data.dropped, *dropped))


def _round(
    tags: Sequence[str],
    rung: Rung,
    data: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    jobs: int,
    store: Store | None,
    number: int,
    tell: Callable[[str, float], None],
) -> tuple[Rung, tuple[list[Candidate], list[Candidate]]]:
    """All candidates on a rung, and the rung fitted again from where the best of them arrived.

    A base less converged than its rivals would make a gain of nothing.
    """
    assert rung.composition is not None
    assert rung.fit is not None
    ground = Ground(rung.composition, rung.fit, data, floor, train)
    name = f"round{number + 1}"
    done = Sweep(ground, jobs, store, name, tell).run(tags)
    best = min((c for c in done[0] if not c.note), key=lambda c: c.cost, default=None)
    if best is None or best.fit is None:
        return rung, done
    k = len(rung.composition.free)
    begin = replace(rung.fit, z=best.fit.z[:k], events=best.fit.events)
    for i, stages in enumerate(BASE_AGAIN):
        rung = _further(rung, begin, stages, data, floor, train, store, f"{name}-again{i + 1}")
    return rung, done


def _further(
    rung: Rung,
    begin: Fit,
    stages: tuple[tuple[float, int], ...],
    data: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    store: Store | None,
    name: str,
) -> Rung:
    """The rung fitted again from where ``begin`` is, if that is better."""
    assert rung.composition is not None
    assert rung.fit is not None
    problem = Problem(rung.composition, data)
    more = _kept(store, name, lambda: fit(problem, floor, z=begin.z, events=begin.events, stages=stages, use=train))
    if more.cost >= rung.fit.cost:
        return rung
    return _rung(rung.model, rung.added, rung.composition, more, data, floor, train)


def _kept(store: Store | None, name: str, make: Callable[[], Fit]) -> Fit:
    """The fit of that name from the store, or made and kept there."""
    kept = store.load(name) if store is not None else None
    if kept is not None:
        return fit_from(kept)
    found = make()
    if store is not None:
        store.save(name, fit_arrays(found))
    return found


def _without(
    ladder: list[Rung], named: list[str], data: Measurement, floor: np.ndarray, train: np.ndarray, limits: Thresholds
) -> tuple[list[Rung], list[str]]:
    """The ladder without effects that are no longer needed once the later ones are in."""
    top = ladder[-1]
    assert top.composition is not None
    assert top.fit is not None
    for tag in named[:-1]:
        smaller = top.composition.without(tag)
        kept = [i for i, f in enumerate(top.composition.free) if f in smaller.free]
        found = fit(
            Problem(smaller, data), floor, z=top.fit.z[kept], events=top.fit.events, stages=((1.0, MOST),), use=train
        )
        left = [t for t in named if t != tag]
        rung = _rung(("static", "inertia", *left), left[-1], smaller, found, data, floor, train)
        assert rung.held is not None
        if found.cost < limits.rival * top.fit.cost and is_complete(rung.train, rung.held, limits):
            return [*ladder[:2], rung], left
    return ladder, named


def _rung(
    model: tuple[str, ...],
    added: str | None,
    composition: Composition,
    optimum: Fit,
    data: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
) -> Rung:
    unseen = np.asarray(data.cycles.used) & ~train
    held = held_out(Problem(composition, data), optimum, floor, unseen, optimum.features)
    return Rung(model, added, errors(data, optimum, floor), held, composition, optimum, optimum.features)


def _static(data: Measurement, floor: np.ndarray, train: np.ndarray, optimum: Fit, stiffness: float) -> Rung:
    used = np.asarray(data.cycles.used)
    features = static_features(data, floor, optimum, stiffness, train & used)
    seen = replace(data, valid=data.valid & (train & used)[..., None])
    unseen = replace(data, valid=data.valid & (~train & used)[..., None])
    out = misfit(unseen, features, floor)
    held = HeldOut(out.total, out.total**2, out.by_phase, np.array([]))
    return Rung(("static",), None, misfit(seen, features, floor), held, None, None, features)


def _add(rung: Rung, candidate: Candidate, data: Measurement, floor: np.ndarray, train: np.ndarray) -> Rung:
    assert candidate.composition is not None
    assert candidate.fit is not None
    return _rung((*rung.model, candidate.tag), candidate.tag, candidate.composition, candidate.fit, data, floor, train)
