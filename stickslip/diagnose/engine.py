"""The diagnosis: fit the base, try every effect, name one or say why not, add it, and repeat."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from joblib import Parallel, delayed

from ..campaign import Campaign
from ..effects import catalogue
from ..effects.base import Effect
from ..errors import InputError
from ..features.measurement import Measurement, measure
from ..fit.composition import Composition
from ..fit.inertial import Fit, fit
from ..fit.problem import Problem
from ..fit.start import base_composition, ring_period
from ..residual import Misfit, floors, misfit
from ..segment import Segmentation, segment
from ..trace import Trace
from .candidate import Candidate, forms_of, try_effect
from .heldout import HeldOut, held_out
from .holdout import training_cycles
from .pieces import candidate_arrays, candidate_from, fit_arrays, fit_from
from .static_rung import static_features
from .thresholds import THRESHOLDS, Thresholds
from .verdict import Judged, Verdict, decide, is_complete, judge, worst_phase

MOST_CYCLES = 14


class Store(Protocol):
    """Where finished pieces are kept, so that an interrupted diagnosis goes on."""

    def load(self, key: str) -> Mapping[str, np.ndarray] | None:
        """A finished piece, or None."""

    def save(self, key: str, piece: Mapping[str, np.ndarray]) -> None:
        """Keep a finished piece."""


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
class Diagnosis:
    """Everything a report needs."""

    verdict: Verdict
    ladder: tuple[Rung, ...]
    rounds: tuple[tuple[Candidate, ...], ...]
    judged: tuple[tuple[Judged, ...], ...]
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
    max_effects: int = 3,
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
        holdout: runs no fit may see; default a middle velocity and the later part of runs with holds.
        jobs: parallel processes; default the number of cores.
        store: keeps finished pieces.
        limits: thresholds of the verdict.
        progress: told the stage and the share of the work done.

    Raises:
        InputError: the campaign lacks what the dynamic model needs.
    """
    tell = progress or (lambda text, share: None)
    segmentations = [segment(t) for t in traces] if segmentations is None else segmentations
    usable = [(t, s) for t, s in zip(traces, segmentations, strict=True) if t.displacement is not None]
    dropped = [f"{t.name}: no displacement in it" for t in traces if t.displacement is None]
    if not usable:
        raise InputError(
            "a diagnosis needs the displacement of the block", key="trace.displacement",
            hint="traces of spring force alone can be inspected and fitted with --model static",
        )  # fmt: skip
    traces, segmentations = zip(*usable, strict=True)
    data = measure(traces, segmentations, ring_period=ring_period(traces, segmentations), most_cycles=MOST_CYCLES)
    train = training_cycles(data, holdout)
    floor = floors(data, factor=scatter_factor(data))
    tags = catalogue.tags() if candidates is None else [catalogue.get(t).tag for t in candidates]
    jobs = (os.cpu_count() or 1) if jobs is None else jobs

    base = base_composition(campaign, data)
    tell("fitting the base model", 0.0)
    base, optimum = _base_fit(base, data, floor, train, store)
    rung = _rung(("static", "inertia"), "inertia", base, optimum, data, floor, train)
    stiffness = base.fixed.get("rig.spring_stiffness", optimum.values.get("rig.spring_stiffness", np.nan))
    ladder = [_static(data, floor, train, optimum, float(stiffness)), rung]
    rounds: list[tuple[Candidate, ...]] = []
    verdicts: list[tuple[Judged, ...]] = []
    named: list[str] = []
    verdict = Verdict("unknown")
    while True:
        assert rung.held is not None
        if is_complete(rung.train, rung.held, limits):
            verdict = _finished(named)
            break
        phase, worst = worst_phase(rung.train, rung.held)
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
        tried = _sweep([t for t in tags if t not in named], rung, data, floor, train, jobs, store, len(named), tell)
        rounds.append(tuple(tried))
        judged = [judge(c, rung.fit.cost, rung.held, limits) for c in tried if c.fit is not None]  # type: ignore[union-attr]
        verdicts.append(tuple(judged))
        best, close = decide(judged, limits)
        if best is None:
            verdict = _nothing(named, judged, phase, worst)
            break
        if len(close) > 1:
            tags_close = tuple(j.candidate.tag for j in close)
            verdict = Verdict(
                "ambiguous", tuple(named), (*named, *tags_close) if named else tags_close,
                f"These data cannot tell {_listed(tags_close)} apart.", best.failures,
            )  # fmt: skip
            ladder.append(_add(rung, best.candidate, data, floor, train))
            break
        new = _add(rung, best.candidate, data, floor, train)
        ladder.append(new)
        named.append(best.candidate.tag)
        rung = new
    return Diagnosis(
        verdict, tuple(ladder), tuple(rounds), tuple(verdicts), data, floor, train, (*data.dropped, *dropped)
    )


def scatter_factor(data: Measurement) -> float:
    """How much the contact varies from event to event, in units of the floors' own share: 1 (same lines) to 2 (new).

    Taken from the slip size, which neither drive nor sensor can scatter much.
    """
    s = data.layout.slices()["size"]
    used = np.asarray(data.cycles.used)
    ratios = []
    for r in range(data.runs):
        sizes = data.values[r][used[r]][1:, s].ravel()
        holds = data.valid[r][used[r]][1:, data.layout.slices()["hold"]].any(axis=1)
        sizes = sizes[~holds]
        if sizes.size >= 4:
            trend = np.polynomial.polynomial.polyfit(np.arange(sizes.size), sizes, 1)
            rest = sizes - np.polynomial.polynomial.polyval(np.arange(sizes.size), trend)
            ratios.append(np.std(rest, ddof=2) / np.mean(sizes))
    if not ratios:
        return 1.5
    return float(np.clip(np.median(ratios) / 0.0015, 1.0, 2.0))


def _base_fit(
    base: Composition, data: Measurement, floor: np.ndarray, train: np.ndarray, store: Store | None
) -> tuple[Composition, Fit]:
    kept = store.load("base") if store is not None else None
    if kept is not None:
        return base, fit_from(kept)
    found = fit(Problem(base, data), floor, use=train)
    if store is not None:
        store.save("base", fit_arrays(found))
    return base, found


def _rung(
    model: tuple[str, ...],
    added: str,
    composition: Composition,
    optimum: Fit,
    data: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
) -> Rung:
    unseen = np.asarray(data.cycles.used) & ~train
    shown = replace(data, valid=data.valid & (train & np.asarray(data.cycles.used))[..., None])
    held = held_out(Problem(composition, data), optimum, floor, unseen, optimum.features)
    return Rung(model, added, misfit(shown, optimum.features, floor), held, composition, optimum, optimum.features)


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


def _sweep(
    tags: Sequence[str],
    rung: Rung,
    data: Measurement,
    floor: np.ndarray,
    train: np.ndarray,
    jobs: int,
    store: Store | None,
    number: int,
    tell: Callable[[str, float], None],
) -> list[Candidate]:
    """All candidates on top of a rung, in parallel processes; those already in the store are not done again."""
    done: dict[str, Candidate] = {}
    for tag in tags:
        kept = store.load(f"round{number + 1}-{tag}") if store is not None else None
        if kept is not None and rung.composition is not None:
            done[tag] = candidate_from(kept, rung.composition, data, floor, train)
    open_tags = [t for t in tags if t not in done]
    pool = Parallel(n_jobs=jobs, return_as="generator_unordered") if jobs > 1 else None
    work = [(tag, forms_of(tag)[0]) for tag in open_tags]
    assert rung.composition is not None
    assert rung.fit is not None
    if pool is not None:
        results = pool(delayed(_one)(effect, rung.composition, rung.fit, data, floor, train) for _, effect in work)
    else:
        results = (_one(effect, rung.composition, rung.fit, data, floor, train) for _, effect in work)
    for candidate in results:
        done[candidate.tag] = candidate
        if store is not None:
            store.save(f"round{number + 1}-{candidate.tag}", candidate_arrays(candidate))
        tell(f"round {number + 1}: {candidate.tag} done", len(done) / max(len(tags), 1))
    return [done[t] for t in tags]


def _one(
    effect: Effect, composition: Composition, optimum: Fit, data: Measurement, floor: np.ndarray, train: np.ndarray
) -> Candidate:
    return try_effect(effect, composition, optimum, data, floor, train, threads=1)


def _listed(tags: Sequence[str]) -> str:
    return tags[0] if len(tags) == 1 else f"{', '.join(tags[:-1])} and {tags[-1]}"


def _finished(named: Sequence[str]) -> Verdict:
    if not named:
        return Verdict("complete", text="Nothing is missing: every phase is described as well as the data allow.")
    return Verdict(
        "missing",
        tuple(named),
        tuple(named),
        f"The base model lacks {_listed(named)}. With it every phase is described as well as the data allow.",
    )


def _nothing(named: Sequence[str], judged: Sequence[Judged], phase: str, worst: float) -> Verdict:
    nearest = min(judged, key=lambda j: j.cost, default=None)
    text = f"Something is missing ({phase} is off by {worst:.1f} floors) and nothing in the catalogue explains it"
    if nearest is not None:
        text += f"; nearest is {nearest.candidate.tag}, but {'; '.join(nearest.failures) or 'it does not suffice'}"
    reasons = nearest.failures if nearest is not None else ()
    if named:
        adequate = worst <= THRESHOLDS.adequate
        if adequate:
            return Verdict(
                "missing", tuple(named), tuple(named),
                f"The base model lacks {_listed(named)}. A small misfit remains ({phase}, {worst:.1f} floors) that "
                "nothing in the catalogue explains.", reasons,
            )  # fmt: skip
        return Verdict("unknown", tuple(named), tuple(named), f"{_listed(named)} helps, but: {text}.", reasons)
    return Verdict("unknown", (), (), text + ".", reasons)
