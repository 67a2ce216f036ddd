"""The last model looked at once more: which of its effects it can do without, and which others would do as well."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..fit.composition import Composition
from ..fit.inertial import fit
from ..fit.problem import Problem
from .begin import with_starts
from .candidate import Candidate
from .refit import MOST
from .rungs import Material, Rung, kept, make_rung
from .thresholds import Thresholds
from .verdict import NONE_MET, Judged, at_border, confidence, grade, worse

Tell = Callable[[str, float], None]  # told what is done, and the share of it
INSTEAD = ((2.5, 6), (1.0, MOST))  # stages of a fit with one effect in another's place


@dataclass(frozen=True)
class Named:
    """An effect that was added, and what it could not be told from when it was.

    Attributes:
        candidate: as it was fitted then.
        rivals: the others of the set.
        judged: all candidates of that round.
        fresh: whether nothing has been added or taken out since, so that the set still holds.
    """

    candidate: Candidate
    rivals: tuple[Candidate, ...]
    judged: tuple[Judged, ...]
    fresh: bool = False

    @property
    def tag(self) -> str:
        return self.candidate.tag

    @property
    def confidence(self) -> float:
        """How likely it, or one of the set, is what was missing in that round."""
        said = {self.tag, *(r.tag for r in self.rivals)}
        return confidence(self.judged, [j for j in self.judged if j.candidate.tag in said])


def done_without(
    ladder: list[Rung], named: list[Named], material: Material, limits: Thresholds, tell: Tell
) -> tuple[list[Rung], list[Named]]:
    """The ladder with a further rung for each effect that is no longer needed once the others are in, and what is left.

    One goes where the rest, fitted again, costs less than ``limits.rival`` times as much and meets the same limits, and
    where none are met, if the unseen cycles are not described worse.
    ``tell`` is told the work and the share of it done.
    """
    gone = True
    while gone and len(named) > 1:
        gone = False
        for i, one in enumerate(named):
            tell(f"trying to do without {one.tag}", i / len(named))
            left = [n for n in named if n is not one]
            rung = _less(ladder[-1], one.tag, [n.tag for n in left], material)
            top = ladder[-1]
            poorer = _grade(rung, limits) > _grade(top, limits) or (
                _grade(top, limits) == NONE_MET and worse(rung.held, top.held, limits)
            )
            if _cost(rung) < limits.rival * _cost(top) and not poorer:
                ladder, named, gone = [*ladder, rung], [replace(n, fresh=False) for n in left], True
                break
    return ladder, named


def told_apart(
    top: Rung, named: Sequence[Named], material: Material, limits: Thresholds, tell: Tell
) -> tuple[Rung, list[Named]]:
    """The last model, and its effects with the rivals that are left now that everything is in.

    Every rival is put in its effect's place and all is fitted again. It stays one where the costs are within
    ``limits.rival``, its parameters inside their ranges, the same limits met, and the unseen cycles not clearly worse;
    one that is better by that factor takes the place.
    """
    named = list(named)
    for i, one in enumerate(named):
        if not one.rivals or one.fresh:
            continue
        tell(f"trying others in the place of {one.tag}", i / len(named))
        inside = {n.tag for n in named}
        others = [_instead(top, one.tag, r, material) for r in one.rivals if r.tag not in inside]
        offers = [(one.candidate, top), *((c, rung) for c, rung in others if not at_border(c, limits))]
        offers = [(c, rung) for c, rung in offers if _grade(rung, limits) <= _grade(top, limits)]
        best = min(offers, key=lambda offer: _cost(offer[1]))
        if limits.rival * _cost(best[1]) >= _cost(top) or worse(best[1].held, top.held, limits):
            best = offers[0]
        alive = [
            c
            for c, rung in offers
            if c is not best[0]
            and _cost(rung) < limits.rival * _cost(best[1])
            and not worse(rung.held, best[1].held, limits)
        ]
        top = best[1]
        named[i] = replace(one, candidate=_fitted(best[0], top), rivals=tuple(alive))
    return top, named


def _less(top: Rung, tag: str, left: Sequence[str], material: Material) -> Rung:
    assert top.composition is not None
    assert top.fit is not None
    data, floor, train, store = material
    smaller, old = top.composition.without(tag), top.fit
    z = _without(top, tag, smaller, material)
    found = kept(
        store,
        # of what is in it, and what it was taken from: with other settings a piece may have come from other effects
        f"left-{'-'.join(left)}-of-{'-'.join(top.model[2:])}",
        lambda: fit(Problem(smaller, data), floor, z=z, events=old.events, stages=((1.0, MOST),), use=train),
    )
    return make_rung(("static", "inertia", *left), None, smaller, found, material, removed=tag)


def _without(
    top: Rung, tag: str, composition: Composition, material: Material, instead: np.ndarray | None = None
) -> np.ndarray:
    """Free parameters of the last model without an effect, and with those of another ``instead``: its runs begin so
    that the slips come when they do in the data."""
    assert top.fit is not None
    old, use = top.fit, material.train & np.asarray(material.data.cycles.used)
    left = [i for i, f in enumerate(old.free) if not f.name.startswith(f"{tag}.")]
    known, columns = [old.free[i] for i in left], old.columns[..., left]
    z = np.concatenate([old.z[left], () if instead is None else instead])
    problem = Problem(composition, material.data).seeing(use)
    return with_starts(problem, z, old.events, columns, known, material.data.values, use)


def _instead(top: Rung, tag: str, rival: Candidate, material: Material) -> tuple[Candidate, Rung]:
    """The last model with a rival in the place of the effect ``tag``."""
    assert top.composition is not None
    assert top.fit is not None
    assert rival.fit is not None
    data, floor, train, store = material
    old = top.fit
    own = [i for i, f in enumerate(rival.fit.free) if f.name.startswith(f"{rival.tag}.")]
    composition = top.composition.without(tag).with_effect(rival.effect, [rival.fit.free[i] for i in own])
    z = _without(top, tag, composition, material, rival.fit.z[own])
    model = tuple(rival.tag if t == tag else t for t in top.model)
    found = kept(
        store,
        f"instead-{'-'.join(model[2:])}",
        lambda: fit(Problem(composition, data), floor, z=z, events=old.events, stages=INSTEAD, use=train),
    )
    added = rival.tag if top.added == tag else top.added
    rung = make_rung(model, added, composition, found, material, top.removed)
    return _fitted(rival, rung), rung


def _fitted(candidate: Candidate, rung: Rung) -> Candidate:
    """The candidate as it is in a model."""
    return replace(candidate, composition=rung.composition, fit=rung.fit, train=rung.train, held=rung.held, others=())


def _cost(rung: Rung) -> float:
    assert rung.fit is not None
    return rung.fit.cost


def _grade(rung: Rung, limits: Thresholds) -> int:
    return grade(rung.train, rung.held, limits)
