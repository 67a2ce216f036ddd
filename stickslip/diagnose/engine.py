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
from ..fit.inertial import Fit, certain, fit
from ..fit.multistart import FURTHER, best_of
from ..fit.problem import Problem
from ..fit.start import FALLBACK_PERIOD, UNHEARD, base_composition, ringing
from ..floors import floors
from ..residual import misfit
from ..segment import Segmentation, segment
from ..trace import Trace
from .begin import with_starts
from .candidate import Candidate
from .heldout import HeldOut
from .holdout import training_cycles
from .refit import AGAIN, MORE, SETTLED, WIDELY
from .revise import Named, Tell, done_without, told_apart
from .rungs import Material, Rung, kept, make_rung
from .static_rung import static_features
from .sweep import SWEPT, Ground, Store, Sweep, best_forms
from .thresholds import THRESHOLDS, Thresholds
from .verdict import (
    Judged,
    Verdict,
    decide,
    finished,
    grade,
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
BEGINS = 2  # cheapest candidates, from where each of which the base is fitted again
SEVERAL = "unequal-contacts"  # means nothing where there is one
FURTHER_FITS, ARRIVED = 4, 0.97  # of a model with a named effect, until one takes less than 3 % off its cost


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
    """Everything a report needs.

    Attributes:
        verdict, ladder, rounds: what was found, and how.
        measurement, floor, train: the data, its floors, the cycles fitted (R, n).
        dropped: what was left out, and why.
        sets: effects that these data cannot tell apart: of an ambiguous verdict each as fitted in the last model, of an
            unknown one as fitted where the first of them was added.
    """

    verdict: Verdict
    ladder: tuple[Rung, ...]
    rounds: tuple[Round, ...]
    measurement: Measurement
    floor: np.ndarray
    train: np.ndarray
    dropped: tuple[str, ...] = field(default=())
    sets: tuple[tuple[Candidate, ...], ...] = field(default=())


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
    material = Material(data, floors(data), train, store)
    tags = catalogue.tags() if candidates is None else [catalogue.get(t).tag for t in candidates]
    if campaign.rig.contacts == 1 and SEVERAL in tags:
        tags.remove(SEVERAL)
        dropped.append(f"{SEVERAL}: not tried, for the rig has one contact")
    jobs = (os.cpu_count() or 1) if jobs is None else jobs

    ladder = _base(campaign, material, tell)
    optimum = ladder[-1].fit
    named: list[Named] = []
    rounds: list[Round] = []
    while True:
        ladder[-1] = rung = _arrived(ladder[-1], named, material, limits, tell)
        verdict = _stop(rung, named, max_effects, limits)
        if verdict is not None:
            break
        taken = {n.tag for n in named}
        ladder[-1], done = _round(
            [t for t in tags if t not in taken], rung, material, jobs, f"round{len(rounds) + 1}", tell, limits
        )
        rounds.append(done)
        best, close = decide(done.judged, limits)
        if best is None:
            verdict = nothing([n.tag for n in named], done.judged, done.base, limits, _forms(named))
            break
        top = _add(done.base, best.candidate, material)
        ladder.append(top)
        rivals = tuple(j.candidate for j in close[1:])
        stays = bool(rivals) and is_adequate(top.train, top.held, limits)
        named = [*(replace(n, fresh=False) for n in named), Named(best.candidate, rivals, done.judged, stays)]
        if stays:
            verdict = Verdict("missing")  # to be said below: of a set, nothing is added to
            break
    added = len(named)
    ladder, named = done_without(ladder, named, material, limits, tell)
    if verdict.kind == "unknown" and len(named) < added:
        found = _stop(ladder[-1], named, added, limits, added) if len(rounds) == added else None
        tags = [n.tag for n in named]
        verdict = found or nothing(tags, rounds[-1].judged, ladder[-1], limits, _forms(named))
    if verdict.kind == "missing":
        ladder[-1], named = told_apart(ladder[-1], named, material, limits, tell)
        verdict = _said(ladder[-1], named, verdict, limits)
    sets = tuple((n.candidate, *others) for n in named if (others := _others(n, named)))
    if sets and verdict.kind == "unknown":
        every = tuple(dict.fromkeys(c.tag for n in named for c in (n.candidate, *n.rivals)))
        apart = undecided((), [[c.tag for c in group] for group in sets], _forms(named))
        verdict = replace(verdict, set=every, text=f"{verdict.text} {apart.text}")
    if not any(ladder[-1].fit is f for f in (optimum, *(c.fit for r in rounds for c in r.candidates))):
        tell("standard deviations", 0.0)
        ladder[-1] = _certain(ladder[-1], material)
    return Diagnosis(
        verdict,
        tuple(ladder),
        tuple(rounds),
        data,
        material.floor,
        train,
        (*data.dropped, *dropped),
        sets,
    )


def _base(campaign: Campaign, material: Material, tell: Tell) -> list[Rung]:
    """The static model and the base model."""
    data, floor, train, store = material
    base = base_composition(campaign, data)
    tell("fitting the base model", 0.0)
    optimum = kept(
        store,
        "base",
        lambda: best_of(
            Problem(base, data), floor, train, progress=lambda text, share: tell(f"base model, {text}", share)
        ),
    )
    stiffness = base.fixed.get("rig.spring_stiffness", optimum.values.get("rig.spring_stiffness", np.nan))
    rung = make_rung(("static", "inertia"), "inertia", base, optimum, material)
    return [_static(material, optimum, float(stiffness)), rung]


def _arrived(rung: Rung, named: Sequence[Named], material: Material, limits: Thresholds, tell: Tell) -> Rung:
    """The last model fitted further before another effect is looked for: is it the fit that has not arrived?"""
    for again in range(FURTHER_FITS if named else 0):
        if rung.fit is None or is_complete(rung.train, rung.held, limits):
            break
        tell(f"the last model once more ({again + 1})", again / FURTHER_FITS)
        before = rung.fit.cost
        rung = _further(rung, rung.fit, FURTHER, material, f"named{len(named)}-{again + 1}")
        if rung.fit is None or rung.fit.cost > ARRIVED * before:
            break
    return rung


def _stop(
    rung: Rung, named: Sequence[Named], max_effects: int, limits: Thresholds, added: int | None = None
) -> Verdict | None:
    """The verdict where no further effect is looked for, or None; ``added`` were, if not all of them are left."""
    tags, forms = [n.tag for n in named], _forms(named)
    left = grade(rung.train, rung.held, limits)
    phase, worst = worst_phase(rung.train, rung.held, limits)
    if left == 0:
        return finished(tags, forms)
    if named and left == 1:
        return nearly(tags, phase, worst, tried=False, forms=forms)  # too little is left to name another effect by
    if not named and worst > limits.failed:
        return Verdict(
            "unknown", text=f"The base model could not be fitted ({phase} is off by {worst:.0f} floors), so no "
            "effect was ranked. Look at `stickslip inspect` for units, missed events and the rig's values.",
        )  # fmt: skip
    added = len(named) if added is None else added
    if added < max_effects:
        return None
    if named and left == 2:
        return nearly(tags, phase, worst, tried=False, forms=forms)
    many = "1 effect was added" if added == 1 else f"{added} effects were added"
    many += f" ({added - len(named)} taken out again)" if added > len(named) else ""
    text = f"{many} and {phase} is still off by {worst:.1f} floors."
    return Verdict("unknown", tuple(tags), tuple(tags), text, forms=forms)


def _said(rung: Rung, named: Sequence[Named], verdict: Verdict, limits: Thresholds) -> Verdict:
    """The verdict on the last model, once it is known what may go and what cannot be told apart."""
    forms = _forms(named)
    groups = [[n.tag, *(r.tag for r in n.rivals)] for n in named if n.rivals]
    sure = [n.tag for n in named if not n.rivals]
    if groups:
        found = undecided(sure, groups, forms)
    elif is_complete(rung.train, rung.held, limits):
        found = finished(sure, forms)
    else:
        phase, worst = worst_phase(rung.train, rung.held, limits)
        found = nearly(sure, phase, worst, tried=bool(verdict.reasons), reasons=verdict.reasons, forms=forms)
    return replace(found, confidence=float(np.prod([n.confidence for n in named])))


def _others(one: Named, named: Sequence[Named]) -> list[Candidate]:
    """Rivals of an effect that are not in the model themselves."""
    return [r for r in one.rivals if all(r.tag != n.tag for n in named)]


def _forms(named: Sequence[Named]) -> dict[str, dict[str, str]]:
    """tag -> form of its law, where it has several, and the exponents that say as much."""
    found = {c.tag: {**c.form, **_exponents(c)} for n in named for c in (n.candidate, *n.rivals)}
    return {tag: form for tag, form in found.items() if form}


def _exponents(candidate: Candidate) -> dict[str, str]:
    names = candidate.effect.exponents if candidate.fit is not None else ()
    if not names:
        return {}
    assert candidate.fit is not None
    values, std = candidate.fit.values, candidate.fit.std()
    keys = {name: f"{candidate.tag}.{name}" for name in names}
    return {name: f"{values[key]:.2g} +- {std[key]:.1g}" for name, key in keys.items()}


def _round(
    tags: Sequence[str],
    rung: Rung,
    material: Material,
    jobs: int,
    name: str,
    tell: Tell,
    limits: Thresholds,
) -> tuple[Rung, Round]:
    """All candidates on a rung, and the rung fitted again from where the best two of them arrived, and what is named.

    A base less converged than its rivals would make a gain of nothing. An effect is named, alone or in a set, only
    after what it may be taken for was refitted, and the rung from where it arrived.
    """
    assert rung.composition is not None
    assert rung.fit is not None
    data, floor, train, store = material
    ground = Ground(rung.composition, rung.fit, data, floor, train)
    sweep = Sweep(ground, jobs, store, name, tell, limits)
    candidates, every = sweep.run(tags)
    begins = sorted((c for c in candidates if c.fit is not None and not c.note), key=lambda c: c.cost)[:BEGINS]
    if begins:
        tell(f"{name}: the model without them fitted again", SWEPT)
        rung = _widely(_from(rung, begins, material, name), material, name)
    judged = _judged(candidates, rung, limits)
    compared: set[str] = set()
    while (named := _not_compared(judged, compared, limits)) is not None:
        tag = named.tag
        compared.add(tag)
        every = sweep.rivals(named, every)
        candidates = best_forms(tags, every)
        arrived = next(c for c in candidates if c.tag == tag)
        if all(c is not arrived for c in begins):
            tell(f"{name}: the model without {tag} fitted again", SWEPT)
            nearer = _from(rung, [arrived], material, f"{name}-{tag}")
            rung = rung if nearer is rung else _widely(nearer, material, f"{name}-{tag}")
        judged = _judged(candidates, rung, limits)
    return rung, Round(tuple(candidates), tuple(every), tuple(judged), rung)


def _not_compared(judged: Sequence[Judged], compared: set[str], limits: Thresholds) -> Candidate | None:
    """What may get a name, alone or in a set, and was not compared yet with what it may be taken for."""
    _, close = decide(judged, limits)
    return next((j.candidate for j in close if j.passed and j.candidate.tag not in compared), None)


def _judged(candidates: Sequence[Candidate], rung: Rung, limits: Thresholds) -> list[Judged]:
    """The conditions that each refitted candidate meets beside a rung."""
    assert rung.fit is not None
    assert rung.held is not None
    return [judge(c, rung.fit.cost, rung.held, limits) for c in candidates if c.fit is not None and not c.note]


def _from(rung: Rung, begins: Sequence[Candidate], material: Material, name: str) -> Rung:
    """The rung fitted again from where candidates arrived, if that is better."""
    assert rung.composition is not None
    assert rung.fit is not None
    data, _, train, _ = material
    old, use = rung.fit, train & np.asarray(data.cycles.used)
    problem = Problem(rung.composition, data).seeing(use)
    places = []
    for c in begins:
        assert c.fit is not None
        z = with_starts(problem, c.fit.z[: old.z.size], c.fit.events, old.columns, old.free, data.values, use)
        places.append(replace(old, z=z, events=c.fit.events))
    for i, (begin, stages) in enumerate((place, stages) for place in places for stages in BASE_AGAIN):
        rung = _further(rung, begin, stages, material, f"{name}-again{i + 1}")
    return rung


def _widely(rung: Rung, material: Material, name: str) -> Rung:
    """The rung followed by way of wide floors, as long as a leader is."""
    for i in range(AGAIN):
        assert rung.fit is not None
        before = rung.fit.cost
        rung = _further(rung, rung.fit, WIDELY, material, f"{name}-wide{i + 1}")
        if rung.fit is None or rung.fit.cost > SETTLED * before:
            break
    return rung


def _further(rung: Rung, begin: Fit, stages: tuple[tuple[float, int], ...], material: Material, name: str) -> Rung:
    """The rung fitted again from where ``begin`` is, if that is better."""
    assert rung.composition is not None
    assert rung.fit is not None
    data, floor, train, store = material
    problem = Problem(rung.composition, data)
    more = kept(store, name, lambda: fit(problem, floor, z=begin.z, events=begin.events, stages=stages, use=train))
    if more.cost >= rung.fit.cost:
        return rung
    return make_rung(rung.model, rung.added, rung.composition, more, material, rung.removed)


def _certain(rung: Rung, material: Material) -> Rung:
    """The rung with the standard deviations of its fit."""
    if rung.fit is None or rung.composition is None:
        return rung
    last, composition = rung.fit, rung.composition
    data, floor, _, store = material
    # named after what is in it, for an effect may have been taken out or exchanged since the piece was kept
    name = "last-" + "-".join(rung.model[2:]) if len(rung.model) > 2 else "last"
    return replace(rung, fit=kept(store, name, lambda: certain(Problem(composition, data), floor, last)))


def _static(material: Material, optimum: Fit, stiffness: float) -> Rung:
    data, floor, train, _ = material
    used = np.asarray(data.cycles.used)
    features = static_features(data, floor, optimum, stiffness, train & used)
    seen = replace(data, valid=data.valid & (train & used)[..., None])
    unseen = replace(data, valid=data.valid & (~train & used)[..., None])
    out = misfit(unseen, features, floor)
    held = HeldOut(out.total, out.total**2, out.by_phase, np.array([]))
    return Rung(("static",), None, misfit(seen, features, floor), held, None, None, features)


def _add(rung: Rung, candidate: Candidate, material: Material) -> Rung:
    assert candidate.composition is not None
    assert candidate.fit is not None
    return make_rung((*rung.model, candidate.tag), candidate.tag, candidate.composition, candidate.fit, material)
