"""All candidates on top of a model, in stages: few steps for all, more for the better half, the end for the best."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from cloudpickle import dumps, loads
from joblib import Parallel, delayed

from ..effects import catalogue
from ..effects.base import Effect
from ..features.measurement import Measurement
from ..fit.composition import Composition
from ..fit.inertial import Fit
from ..lifeline import end_with
from .candidate import Candidate, forms_of
from .pieces import candidate_arrays, candidate_from
from .refit import FEW, MORE, afar, refine, settle
from .search import score
from .thresholds import THRESHOLDS, Thresholds
from .verdict import grade

PROMISING, EXPLAINING = 7, 3  # candidates that are refitted: by the best point seen, and by the linear score
LEAST = 4  # of those that get more than the first steps
NEAR = 1.3  # times the leader's cost: candidates that the data may not tell from it are followed to the end
WORTH = 0.9  # times the base's cost: a leader below it may get a name, and is compared with all it may be taken for
LEADERS = 5
FOLLOWED = 0.95  # times the base's cost: a leader below it is followed by way of wide floors
LIKE = 2  # of those a leader may be taken for that are followed to the end, however far from it they seem
FORMS = 2  # of each of these: its most promising ones
SWEPT = 0.93  # share of a round that is done then, before the model is fitted again and what may get a name compared


class Store(Protocol):
    """Where finished pieces are kept, so that an interrupted diagnosis goes on."""

    def load(self, key: str) -> Mapping[str, np.ndarray] | None:
        """A finished piece, or None."""

    def save(self, key: str, piece: Mapping[str, np.ndarray]) -> None:
        """Keep a finished piece."""


class Ground(NamedTuple):
    """What all candidates of a sweep are tried on: the model they are added to, its fit, the measurement, its floors,
    and the cycles that may be fitted."""

    composition: Composition
    optimum: Fit
    data: Measurement
    floor: np.ndarray
    train: np.ndarray


Job = tuple[Callable[..., Candidate], tuple[Any, ...]]


@dataclass(frozen=True)
class Sweep:
    """One round over all candidates.

    Attributes:
        ground: what they are tried on.
        jobs: parallel processes.
        store: keeps finished pieces.
        name: of this sweep in the store.
        tell: told the stage and the share of the sweep done.
        limits: of what counts as described.
    """

    ground: Ground
    jobs: int
    store: Store | None
    name: str
    tell: Callable[[str, float], None]
    limits: Thresholds = THRESHOLDS

    def run(self, tags: Sequence[str]) -> tuple[list[Candidate], list[Candidate]]:
        """Every tag's candidate in its best form, in the order of ``tags``; and everything that was fitted."""
        scored = self._score([form for tag in tags for form in forms_of(tag)], 0.0, 0.38)
        firsts = _firsts(sorted(scored, key=lambda c: -c.promise))  # each tag in the form that promises most
        promising = firsts[:PROMISING]
        explaining = _firsts(sorted(scored, key=lambda c: -c.score))[:EXPLAINING]
        promising += [c for c in explaining if c.tag not in {p.tag for p in promising}]
        begun = self._refine(promising, FEW, "few", 0.38, 0.43)
        few = sorted(begun, key=lambda c: c.cost)
        if not any(c.cost < WORTH * self.ground.optimum.cost for c in few):
            # then promises told nothing: few steps for all others, of which the best take the places of the worst
            others = [c for c in firsts if c.tag not in {p.tag for p in promising}]
            begun += self._refine(others, FEW, "few", 0.43, 0.46)
            few = sorted(begun, key=lambda c: c.cost)[: len(few)]
        half = few[: max(LEAST, len(few) // 2)]
        half += [c for c in few[len(half) :] if c.cost < NEAR * few[0].cost]
        leading = {c.tag for c in half[:LEAST]}
        followed = {_word(c.effect) for c in half}
        forms = [c for c in scored if c.tag in leading and _word(c.effect) not in followed]
        more = self._refine([*half, *forms], MORE, "more", 0.46, 0.49)
        leader = min(more, key=lambda c: c.cost, default=None)
        if leader is not None and leader.cost < WORTH * self.ground.optimum.cost:
            # what it may be taken for deserves the same, whatever its own score promised
            known = {_word(c.effect) for c in more}
            like = [c for c in _taken_for(leader, scored) if _word(c.effect) not in known]
            more += self._refine(self._refine(like, FEW, "like", 0.49, 0.51), MORE, "like more", 0.51, 0.53)
        best = min((c.cost for c in more), default=np.inf)
        ranked = sorted(more, key=lambda c: c.cost)
        near = [c for c in ranked if c.cost < NEAR * best][:LEADERS]
        if near and best < WORTH * self.ground.optimum.cost:
            taken_for = _like(near[0].effect) - {c.tag for c in near}
            for first in _firsts([c for c in ranked if c.tag in taken_for])[:LIKE]:
                near += [c for c in ranked if c.tag == first.tag and c.cost < NEAR * first.cost][:FORMS]
        most = self._settle(near, "settle", 0.53, 0.6)
        every = _latest(*scored, *begun, *more, *most)
        if not any(self._described(c) for c in most):
            every = self._afar(tags, every)
        self.tell(f"{self.name}: {len(tags)} effects tried", SWEPT)
        return best_forms(tags, every), every

    def _described(self, candidate: Candidate) -> bool:
        """Whether little is left with it (see `grade`)."""
        return candidate.train is not None and grade(candidate.train, candidate.held, self.limits) < 2

    def _afar(self, tags: Sequence[str], every: Sequence[Candidate]) -> list[Candidate]:
        """Everything fitted, after what leads nowhere from near an amplitude of zero was begun far from there."""
        g = self.ground
        followed = FOLLOWED * g.optimum.cost
        far = [c for c in best_forms(tags, every) if c.fit is not None and not (c.settled and c.cost < followed)]
        work = {f"{self.name}-afar-{_word(c.effect)}": (afar, (c, g.optimum, g.data, g.floor, g.train)) for c in far}
        every = _latest(*every, *self._all(work, "from afar", 0.6, 0.88))
        ranked = sorted((c for c in every if not c.note), key=lambda c: c.cost)
        near = [c for c in ranked if c.cost < NEAR * ranked[0].cost and c.cost < followed][:LEADERS]
        return _latest(*every, *self._settle([c for c in near if not c.settled], "afar settle", 0.88, SWEPT))

    def rivals(self, named: Candidate, every: Sequence[Candidate]) -> list[Candidate]:
        """Everything that was fitted, after what is about to be named, and what that may be taken for, got what the
        cheapest of all got in :meth:`run`: each was refitted, and those near it were followed to the end."""
        like = _taken_for(named, every)
        begun = [c for c in like if c.note]
        begun = self._refine(self._refine(begun, FEW, "rivals", SWEPT, 0.95), MORE, "rivals more", 0.95, 0.97)
        every = _latest(*every, *begun)
        words = {_word(c.effect) for c in (named, *like)}
        near = [c for c in every if _word(c.effect) in words and not c.note and c.cost < NEAR * named.cost]
        return _latest(*every, *self._settle([c for c in near if not c.settled], "rivals settle", 0.97, 1.0))

    def _score(self, effects: Sequence[Effect], low: float, high: float) -> list[Candidate]:
        g = self.ground
        work = {
            f"{self.name}-score-{_word(e)}": (score, (e, g.composition, g.optimum, g.data, g.floor, g.train))
            for e in effects
        }
        return self._all(work, "scores", low, high)

    def _refine(self, found: Sequence[Candidate], most: int, stage: str, low: float, high: float) -> list[Candidate]:
        g = self.ground
        work = {
            f"{self.name}-{stage}-{_word(c.effect)}": (refine, (c, g.data, g.floor, g.train, most))
            for c in found
            if c.fit is not None
        }
        return self._all(work, f"{stage} steps", low, high)

    def _settle(self, found: Sequence[Candidate], stage: str, low: float, high: float) -> list[Candidate]:
        g = self.ground
        worth = FOLLOWED * g.optimum.cost
        work = {f"{self.name}-{stage}-{_word(c.effect)}": (settle, (c, g.data, g.floor, g.train, worth)) for c in found}
        return self._all(work, "to the end", low, high)

    def _all(self, work: Mapping[str, Job], stage: str, low: float, high: float) -> list[Candidate]:
        """Do what is not in the store yet."""
        g = self.ground
        done: dict[str, Candidate] = {}
        for key in work:
            kept = self.store.load(key) if self.store is not None else None
            if kept is not None:
                done[key] = candidate_from(kept, g.composition, g.data, g.floor, g.train)
        for key, candidate in self._results({key: job for key, job in work.items() if key not in done}):
            done[key] = candidate
            if self.store is not None:
                self.store.save(key, candidate_arrays(candidate))
            self.tell(f"{self.name}, {stage}: {candidate.tag}", low + (high - low) * len(done) / len(work))
        return [done[key] for key in work]

    def _results(self, work: Mapping[str, Job]) -> Iterable[tuple[str, Candidate]]:
        if self.jobs == 1 or len(work) < 2:
            for key, (function, args) in work.items():
                yield key, function(*args)
            return
        files = tuple(sorted(str(module.__file__) for module in catalogue.user_modules()))
        with warnings.catch_warnings():
            # a worker whose memory grew with what it compiled is replaced by a new one
            warnings.filterwarnings("ignore", message="A worker stopped while some jobs")
            pool = Parallel(n_jobs=self.jobs, return_as="generator_unordered", batch_size=1)
            yield from pool(delayed(_named)(key, dumps(job), files, os.getpid()) for key, job in work.items())


def best_forms(tags: Sequence[str], every: Sequence[Candidate]) -> list[Candidate]:
    """Every tag's candidate in its best form: refitted ones first, by cost."""
    return [min((c for c in every if c.tag == tag), key=_rank) for tag in tags]


def _latest(*found: Candidate) -> list[Candidate]:
    """The last result of every form; one that failed does not take the place of one that did not."""
    out: dict[str, Candidate] = {}
    for candidate in found:
        word = _word(candidate.effect)
        if word not in out or not candidate.note or out[word].note:
            out[word] = candidate
    return list(out.values())


def _firsts(ranked: Sequence[Candidate]) -> list[Candidate]:
    """The first of every tag."""
    found: dict[str, Candidate] = {}
    for candidate in ranked:
        found.setdefault(candidate.tag, candidate)
    return list(found.values())


def _like(effect: Effect) -> set[str]:
    """Tags that an effect is confused with, and those whose law contains its own."""
    wider = {tag for tag, cls in catalogue.all().items() if effect.tag in cls.generalises}
    return wider | set(catalogue.alike(effect.tag))


def _taken_for(leader: Candidate, found: Sequence[Candidate]) -> list[Candidate]:
    """What an effect may be taken for, in its most promising forms."""
    promised = sorted(found, key=lambda c: -c.promise)
    return [c for tag in sorted(_like(leader.effect)) for c in [c for c in promised if c.tag == tag][:FORMS]]


def _named(key: str, job: bytes, files: tuple[str, ...], parent: int) -> tuple[str, Candidate]:
    """Do a job in a worker, which loads the user's files first: a class that were itself pickled would be no pytree."""
    end_with(parent)
    known = {getattr(module, "__file__", None) for module in catalogue.user_modules()}
    for path in files:
        if path not in known:
            catalogue.load_file(path)
    function, args = loads(job)
    return key, function(*args)


def _word(effect: Effect) -> str:
    """Tag and form, for a file's name."""
    return "-".join([effect.tag, *(str(v) for v in vars(effect).values() if isinstance(v, str))])


def _rank(candidate: Candidate) -> tuple[bool, float]:
    """Refitted ones first, by cost."""
    return bool(candidate.note), candidate.cost
