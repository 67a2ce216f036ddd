"""The diagnosis: fit the base along the measured motion, try every effect, name one or say why not, add it, repeat."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ...data.campaign import Campaign
from ...data.checks import Finding
from ...data.segment import Segmentation, segment
from ...data.trace import Trace
from ...errors import InputError
from ...physics.effects import catalogue
from ...system.units import shown
from ..force.candidates import Candidate, every_form, from_end
from ..force.fit import Fit, deviations, fit, fit_base
from ..force.heldout import apart
from ..force.linearised import Array
from ..force.point import Point
from ..force.prescribed import applies
from ..force.problem import Problem
from ..force.residual import Structure, structures
from ..force.rig import EXACT, SPRING, slips_finding, spring_freed, within_knowledge
from ..force.signatures import Explained
from ..force.valleys import LEVEL, widened
from .checkpoints import Store, kept, name_of
from .confirm import Confirmation, Parts, confirm
from .decide import DISPERSION, Compared, Judge, Judged, as_well, best_forms, named, out_of_range
from .finals import Finals, alone, finalists
from .level import TAG, Level, level_of
from .prepare import FEWEST, Prepared, prepare
from .shape import Shape, shape_of, unshaped
from .trials import Tell, trials

SEVERAL = "unequal-contacts"  # means nothing where there is one
LEFT = 0.5  # of what named effects explain, from which what is left is no matter of a law's form any more
TAKEN_OUT = "detected, then removed: the resulting model predicts unseen runs no better"
BEST = 10  # effects of a round that are tried again beside the one that was named
STRUCTURED = 1e-6  # chance of the residual force being a function of some variable, below which something is missing
MEMBERS = 2  # of a set that are run freely besides the first


@dataclass(frozen=True)
class Round:
    """All effects on top of one model.

    Attributes:
        base: that model.
        judged: every form that was fitted.
        candidates: everything that was tried.
        close: what was named, and behind it what these data cannot tell from it.
        rival: the model with the spring's stiffness free in place of an effect, where the file states it.
    """

    base: Fit
    judged: tuple[Judged, ...]
    candidates: tuple[Candidate, ...]
    close: tuple[Judged, ...]
    rival: Compared | None = None

    @property
    def doubt(self) -> Compared | None:
        """The spring or mass other than stated, where no effect predicts unseen runs better than that."""
        rival = self.rival
        doubted = rival is not None and rival.seen and (not self.close or as_well(self.close[0], rival))
        return rival if doubted else None

    @property
    def beyond(self) -> Judged | None:
        """The effect that would have to be stronger than such effects are, where that keeps all from being named."""
        return None if self.close else out_of_range(self.judged)


@dataclass(frozen=True)
class Rung:
    """One model of the ladder.

    Attributes:
        model: tags of its parts. added: the last of them, None where the ladder begins.
        residual: of the force with all events alike, on the runs it was fitted to (N), shape (p,).
        unseen: the same of runs left out (:func:`..force.heldout.apart`); None for the static model, which has no fit
            of its own.
        fit: None for the static model.
        removed: an effect that is not needed any more with those that came after it.
    """

    model: tuple[str, ...]
    added: str | None
    residual: Array
    unseen: Array | None
    fit: Fit | None
    removed: str | None = None

    @classmethod
    def of(cls, model: tuple[str, ...], added: str | None, found: Fit, removed: str | None = None) -> Rung:
        """Of a fit."""
        return cls(model, added, found.marginal, apart(found), found, removed)


@dataclass(frozen=True)
class Verdict:
    """The answer: see :mod:`.summary` for the words.

    Attributes:
        kind: "complete", "missing", "ambiguous" or "unknown", and "fitted" where nothing was asked.
        effects, set: what was named, and what the data cannot tell from it.
        structure: of the residual force, where nothing explains it.
        misfit: phase in which the model is off by more than any law of friction should be, and by which share of the
            strength.
        beyond: the effect that explains the data best, but not with an amplitude that such effects have.
    """

    kind: str
    effects: tuple[str, ...] = ()
    set: tuple[str, ...] = ()
    structure: Structure | None = None
    misfit: tuple[str, float] | None = None
    beyond: Judged | None = None


@dataclass(frozen=True)
class Diagnosis:
    """Everything a report needs.

    Attributes:
        verdict, ladder, rounds: what was found, and how.
        named: effects of the last model, each with the round in which it was last told from others.
        prepared: the data.
        floor: of the force at every point: noise and scatter of the last model (N), shape (p,).
        shape: the backbone that the last model measured, and its laws.
        dropped: what was left out, and why.
        in_time: whether the time limit was not met.
        confirmation: the leading models run freely.
        wrong: what the motion contradicts of the rig as it is stated, so that no effect was tried.
        level: of the strength, which wanders under all models.
    """

    verdict: Verdict
    ladder: tuple[Rung, ...]
    rounds: tuple[Round, ...]
    named: Mapping[str, Round]
    prepared: Prepared
    floor: Array
    shape: Shape
    dropped: tuple[str, ...] = field(default=())
    in_time: bool = True
    confirmation: Confirmation = field(default_factory=Confirmation)
    wrong: tuple[Finding, ...] = ()
    level: Level | None = None

    @property
    def fit(self) -> Fit:
        """Of the last model."""
        last = self.ladder[-1].fit
        assert last is not None
        return last


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
    time_limit: float | None = None,
    wrong: Sequence[Finding] = (),
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """Find out what the base model lacks.

    Args:
        campaign, traces, segmentations: the measurement.
        candidates: tags to try; default the whole catalogue.
        max_effects: at most so many are added one after the other.
        holdout: runs to keep aside, besides those whose role in the campaign is "held-out".
        jobs: processes; default the number of cores.
        store: keeps finished pieces.
        time_limit: seconds after which the best answer so far is given.
        wrong: what the motion contradicts of the rig as it is stated: with any, the base is fitted and no effect tried.
        progress: told the stage and the share of it done.

    Raises:
        InputError: no run can take part, or the mass is not given.
        FitError: the base model gives no finite force.
    """
    began = time.monotonic()

    def in_time() -> bool:
        return time_limit is None or time.monotonic() - began < time_limit

    tell: Tell = progress or (lambda text, share: None)
    segmentations = [segment(t) for t in traces] if segmentations is None else segmentations
    tell("the measured force", 0.0)
    prepared = prepare(campaign, traces, segmentations, holdout)
    if prepared.problem.events < FEWEST:
        raise InputError(
            "the motion turns, stops or changes its speed less than twice, so no part of the record can be left "
            "out to test an effect",
            file=campaign.path,
            key=", ".join(f"trace '{t.name}' ({t.provenance.file})" for t in prepared.traces[:4]),
            hint="record it again: two loops, or a step up and down; stickslip fit takes it as it is",
        )
    dropped = list(prepared.dropped)
    tags = catalogue.tags() if candidates is None else [catalogue.get(t).tag for t in candidates]
    if candidates is not None:
        dropped += [f"{t}: not tried, because it is a random process" for t in tags if catalogue.get(t).drawn]
    if campaign.rig.contacts == 1 and SEVERAL in tags:
        tags.remove(SEVERAL)
        dropped.append(f"{SEVERAL}: not tried, for the rig has one contact")
    if prepared.prescribed:
        tags = [t for t in tags if applies(t)]
    tags = [t for t in tags if prepared.shows(catalogue.get(t))]
    jobs = (os.cpu_count() or 1) if jobs is None else jobs
    tell("fitting the base model", 0.5)
    base = kept(store, "base", prepared.problem, lambda: fit_base(prepared.problem, prepared.start))
    ladder = [
        Rung(("static",), None, static_residual(base), None, None),
        Rung.of(("static", "inertia"), "inertia", base),
    ]
    search = Search(base, ladder, jobs, tell, in_time, store)
    verdict: Verdict | None = None
    if wrong:  # an effect would be fitted to the wrong entry
        search.rounds.append(Round(base, (), (), ()))
        verdict = Verdict("unknown")
    while verdict is None:
        done = search.round([t for t in tags if t not in search.named and t not in search.gone])
        if done.doubt is not None and within_knowledge(done.base, done.doubt.fit) and in_time():
            dropped.append(search.free_spring(done.doubt.fit))
        elif done.doubt is not None:
            wrong = (*wrong, slips_finding(done.base, done.doubt.fit))
            tied = done.close and as_well(done.doubt, done.close[0])
            alike = tuple(j.tag for j in done.close) if tied else ()
            verdict = Verdict("ambiguous" if tied else "unknown", tuple(search.named), alike)
        elif not done.close or not in_time():
            verdict = _end(search.named, done)
        else:
            search.add(done)
            if len(search.named) >= max_effects:
                verdict = _end(search.named, Round(search.base, (), (), ()))
    if not search.named:
        search.base = kept(store, "wide", search.base.problem, lambda: widened(search.base, [LEVEL], DISPERSION))
        ladder[-1] = replace(ladder[-1], fit=search.base)
    floor = deviations(search.base)
    tell("the laws of the backbone", 1.0)
    shape = unshaped(search.base, campaign.rig) if prepared.prescribed else shape_of(search.base, campaign.rig, tags)
    level = None if wrong else level_of(search.base)
    verdict = verdict if wrong else with_shape(with_level(verdict, level), shape)
    complete = in_time()
    confirmed = confirm(leading(ladder, search.named), ladder[-1].model, prepared, store, tell, in_time)
    return Diagnosis(
        verdict, tuple(ladder), tuple(search.rounds), dict(search.named), prepared, floor, shape, tuple(dropped),
        complete, confirmed, tuple(wrong), level,
    )  # fmt: skip


class Search:
    """The model as it grows: effects added, and each tried again with those that came after it.

    Attributes:
        base: the model as it stands.
        ladder: its steps.
        rounds: all effects on top of each model.
        named: effects of the model, each with the round in which it was last told from others.
        gone: effects that were taken out again; they are not tried any more, so that the search ends.
    """

    _left: Round | None = None  # of a round whose effect was not kept, what else it tried
    _spring = ""  # what names the rounds once the spring is free

    def __init__(
        self, base: Fit, ladder: list[Rung], jobs: int, tell: Tell, in_time: Callable[[], bool], store: Store | None
    ) -> None:
        self.base, self.ladder = base, ladder
        self.rounds: list[Round] = []
        self.named: dict[str, Round] = {}
        self.gone: set[str] = set()
        self._jobs, self._tell, self._in_time, self._store = jobs, tell, in_time, store

    def round(self, tags: Sequence[str]) -> Round:
        """Every effect of these on top of the model."""
        if self._left is not None:
            done, self._left = self._left, None
            self.rounds[-1] = done
            return done
        name = f"round {len(self.rounds) + 1}{self._spring}"
        done = self._tried(self.base, tags, name)
        self.rounds.append(done)
        return done

    def free_spring(self, freed: Fit) -> str:
        """Begin the last round anew with another spring than stated, where that is as near as springs are known."""
        self.rounds.pop()
        stated, self._spring = self.base.values[SPRING], " with its own spring"
        self.base = kept(
            self._store, f"round{len(self.rounds) + 1}-spring", freed.problem,
            lambda: fit(freed.problem, freed.point, freed.scatter.unbound(), first=True),
        )  # fmt: skip
        last = self.ladder[-1]
        self.ladder[-1] = Rung.of(last.model, last.added, self.base, last.removed)
        return (
            f"spring: {shown(self.base.values[SPRING], 'N/m', 4)} as the slips want, not {shown(stated, 'N/m', 4)} as "
            f"stated: springs are not known better than to {100 * EXACT:g} %"
        )

    def add(self, done: Round) -> None:
        """Take up what a round named, and try again each effect named before.

        All that is undone where unseen runs lose by it: an effect is named on top of another one, and may foretell less
        once it has displaced that one.
        """
        tag, key = done.close[0].tag, f"round{len(self.rounds)}"
        before = self.base, self.ladder[:], dict(self.named), set(self.gone)
        self._tell(f"round {len(self.rounds)}: the model with {tag}", 1.0)
        self._take(settled(done.base, done.close[0].candidate, self._store, key), tag, None)
        self.named[tag] = done
        for earlier in list(self.named)[:-1]:
            if self._in_time():
                self._again(earlier, tag)
        if not foretells(before[0], self.base):
            self.base, self.ladder[:], self.named, gone = before
            self.gone = {*gone, tag}
            judged = tuple(j for j in done.judged if j.tag != tag)
            tried = tuple(replace(c, note=TAKEN_OUT) if c.tag == tag else c for c in done.candidates)
            self._left = Round(done.base, judged, tried, tuple(named(judged)), done.rival)

    def _again(self, tag: str, added: str) -> None:
        """An effect tried once more, beside the best of its own round, with all others in the model."""
        name = f"again {tag} with {added} in round {len(self.rounds)}"
        key = name.replace(" ", "-")
        problem, _ = _taken_out(self.base, tag)
        apart = kept(self._store, f"{key}-without", problem, lambda: without(self.base, tag))
        seen = sorted((j for j in best_forms(self.named[tag].judged) if j.seen), key=lambda j: -j.better)
        tags = [j.tag for j in seen if j.tag == tag or j.tag not in {*self.named, *self.gone}][:BEST]
        done = self._tried(apart, tags, name, self.base)
        if not done.close:
            del self.named[tag]
            self._take(apart, None, tag)
        elif done.close[0].tag == tag:
            self.named[tag] = done
        else:
            other = done.close[0].tag
            self._take(settled(apart, done.close[0].candidate, self._store, key), other, tag)
            self.named = {other if t == tag else t: done if t == tag else r for t, r in self.named.items()}

    def _tried(self, base: Fit, tags: Sequence[str], name: str, before: Fit | None = None) -> Round:
        key, tell = name.replace(" ", ""), partial(_told, self._tell, name)
        return one_round(base, tags, self._jobs, tell, self._in_time, self._store, key, before)

    def _take(self, base: Fit, added: str | None, removed: str | None) -> None:
        self.base = base
        self.gone |= {removed} if removed else set()
        model = [t for t in self.ladder[-1].model if t != removed]
        self.ladder.append(Rung.of((*model, *([added] if added else [])), added, base, removed))


def foretells(before: Fit, after: Fit) -> bool:
    """Whether a model predicts unseen runs better than another.

    By their likelihood alone: where the model undoes a sensor the measured forces are others, and so are their errors.
    """
    return Judge(before, 1).beside(after, 1, own=bool(after.problem.composition.phases)).better > 0.0


def without(base: Fit, tag: str) -> Fit:
    """The model without one of its effects, fitted anew with what is random."""
    problem, point = _taken_out(base, tag)
    return fit(problem, point, base.scatter.unbound(), first=True)


def _taken_out(base: Fit, tag: str) -> tuple[Problem, Point]:
    composition, point = base.problem.composition, base.point
    own = f"{tag}."
    keep = [not f.name.startswith(own) for f in composition.shared]
    turns = [not f.name.startswith(own) for f in composition.phases]
    problem = base.problem.with_composition(composition.without(tag))
    return problem, replace(point, z=point.z[keep], phases=point.phases[turns])


def leading(ladder: Sequence[Rung], named: Mapping[str, Round]) -> dict[Parts, Fit]:
    """The models that are run freely: base and last of the ladder, and what the data cannot tell from an effect."""
    fits = [(r.model, r.fit) for r in (ladder[1], ladder[-1])]
    for done in named.values():
        parts = (*ladder[1].model, *(e.tag for e in done.base.problem.composition.effects))
        fits += [((*parts, j.tag), j.candidate.fit) for j in done.close[1 : 1 + MEMBERS]]
    return {parts: fit for parts, fit in fits if fit is not None}


def _told(tell: Tell, name: str, text: str, share: float) -> None:
    tell(f"{name}: {text}", share)


def one_round(
    base: Fit,
    tags: Sequence[str],
    jobs: int,
    tell: Tell,
    in_time: Callable[[], bool],
    store: Store | None = None,
    name: str = "round",
    before: Fit | None = None,
) -> Round:
    """Every effect on top of one model, and which of them is to be named; one was taken out of the model ``before``."""
    tried = trials(base, tags, jobs, tell, in_time, store, name)
    if before is not None:
        out = {e.tag for e in before.problem.composition.effects} - {e.tag for e in base.problem.composition.effects}
        tried = [from_end(base, c, before) if c.tag in out else c for c in tried]
    number = max(len(every_form(tags)), 1)
    judge = Judge(base, number)
    judged = tuple(j for j in map(judge, tried) if j is not None)
    freed = spring_freed(base)
    best = [j.candidate for j in finalists(judged)]
    if len(best) > 1 and in_time():
        tell("refitting the best effects", 1.0)
        finals = Finals.of(base, best, store, name)
        judge = Judge(finals.base, number)
        again = {c.tag for c in finals.ends}
        judged = (*(j for j in map(judge, finals.ends) if j is not None), *(j for j in judged if j.tag not in again))
        freed = None if freed is None else finals.on_the_same(freed)
    rival = None if freed is None else judge.beside(freed, 1)
    return Round(base, judged, tuple(tried), tuple(named(judged)), rival)


def settled(base: Fit, candidate: Candidate, store: Store | None = None, name: str = "round") -> Fit:
    """The model with an effect, fitted as the base was, and the deviations of its effects' amplitudes.

    What lies far off is found anew too: outliers of a model that lacks an effect are others than those of one that has
    it.
    """
    found = candidate.fit
    assert found is not None
    key = f"{name}-settled-{name_of(candidate.tag, candidate.form)}"
    amplitudes = [f.name for f in found.free if f.amplitude]
    return kept(
        store, key, found.problem,
        lambda: widened(alone(base, candidate, store, name), amplitudes, DISPERSION),
    )  # fmt: skip


def _end(named: Mapping[str, Round], last: Round) -> Verdict:
    """Nothing more is seen: what that means."""
    taken, sets = tuple(named), [r.close for r in named.values() if len(r.close) > 1]
    alike = tuple(dict.fromkeys(j.tag for c in sets for j in c))
    structure = None
    found = structures(last.base, Explained(last.base), DISPERSION)
    explained = sum(r.close[0].gain for r in named.values())
    if found and found[0].chance < STRUCTURED and found[0].fall > LEFT * explained and not last.close:
        structure = found[0]
    if structure is not None or last.beyond is not None:
        return Verdict("unknown", taken, alike, structure, beyond=last.beyond)
    misfit = max(last.base.scatter.unexpected().items(), key=lambda phase: phase[1], default=None)
    if misfit is not None and not last.close:
        return Verdict("unknown", taken, alike, misfit=misfit)
    if sets:
        return Verdict("ambiguous", taken, tuple(dict.fromkeys([*taken, *alike])))
    return Verdict("missing" if taken else "complete", taken, taken)


def with_level(verdict: Verdict, level: Level | None) -> Verdict:
    """The answer with a level of friction that wanders, on top of which all else was found.

    It has no name where something else is missing that has none: the level may stand for that.
    """
    if level is None or verdict.kind == "unknown":
        return verdict
    effects = (TAG, *verdict.effects)
    if verdict.kind in ("complete", "missing"):
        return replace(verdict, kind="missing", effects=effects, set=effects)
    return replace(verdict, effects=effects)


def with_shape(verdict: Verdict, shape: Shape) -> Verdict:
    """The answer with what the backbone names: one effect more that is missing, alone or in a set."""
    tags = tuple(law.tag for law in shape.close)
    if not tags:
        return verdict
    kind = {"complete": "missing"}.get(verdict.kind, verdict.kind)
    if kind == "missing" and len(tags) > 1:
        kind = "ambiguous"
    effects = (*verdict.effects, tags[0])
    return replace(verdict, kind=kind, effects=effects, set=tuple(dict.fromkeys([*verdict.set, *tags])))


def static_residual(base: Fit) -> Array:
    """Residual force of the paper's static model: the same backbone, no weakening and no inertia (N), shape (p,)."""
    problem = base.problem
    composition = replace(problem.composition, mass=1e-12)
    names = [f.name for f in composition.shared]
    z = base.point.z.copy()
    for name in ("weakening.drop", "rig.damping"):
        free = composition.shared[names.index(name)]
        z[names.index(name)] = free.inward(free.lower)
    point = replace(base.point, z=z, events=np.zeros_like(base.point.events))
    return problem.with_composition(composition).evaluate(point).residual
