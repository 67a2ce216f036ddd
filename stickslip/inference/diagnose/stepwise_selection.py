"""The diagnosis: fit the base along the measured motion, try every effect, name one or say why not, add it, repeat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...data.campaign import Rig
from ...data.checks import Finding
from ...errors import InputError
from ...physics.effects import catalogue
from ..force.fit import Fit, deviations, fit_base
from ..force.linearised import Array
from ..force.prescribed import applies
from ..force.profile_deviations import LEVEL, widened
from ..force.residual import Structure, structures
from ..force.signatures import Explained
from ..force.stated_spring import slips_finding, within_knowledge
from .backbone_laws import Shape, shape_of, unshaped
from .checkpoints import kept
from .decide import DISPERSION, Judged, as_well
from .free_simulation import Confirmation, Parts, confirm
from .prepare import FEWEST, Prepared
from .search import Rung, Search
from .search_round import Round
from .wandering_level import TAG, Level, level_of
from .work import Work

SEVERAL = "unequal-contacts"  # means nothing where there is one
LEFT = 0.5  # of what named effects explain, from which what is left is no matter of a law's form any more
STRUCTURED = 1e-6  # chance of the residual force being a function of some variable, below which something is missing
MEMBERS = 2  # of a set that are run freely besides the first


@dataclass(frozen=True)
class Verdict:
    """The answer: see :mod:`.summary` for the words.

    Attributes:
        kind: "complete", "missing", "ambiguous" or "unknown", and "fitted" where nothing was asked.
        effects, set: what was named, and what the data cannot distinguish from it.
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
        named: effects of the last model, each with the round in which it was last distinguished from others.
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
    prepared: Prepared,
    rig: Rig,
    candidates: Sequence[str] | None = None,
    max_effects: int = 4,
    wrong: Sequence[Finding] = (),
    work: Work = Work(),
) -> Diagnosis:
    """Find out what the base model lacks.

    Args:
        prepared: the data.
        rig: as it is stated.
        candidates: tags to try; default the whole catalogue.
        max_effects: at most so many are added one after the other.
        wrong: what the motion contradicts of the rig: with any, the base is fitted and no effect tried.
        work: how.

    Raises:
        InputError: too few events to leave any out.
        FitError: the base model gives no finite force.
    """
    if prepared.problem.events < FEWEST:
        raise InputError(
            "the motion turns, stops or changes its speed less than twice, so no part of the record can be left "
            "out to test an effect",
            key=", ".join(f"trace '{t.name}' ({t.provenance.file})" for t in prepared.traces[:4]),
            hint="record it again: two loops, or a step up and down; stickslip fit accepts it as it is",
        )
    dropped = list(prepared.dropped)
    tags = catalogue.tags() if candidates is None else [catalogue.get(t).tag for t in candidates]
    if candidates is not None:
        dropped += [f"{t}: not tried, because it is a random process" for t in tags if catalogue.get(t).drawn]
    if rig.contacts == 1 and SEVERAL in tags:
        tags.remove(SEVERAL)
        dropped.append(f"{SEVERAL}: not tried, for the rig has one contact")
    if prepared.prescribed:
        tags = [t for t in tags if applies(t)]
    tags = [t for t in tags if prepared.shows(catalogue.get(t))]
    store, in_time = work.store, work.in_time
    work.tell("fitting the base model", 0.5)
    base = kept(store, "base", prepared.problem, lambda: fit_base(prepared.problem, prepared.start))
    ladder = [
        Rung(("static",), None, static_residual(base), None, None),
        Rung.of(("static", "inertia"), "inertia", base),
    ]
    search = Search(base, ladder, work)
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
            indistinguishable = tuple(j.tag for j in done.close) if tied else ()
            verdict = Verdict("ambiguous" if tied else "unknown", tuple(search.named), indistinguishable)
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
    work.tell("the laws of the backbone", 1.0)
    shape = unshaped(search.base, rig) if prepared.prescribed else shape_of(search.base, rig, tags)
    level = None if wrong else level_of(search.base)
    verdict = verdict if wrong else with_shape(with_level(verdict, level), shape)
    complete = in_time()
    confirmed = confirm(leading(ladder, search.named), ladder[-1].model, prepared, work)
    return Diagnosis(
        verdict, tuple(ladder), tuple(search.rounds), dict(search.named), prepared, floor, shape, tuple(dropped),
        complete, confirmed, tuple(wrong), level,
    )  # fmt: skip


def leading(ladder: Sequence[Rung], named: Mapping[str, Round]) -> dict[Parts, Fit]:
    """The models that are run freely: base and last of the ladder, and what the data cannot tell from an effect."""
    fits = [(r.model, r.fit) for r in (ladder[1], ladder[-1])]
    for done in named.values():
        parts = (*ladder[1].model, *(e.tag for e in done.base.problem.composition.effects))
        fits += [((*parts, j.tag), j.candidate.fit) for j in done.close[1 : 1 + MEMBERS]]
    return {parts: fit for parts, fit in fits if fit is not None}


def _end(named: Mapping[str, Round], last: Round) -> Verdict:
    """Nothing more is seen: what that means."""
    taken, sets = tuple(named), [r.close for r in named.values() if len(r.close) > 1]
    indistinguishable = tuple(dict.fromkeys(j.tag for c in sets for j in c))
    structure = None
    found = structures(last.base, Explained(last.base), DISPERSION)
    explained = sum(r.close[0].gain for r in named.values())
    if found and found[0].chance < STRUCTURED and found[0].fall > LEFT * explained and not last.close:
        structure = found[0]
    if structure is not None or last.beyond is not None:
        return Verdict("unknown", taken, indistinguishable, structure, beyond=last.beyond)
    misfit = max(last.base.scatter.unexpected().items(), key=lambda phase: phase[1], default=None)
    if misfit is not None and not last.close:
        return Verdict("unknown", taken, indistinguishable, misfit=misfit)
    if sets:
        return Verdict("ambiguous", taken, tuple(dict.fromkeys([*taken, *indistinguishable])))
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
