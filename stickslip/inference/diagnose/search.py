"""The model as it grows: an effect is added, and each one named before is tried again with those that came after it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

from ...physics.effects import catalogue
from ...system.progress import Tell
from ...system.units import shown
from ..force.fit import Fit, fit
from ..force.heldout import heldout_residual
from ..force.linearised import Array
from ..force.point import Point
from ..force.problem import Problem
from ..force.stated_spring import EXACT, SPRING
from .checkpoints import kept
from .decide import Judge, Judged, best_forms, inside, named
from .final_comparison import settled
from .search_round import Round, one_round
from .work import Work

TAKEN_OUT = "detected, then removed: the resulting model predicts unseen runs no better"
BEST = 10  # effects of a round that are tried again beside the one that was named


@dataclass(frozen=True)
class Rung:
    """One model of the ladder.

    Attributes:
        model: tags of its parts. added: the last of them, None where the ladder begins.
        residual: of the force with all events equal, on the runs it was fitted to (N), shape (p,).
        unseen: the same of runs left out (:func:`..force.heldout.heldout_residual`); None for the static model, which
            has no fit of its own.
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
        return cls(model, added, found.marginal, heldout_residual(found), found, removed)


class Search:
    """The model as it grows: effects added, and each tried again with those that came after it.

    Attributes:
        base: the model as it stands.
        ladder: its steps.
        rounds: all effects on top of each model.
        named: effects of the model, each with the round in which it was last distinguished from others.
        gone: effects that were taken out again; they are not tried any more, so that the search ends.
    """

    _left: Round | None = None  # of a round whose effect was not kept, what else it tried
    _spring = ""  # what names the rounds once the spring is free

    def __init__(self, base: Fit, ladder: list[Rung], work: Work) -> None:
        self.base, self.ladder, self._work = base, ladder, work
        self.rounds: list[Round] = []
        self.named: dict[str, Round] = {}
        self.gone: set[str] = set()

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
            self._work.store, f"round{len(self.rounds) + 1}-spring", freed.problem,
            lambda: fit(freed.problem, freed.point, freed.scatter.unbound(), first=True),
        )  # fmt: skip
        last = self.ladder[-1]
        self.ladder[-1] = Rung.of(last.model, last.added, self.base, last.removed)
        return (
            f"spring: {shown(self.base.values[SPRING], 'N/m', 4)} as the slips require, not {shown(stated, 'N/m', 4)} "
            f"as stated: springs are not known better than to {100 * EXACT:g} %"
        )

    def add(self, done: Round) -> None:
        """Take up what a round named, and try again each effect named before.

        What settles at a bound is not taken up: it is out of range as what is there from the beginning. All is undone
        where unseen runs lose by it, or an effect beside it is driven to its bound: an effect is named on top of
        another one, and may predict worse once it has displaced that one.
        """
        best, key = done.close[0], f"round{len(self.rounds)}"
        tag = best.tag
        before = self.base, self.ladder[:], dict(self.named), set(self.gone)
        self._work.tell(f"round {len(self.rounds)}: the model with {tag}", 1.0)
        found = ended(best, settled(done.base, best.candidate, self._work.store, key))
        if not found.inside:
            self._give_up(done, found)
            return
        self._take(found.fit, tag, None)
        self.named[tag] = done
        for earlier in list(self.named)[:-1]:
            if self._work.in_time():
                self._again(earlier, tag)
        if not (predicts_better(before[0], self.base) and in_range(self.base, self.named)):
            self.base, self.ladder[:], self.named, self.gone = before
            self._give_up(done)

    def _give_up(self, done: Round, found: Judged | None = None) -> None:
        """Leave out what a round named; with what it was ``found`` to be, or as if it had never been tried."""
        tag = done.close[0].tag
        self.gone.add(tag)
        judged = tuple(j for j in done.judged if j.tag != tag) + ((found,) if found else ())
        note = "" if found else TAKEN_OUT
        tried = tuple(replace(c, note=note) if c.tag == tag else c for c in done.candidates)
        self._left = Round(done.base, judged, tried, tuple(named(judged)), done.rival)

    def _again(self, tag: str, added: str) -> None:
        """An effect tried once more, beside the best of its own round, with all others in the model."""
        name = f"again {tag} with {added} in round {len(self.rounds)}"
        key = name.replace(" ", "-")
        problem, _ = _taken_out(self.base, tag)
        rest = kept(self._work.store, f"{key}-without", problem, lambda: without(self.base, tag))
        seen = sorted((j for j in best_forms(self.named[tag].judged) if j.seen), key=lambda j: -j.better)
        tags = [j.tag for j in seen if j.tag == tag or j.tag not in {*self.named, *self.gone}][:BEST]
        done = self._tried(rest, tags, name, self.base)
        if not done.close:
            del self.named[tag]
            self._take(rest, None, tag)
        elif done.close[0].tag == tag:
            self.named[tag] = done
        else:
            other = done.close[0].tag
            self._take(settled(rest, done.close[0].candidate, self._work.store, key), other, tag)
            self.named = {other if t == tag else t: done if t == tag else r for t, r in self.named.items()}

    def _tried(self, base: Fit, tags: Sequence[str], name: str, before: Fit | None = None) -> Round:
        work = replace(self._work, tell=partial(_told, self._work.tell, name))
        return one_round(base, tags, work, name.replace(" ", ""), before)

    def _take(self, base: Fit, added: str | None, removed: str | None) -> None:
        self.base = base
        self.gone |= {removed} if removed else set()
        model = [t for t in self.ladder[-1].model if t != removed]
        self.ladder.append(Rung.of((*model, *([added] if added else [])), added, base, removed))


def ended(judged: Judged, fit: Fit) -> Judged:
    """What was judged, as it is once it has settled, with a deviation as the others have: without its valleys."""
    name, straight = judged.candidate.name, replace(fit, valleys=())
    candidate = replace(judged.candidate, fit=fit)
    return replace(judged, fit=fit, candidate=candidate, amplitude=fit.values[name], std=straight.std()[name])


def in_range(fit: Fit, tags: Collection[str]) -> bool:
    """Whether the amplitudes of these effects of a model are off their bounds, with deviations as :func:`ended` has."""
    std = replace(fit, valleys=()).std()
    names = {tag: f"{tag}.{catalogue.get(tag).amplitude}" for tag in tags}
    return all(inside(tag, fit.values[name], std[name]) for tag, name in names.items())


def predicts_better(before: Fit, after: Fit) -> bool:
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


def _told(tell: Tell, name: str, text: str, share: float) -> None:
    tell(f"{name}: {text}", share)
