"""One round of a diagnosis: every effect on top of one model, and which of them is to be named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..force.candidates import Candidate, every_form, from_end
from ..force.fit import Fit
from ..force.stated_spring import spring_freed
from .decide import Compared, Judge, Judged, as_well, held_back, named
from .final_comparison import Finals, finalists
from .parallel_refits import trials
from .work import Work


@dataclass(frozen=True)
class Round:
    """All effects on top of one model.

    Attributes:
        base: that model.
        judged: every form that was fitted.
        candidates: everything that was tried.
        close: what was named, and behind it what these data cannot distinguish from it.
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
        return None if self.close else held_back(self.judged)


def one_round(base: Fit, tags: Sequence[str], work: Work, name: str = "round", before: Fit | None = None) -> Round:
    """Every effect on top of one model, and which of them is to be named; one was taken out of the model ``before``."""
    tried = trials(base, tags, work, name)
    if before is not None:
        out = {e.tag for e in before.problem.composition.effects} - {e.tag for e in base.problem.composition.effects}
        tried = [from_end(base, c, before) if c.tag in out else c for c in tried]
    number = max(len(every_form(tags)), 1)
    judge = Judge(base, number)
    judged = tuple(j for j in map(judge, tried) if j is not None)
    freed = spring_freed(base)
    best = [j.candidate for j in finalists(judged)]
    if len(best) > 1 and work.in_time():
        work.tell("refitting the best effects", 1.0)
        finals = Finals.of(base, best, work.store, name)
        judge = Judge(finals.base, number)
        again = {c.tag for c in finals.ends}
        judged = (*(j for j in map(judge, finals.ends) if j is not None), *(j for j in judged if j.tag not in again))
        freed = None if freed is None else finals.on_the_same(freed)
    rival = None if freed is None else judge.beside(freed, 1)
    return Round(base, judged, tuple(tried), tuple(named(judged)), rival)
