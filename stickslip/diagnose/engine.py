"""The diagnosis: fit the base along the measured motion, try every effect, name one or say why not, add it, repeat."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..campaign import Campaign
from ..checks import Finding
from ..effects import catalogue
from ..force.candidates import Candidate, every_form
from ..force.fit import Array, Fit, deviations, fit
from ..force.heldout import unseen
from ..force.residual import Structure, structures
from ..force.rig import slips_finding, spring_freed
from ..force.score import Explained
from ..segment import Segmentation, segment
from ..trace import Trace
from .confirm import Confirmation, Parts, confirm
from .decide import DISPERSION, Compared, Judge, Judged, as_well, named
from .pieces import Store, kept, name_of
from .prepare import Prepared, prepare
from .trials import Tell, trials

SEVERAL = "unequal-contacts"  # means nothing where there is one
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


@dataclass(frozen=True)
class Rung:
    """One model of the ladder.

    Attributes:
        model: tags of its parts. added: the last of them, None where the ladder begins.
        residual: of the force with all events alike, on the runs it was fitted to (N), shape (p,).
        unseen: the same of runs left out; None for the static model, which has no fit of its own.
        fit: None for the static model.
    """

    model: tuple[str, ...]
    added: str | None
    residual: Array
    unseen: Array | None
    fit: Fit | None


@dataclass(frozen=True)
class Verdict:
    """The answer: see :mod:`.summary` for the words."""

    kind: str
    effects: tuple[str, ...] = ()
    set: tuple[str, ...] = ()
    structure: Structure | None = None


@dataclass(frozen=True)
class Diagnosis:
    """Everything a report needs.

    Attributes:
        verdict, ladder, rounds: what was found, and how.
        prepared: the data.
        floor: of the force at every point: noise and scatter of the last model (N), shape (p,).
        dropped: what was left out, and why.
        in_time: whether the time limit was not met.
        confirmation: the leading models run freely.
        wrong: what the motion contradicts of the rig as it is stated, so that no effect was tried.
    """

    verdict: Verdict
    ladder: tuple[Rung, ...]
    rounds: tuple[Round, ...]
    prepared: Prepared
    floor: Array
    dropped: tuple[str, ...] = field(default=())
    in_time: bool = True
    confirmation: Confirmation = field(default_factory=Confirmation)
    wrong: tuple[Finding, ...] = ()

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
    dropped = list(prepared.dropped)
    tags = catalogue.tags() if candidates is None else [catalogue.get(t).tag for t in candidates]
    if campaign.rig.contacts == 1 and SEVERAL in tags:
        tags.remove(SEVERAL)
        dropped.append(f"{SEVERAL}: not tried, for the rig has one contact")
    jobs = (os.cpu_count() or 1) if jobs is None else jobs
    tell("fitting the base model", 0.5)
    base = kept(store, "base", prepared.problem, lambda: fit(prepared.problem, prepared.start))
    ladder = [Rung(("static",), None, static_residual(base), None, None), _rung(("static", "inertia"), "inertia", base)]
    rounds: list[Round] = []
    verdict: Verdict | None = None
    if wrong:  # an effect would be fitted to the wrong entry
        rounds.append(Round(base, (), (), ()))
        verdict = Verdict("unknown")
    while verdict is None:
        taken = [r.close[0].tag for r in rounds if r.close]
        left = [t for t in tags if t not in taken]
        name = f"round {len(rounds) + 1}"
        key = name.replace(" ", "")
        done = one_round(base, left, jobs, partial(_told, tell, name), in_time, store, key)
        rounds.append(done)
        if done.doubt is not None:
            wrong = (*wrong, slips_finding(base, done.doubt.fit))
            tied = done.close and as_well(done.doubt, done.close[0])
            verdict = Verdict(
                "ambiguous" if tied else "unknown", tuple(taken), tuple(j.tag for j in done.close) if tied else ()
            )
            break
        if not done.close or not in_time():
            verdict = _end(taken, done, rounds)
            break
        tell(f"{name}: the model with {done.close[0].tag}", 1.0)
        base = settled(base, done.close[0].candidate, store, key)
        ladder.append(_rung((*ladder[-1].model, done.close[0].tag), done.close[0].tag, base))
        if len(taken) + 1 >= max_effects:
            verdict = _end([*taken, done.close[0].tag], replace(done, base=base, close=()), rounds)
    floor = deviations(base)
    complete = in_time()
    confirmed = confirm(leading(ladder, rounds), ladder[-1].model, prepared, store, tell, in_time)
    return Diagnosis(
        verdict, tuple(ladder), tuple(rounds), prepared, floor, tuple(dropped), complete, confirmed, tuple(wrong)
    )  # fmt: skip


def leading(ladder: Sequence[Rung], rounds: Sequence[Round]) -> dict[Parts, Fit]:
    """The models that are run freely: base and last of the ladder, and what the data cannot tell from an effect."""
    fits = [(r.model, r.fit) for r in (ladder[1], ladder[-1])]
    for rung, done in zip(ladder[1:], rounds, strict=False):
        fits += [((*rung.model, j.tag), j.candidate.fit) for j in done.close[1 : 1 + MEMBERS]]
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
) -> Round:
    """Every effect on top of one model, and which of them is to be named."""
    tried = trials(base, tags, jobs, tell, in_time, store, name)
    judge = Judge(base, max(len(every_form(tags)), 1))
    judged = tuple(j for j in map(judge, tried) if j is not None)
    freed = spring_freed(base)
    rival = None if freed is None else judge.beside(freed, 1)
    return Round(base, judged, tuple(tried), tuple(named(judged)), rival)


def settled(base: Fit, candidate: Candidate, store: Store | None = None, name: str = "round") -> Fit:
    """The model with an effect, what is random estimated anew."""
    found = candidate.fit
    assert found is not None
    key = f"{name}-settled-{name_of(candidate.tag, candidate.form)}"
    return kept(
        store, key, found.problem,
        lambda: fit(found.problem, found.point, found.scatter, dropped=base.dropped, first=True),
    )  # fmt: skip


def _end(taken: Sequence[str], last: Round, rounds: Sequence[Round]) -> Verdict:
    """Nothing more is seen: what that means."""
    sets = [r.close for r in rounds if len(r.close) > 1]
    structure = None
    found = structures(last.base, Explained(last.base), DISPERSION)
    if found and found[0].chance < STRUCTURED and not last.close:
        structure = found[0]
    if structure is not None:
        return Verdict("unknown", tuple(taken), tuple(dict.fromkeys(j.tag for c in sets for j in c)), structure)
    if sets:
        every = tuple(dict.fromkeys([*taken, *(j.tag for c in sets for j in c)]))
        return Verdict("ambiguous", tuple(taken), every)
    return Verdict("missing" if taken else "complete", tuple(taken), tuple(taken))


def _rung(model: tuple[str, ...], added: str, found: Fit) -> Rung:
    return Rung(model, added, found.marginal, unseen(found).residual, found)


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
