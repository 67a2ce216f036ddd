"""From refitted effects to an answer, by few rules.

1. *Seen*: the fall of the cost is beyond what chance gives an effect with as many parameters, tried on as many
   members of its family, among as many effects; and the likelihood of unseen runs is better by more than 2.5 standard
   errors over their events. Parameters beyond where such values lie (``usual`` in the catalogue) have their price in
   it: the range is four standard deviations wide. The amplitude lies inside its bounds by more than its standard
   deviation: at one of them the law would have to be stronger than such laws are, and imitates another. And the error
   of unseen runs with all events equal does not rise by more than its standard error: a law may describe the forces
   within events better, and predict an event worse.
2. *Named*: the seen effect that predicts unseen runs best. It is kept if the model that it leads to, settled and
   without what it has made superfluous, still predicts them better than the one before, with all amplitudes inside
   their bounds.
3. *A set*: those seen that predict the unseen runs as well, within 2.5 standard errors of the difference. A law that
   contains another of the set leaves it, unless it gains more than its further parameters cost (Schwarz's criterion).
4. *A wrong entry*: a stiffness or mass of the rig other than stated is tried like an effect. Where it is seen and no
   effect predicts unseen runs better than it, nothing is named.
5. *Held back*: where an effect that only its bound, or only the error with all events equal, keeps from being seen
   predicts unseen runs better than all that are seen, nothing is named: what is missing acts like it, but is stronger
   than such effects are, or is not all that is missing.
6. *Unknown*: nothing more is seen, but an effect is held back; or the residual force is a function of a variable,
   and that would explain more than half of what the named effects do; or the misfit within events is larger than is
   expected of any law.
7. *Wandering friction* is named where the last model still needs a level that goes on between events
   (:mod:`.wandering_level`), and nothing is missing besides that has no name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtrc

from ...physics.effects import catalogue
from ..fit.parameters import Free
from ..force.candidates import Candidate
from ..force.fit import Fit, deviations
from ..force.heldout import Unseen, folds, halves, unseen
from ..force.linearised import Array

CHANCE = 1e-3  # of any effect at all being seen where nothing is missing
ERRORS = 2.5  # standard errors
DISPERSION = 2.0  # of the fall of the cost where nothing is hidden, over that of perfectly known covariances


@dataclass(frozen=True)
class Compared:
    """A refitted model beside the one that it adds something to.

    Attributes:
        fit: of it.
        gain: fall of the cost.
        chance: of such a fall by chance, corrected for all that was tried.
        unseen: fall of the predictive cost of every event left out, shape (E,).
        nearer: fall of the squares of its error with all events equal, in units of their expected ones, shape (E,).
    """

    fit: Fit
    gain: float
    chance: float
    unseen: Array
    nearer: Array

    @property
    def price(self) -> float:
        """Of improbable parameters, in units of the cost."""
        return 0.0

    @property
    def better(self) -> float:
        """By how much the unseen runs are predicted better, in units of the cost."""
        return float(self.unseen.sum()) - self.price

    @property
    def error(self) -> float:
        """Standard error of the sum of ``unseen``."""
        return standard_error(self.unseen)

    @property
    def no_farther(self) -> bool:
        """Whether the error of unseen runs does not rise by more than its standard error."""
        return float(self.nearer.sum()) >= -float(np.sqrt(self.nearer.size) * np.std(self.nearer))

    @property
    def likely(self) -> bool:
        """Whether the likelihood rises beyond chance, that of unseen runs as well."""
        return self.chance < CHANCE and self.better > ERRORS * self.error

    @property
    def seen(self) -> bool:
        """Rule 1."""
        return self.likely and self.no_farther


@dataclass(frozen=True)
class Judged(Compared):
    """A refitted effect beside the model without it.

    Attributes:
        candidate: what was tried.
        amplitude, std: in SI.
        odd: of each parameter of the effect that lies beyond where such values lie, by how many standard deviations
            of their range.
    """

    candidate: Candidate
    amplitude: float
    std: float
    odd: Mapping[str, float] = field(default_factory=dict)

    @property
    def tag(self) -> str:
        """Of the effect."""
        return self.candidate.tag

    @property
    def price(self) -> float:
        """Of parameters beyond where such values lie."""
        return _price(self.odd)

    @property
    def inside(self) -> bool:
        """Whether the amplitude lies in its range: see :func:`inside`."""
        return inside(self.tag, self.amplitude, self.std)

    @property
    def seen(self) -> bool:
        """Rule 1."""
        return super().seen and self.inside

    @property
    def held_back(self) -> bool:
        """Whether nothing but its bound, or nothing but the error with all events equal, keeps it from being seen."""
        return self.likely and self.inside != self.no_farther


def inside(tag: str, amplitude: float, std: float) -> bool:
    """Whether an effect's amplitude is off its bounds by more than its deviation; what stands at a bound has none."""
    spec = catalogue.amplitude(catalogue.get(tag))
    return 0.0 < std < min(amplitude - spec.lower, spec.upper - amplitude)


def odd(fit: Fit, tag: str) -> dict[str, float]:
    """Parameters of an effect beyond where such values lie: by how many quarters of that range."""
    out = {}
    for f, z in zip(fit.free, fit.point.z, strict=False):
        beyond = _beyond(f, float(z)) if f.name.startswith(f"{tag}.") else 0.0
        if beyond > 0.0:
            out[f.name] = beyond
    return out


def _beyond(f: Free, z: float) -> float:
    """By how many quarters of the range where its values lie a parameter is beyond that range."""
    if f.usual is None:
        return 0.0
    low, high = (f.inward(max(v, f.lower) if f.scale == "log" else v) for v in f.usual)
    return max(low - z, z - high, 0.0) / (0.25 * (high - low))


def price(f: Free, z: float) -> float:
    """Of a parameter beyond where such values lie, at ``z`` on the search scale, in units of the cost."""
    return _price({f.name: _beyond(f, z)})


def _price(far: Mapping[str, float]) -> float:
    """In units of the cost, whose falls count as so much less as they scatter more."""
    return DISPERSION * sum(d**2 for d in far.values())


class Judge:
    """The model without, and how it predicts what it has not seen."""

    def __init__(self, base: Fit, tried: int) -> None:
        self.base, self.tried = base, tried
        self._runs, self._halves = folds(base), halves(base)
        self._unseen = {False: unseen(base, self._runs), True: unseen(base, self._halves)}
        self._floor = deviations(base)

    def __call__(self, candidate: Candidate) -> Judged | None:
        """The candidate beside it; None where it was not fitted."""
        if candidate.fit is None:
            return None
        fit = copy(candidate.fit)  # what is large and found for it goes with the copy
        own = [f for f in fit.problem.composition.phases if f.name.startswith(f"{candidate.tag}.")]
        free = [f for f in fit.free if f.name.startswith(f"{candidate.tag}.")]
        number = len(free) + len(own) * len(fit.problem.runs)
        far = odd(fit, candidate.tag)
        found = self.beside(fit, number, candidate.members, bool(own), _price(far))
        name = candidate.name
        std = fit.std().get(name, np.inf)
        return Judged(
            candidate.fit, found.gain, found.chance, found.unseen, found.nearer, candidate, fit.values[name], std,
            far,
        )  # fmt: skip

    def beside(self, fit: Fit, number: int, members: int = 1, own: bool = False, price: float = 0.0) -> Compared:
        """A model with ``number`` parameters more, the best of ``members``; ``own`` where runs have their own."""
        gain = max(self.base.cost - fit.cost, 0.0)
        chance = min(1.0, float(chdtrc(number, max(gain - price, 0.0) / DISPERSION)) * members * self.tried)
        without, predicted = self._unseen[own], unseen(fit, self._halves if own else self._runs)
        nearer = self._squares(without) - self._squares(predicted)
        return Compared(fit, gain, chance, without.cost - predicted.cost, nearer)

    def _squares(self, predicted: Unseen) -> Array:
        """Of the error of every event left out over the floor of the model without, shape (E,)."""
        base = self.base
        over = predicted.residual / np.hypot(self._floor, predicted.spread)
        return np.asarray(np.bincount(base.problem.of, over**2 * ~base.dropped, base.problem.events), float)


def best_forms(judged: Sequence[Judged]) -> list[Judged]:
    """Every effect in the form that predicts unseen runs best among those that fit nearly best, the best first."""
    out: dict[str, Judged] = {}
    for j in sorted(judged, key=lambda j: -j.gain):
        other = out.get(j.tag)
        if other is None or (j.gain > other.gain - 4.0 and j.better > other.better):
            out[j.tag] = j
    return sorted(out.values(), key=lambda j: -j.better if j.seen else np.inf)


def named(judged: Sequence[Judged]) -> list[Judged]:
    """The effect to be named, and behind it what these data cannot distinguish from it; nothing where none is seen."""
    seen = [j for j in best_forms(judged) if j.seen]
    if not seen or held_back(judged) is not None:
        return []
    best = max(seen, key=lambda j: j.better)
    close = [best, *(j for j in seen if j is not best and as_well(best, j))]
    # what contains another of them must pay for what it has more
    simple = [j for j in close if not any(_no_better(j, o) for o in close if o.tag in catalogue.get(j.tag).generalises)]
    return simple or close


def held_back(judged: Sequence[Judged]) -> Judged | None:
    """The effect held back that predicts unseen runs better than all that are seen (rule 5)."""
    seen = [j for j in judged if j.seen]
    beyond = [j for j in judged if j.held_back and not any(as_well(j, s) for s in seen)]
    return max(beyond, key=lambda j: j.better, default=None)


def _no_better(general: Judged, special: Judged) -> bool:
    """Whether a law gains no more over a special case of it than its further parameters cost (Schwarz's criterion)."""
    more = len(general.fit.free) - len(special.fit.free)
    return (general.gain - general.price - special.gain + special.price) / DISPERSION < more * float(
        np.log(general.unseen.size)
    )


def as_well(best: Compared, other: Compared) -> bool:
    """Whether a model predicts the unseen runs as well as the best one, within the error of their difference."""
    difference = best.unseen - other.unseen
    total = best.better - other.better
    return total < ERRORS * standard_error(difference) or total < LEAST


def standard_error(difference: Array) -> float:
    """Of the sum of what events say for one model against another (differences of predictive cost), shape (E,).

    An event that two models predict d standard deviations apart differs in cost by d^2 + 2 d e, with e of unit variance
    under the better one: its variance is four times its size, and by DISPERSION more. Where events agree among
    themselves better than that, their own scatter counts; where a few of them say all (those after a hold), it says
    nothing of the error.
    """
    n = difference.size
    own = float(np.sqrt(n) * np.std(difference, ddof=1)) if n > 1 else np.inf
    return min(own, float(np.sqrt(4.0 * DISPERSION * np.abs(difference).sum())))


LEAST = 6.0  # of the predictive cost: a likelihood ratio of twenty
