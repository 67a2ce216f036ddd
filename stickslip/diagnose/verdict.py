"""From refitted candidates to a verdict: complete, missing, ambiguous or unknown, and never more than the data say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ..fit.composition import PHASE
from ..fit.inertial import DISPERSION
from ..params import specs
from ..residual import Misfit
from .candidate import Candidate
from .heldout import HeldOut
from .thresholds import THRESHOLDS, Thresholds


class _Errors(Protocol):
    """What a step of the ladder leaves."""

    @property
    def train(self) -> Misfit:
        """On the cycles fitted."""

    @property
    def held(self) -> HeldOut | None:
        """On the others."""


NONE_MET = 3  # the grade of a model that is beyond all limits


@dataclass(frozen=True)
class Verdict:
    """What the data say.

    Attributes:
        kind: ``complete``, ``missing``, ``ambiguous`` or ``unknown``.
        effects: named, in the order added.
        set: effects the data cannot tell apart, the best first; the same as ``effects`` where there are none.
        text: for a person.
        confidence: how likely the named effects, or the set, are among the effects of the catalogue, 0 to 1 (see
            :func:`weights`); None where nothing is named.
        forms: tag -> form of its law, of those said that have several.
    """

    kind: str
    effects: tuple[str, ...] = ()
    set: tuple[str, ...] = ()
    text: str = ""
    reasons: tuple[str, ...] = field(default=())
    confidence: float | None = None
    forms: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def errors(train: Misfit, held: HeldOut | None) -> dict[str, float]:
    """Phase -> the larger of its errors on fitted and unseen cycles (floors)."""
    found = dict(train.by_phase)
    for phase, error in (held.by_phase if held is not None else {}).items():
        found[phase] = max(found.get(phase, 0.0), error)
    return found


def worst_phase(train: Misfit, held: HeldOut | None, limits: Thresholds = THRESHOLDS) -> tuple[str, float]:
    """The phase that is furthest beyond its limit, and its error (floors): training, held out, or in all events."""
    found = [(e / limits.complete[p], p, e) for p, e in errors(train, held).items()]
    found += [(e / limits.alike, f"{p} in all events", e) for p, e in train.alike.items()]
    _, name, error = max(found, default=(0.0, "", 0.0))
    return name, error


def is_complete(train: Misfit, held: HeldOut | None, limits: Thresholds = THRESHOLDS) -> bool:
    """Whether every phase, and all of them together, are at their floor, also where no fit has looked, and what all
    events have in common is no more than a bank of few parameters leaves."""
    overall = max(train.total, held.error if held is not None else 0.0)
    phases = all(e <= limits.complete[phase] for phase, e in errors(train, held).items())
    return overall <= limits.overall and phases and all(e <= limits.alike for e in train.alike.values())


def is_adequate(
    train: Misfit, held: HeldOut | None, limits: Thresholds = THRESHOLDS, factor: float | None = None
) -> bool:
    """Whether what is left is small enough to trust the name of what was added: ``factor`` times the limits."""
    factor = limits.adequate if factor is None else factor
    own = all(e <= factor * limits.complete[phase] for phase, e in errors(train, held).items())
    return own and all(e <= factor * limits.alike for e in train.alike.values())


def grade(train: Misfit, held: HeldOut | None, limits: Thresholds = THRESHOLDS) -> int:
    """How good a model is: 0 complete, 1 with a small remainder, 2 good enough to trust a name, 3 not."""
    if is_complete(train, held, limits):
        return 0
    factors = (limits.remainder, limits.adequate)
    return next((i for i, f in enumerate(factors, start=1) if is_adequate(train, held, limits, f)), NONE_MET)


@dataclass(frozen=True)
class Judged:
    """A candidate and which of the conditions for a name it meets.

    Attributes:
        failures: conditions it does not meet.
        plausible: whether its parameters are inside their ranges.
    """

    candidate: Candidate
    cost: float
    failures: tuple[str, ...]
    plausible: bool = True

    @property
    def passed(self) -> bool:
        return not self.failures


def judge(candidate: Candidate, base_cost: float, base_held: HeldOut, limits: Thresholds = THRESHOLDS) -> Judged:
    """Check one refitted candidate against the conditions for naming it."""
    fails, plausible = [], True
    assert candidate.fit is not None
    assert candidate.train is not None
    assert candidate.held is not None
    cost = candidate.fit.cost
    share = 1.0 - cost / base_cost
    ample = share >= limits.ample
    if share < limits.gain:
        fails.append(f"takes {f'only {100 * share:.0f} %' if share > 0 else 'nothing'} off the training cost")
    gain = base_held.per_cycle - candidate.held.per_cycle
    gain = gain[np.isfinite(gain)]
    if gain.size < limits.fewest:
        fails.append("too few unseen cycles can be compared")
    else:
        error = np.std(gain, ddof=1) / np.sqrt(gain.size)
        fall, errors_of_it = (limits.unseen, limits.standard_errors) if ample else (limits.plain, limits.clearly)
        for_little = "" if ample or share < limits.gain else " for so little on the fitted ones"
        if candidate.held.score > (1.0 - fall) * base_held.score:
            fails.append(f"the error on unseen cycles does not fall enough{for_little}")
        elif np.mean(gain) < errors_of_it * error:
            fails.append(f"the gain on unseen cycles is not significant{for_little and ' enough' + for_little}")
    if candidate.amplitude is not None:
        own = sum(1 for f in candidate.fit.free if f.name.startswith(f"{candidate.tag}."))
        if base_cost - cost < limits.significant**2 * own:
            fails.append("its gain is not significant for the number of its parameters")
        at_end = at_border(candidate, limits)
        fails += [f"its '{name}' ends at the border of its plausible range" for name in at_end]
        plausible = not at_end
    return Judged(candidate, cost, tuple(fails), plausible)


def at_border(candidate: Candidate, limits: Thresholds = THRESHOLDS) -> list[str]:
    """Parameters of the effect whose fit was stopped by the end of a plausible range.

    A range may also end where the law becomes a special case, or be that of an angle; a fit may arrive there.
    """
    assert candidate.fit is not None
    table, out = specs(candidate.effect), []
    for f, z in zip(candidate.fit.free, candidate.fit.z, strict=True):
        tag, _, name = f.name.partition(".")
        if tag != candidate.tag or (name.split(".")[0] == PHASE and candidate.effect.periodic is not None):
            continue
        # near its null an amplitude is small, not implausible: whether it is there at all is judged by its gain
        harmless = {*table[name].ends, *([table[name].null or 0.0] if f.amplitude else [])}
        low, high = f.bounds
        ends = [end for end in (f.lower, f.upper) if end not in harmless]
        if any(abs(z - f.inward(end)) < limits.border * (high - low) for end in ends):
            out.append(name)
    return out


def decide(judged: Sequence[Judged], limits: Thresholds = THRESHOLDS) -> tuple[Judged | None, list[Judged]]:
    """The best candidate that passed, and all that the data cannot tell from it (itself first)."""
    ranked = sorted(judged, key=lambda j: j.cost)
    passed = [j for j in ranked if j.passed]
    if not passed:
        return None, []
    # what the fitted cycles cannot tell apart, the unseen ones may
    best = min((j for j in passed if j.cost < limits.rival * passed[0].cost), key=unseen)
    # a special case within reach of the law that contains it: nothing speaks for the rest of that law
    simpler = [j for j in passed if j.cost < limits.rival * best.cost and contains(best, j)]
    best = simpler[0] if simpler else best
    # a rival counts even where it gains too little by itself, unless it needs what is not plausible or is clearly worse
    # on cycles that no fit has seen
    close = [
        j
        for j in ranked
        if j.cost < limits.rival * best.cost
        and not contains(j, best)
        and j.plausible
        and not worse(j.candidate.held, best.candidate.held, limits)
    ]
    seen: list[Judged] = [best]
    for j in close:
        if all(j.candidate.tag != s.candidate.tag for s in seen):
            seen.append(j)
    return best, seen


def passed_over(judged: Judged, others: Sequence[Judged], limits: Thresholds = THRESHOLDS) -> tuple[str, ...]:
    """Why `decide` does not choose a candidate: conditions it does not meet, or what is preferred to it.

    Empty for the one chosen.
    """
    best, close = decide(others, limits)
    if not judged.passed or best is None:
        return judged.failures
    if judged is best:
        return ()
    if contains(judged, best):
        return (f"it contains {best.candidate.tag}, and what it has beyond that takes too little off the cost",)
    if judged.candidate.tag == best.candidate.tag:
        return ("another form of it describes the data better",)
    if any(j.candidate.tag == judged.candidate.tag for j in close):
        return (f"the data cannot tell it from {best.candidate.tag}",)
    if judged.cost >= limits.rival * best.cost:
        return (f"its cost is {100 * (judged.cost / best.cost - 1):.0f} % above that of {best.candidate.tag}",)
    return (f"{best.candidate.tag} describes the unseen cycles better",)


def unseen(judged: Judged) -> float:
    """Score on unseen cycles; infinite where there are none."""
    held = judged.candidate.held
    return np.inf if held is None else held.score


def worse(one: HeldOut | None, other: HeldOut | None, limits: Thresholds = THRESHOLDS) -> bool:
    """Whether ``one`` describes the unseen cycles worse than ``other``, cycle by cycle and significantly."""
    if one is None or other is None or one.per_cycle.size != other.per_cycle.size:
        return False
    more = one.per_cycle - other.per_cycle
    more = more[np.isfinite(more)]
    if more.size < limits.fewest:
        return False
    return bool(np.mean(more) > limits.clearly * np.std(more, ddof=1) / np.sqrt(more.size))


def weights(judged: Sequence[Judged]) -> dict[str, float]:
    """How likely each effect is, given that one of these is the missing one: tag -> weight, adding up to 1.

    The likelihood ratio of the refitted candidates, with costs divided by DISPERSION: all events share what a bank of
    few parameters cannot describe.
    """
    best: dict[str, float] = {}
    for j in judged:
        best[j.candidate.tag] = min(j.cost, best.get(j.candidate.tag, np.inf))
    least = min(best.values())
    raw = {tag: float(np.exp(-0.5 * (cost - least) / DISPERSION)) for tag, cost in best.items()}
    total = sum(raw.values())
    return {tag: w / total for tag, w in raw.items()}


def confidence(judged: Sequence[Judged], said: Sequence[Judged]) -> float:
    """Weight of the effects said, with that of the laws that contain one of them."""
    tags = {s.candidate.tag for s in said}
    tags |= {j.candidate.tag for j in judged if any(contains(j, s) for s in said)}
    return float(sum(w for tag, w in weights(judged).items() if tag in tags))


def contains(general: Judged, special: Judged) -> bool:
    """Whether the law of one effect has that of another as a special case."""
    return special.candidate.tag in general.candidate.effect.generalises


Forms = Mapping[str, Mapping[str, str]]  # tag -> form of its law


def finished(named: Sequence[str], forms: Forms | None = None) -> Verdict:
    """The verdict when every phase is at its floor."""
    if not named:
        return Verdict("complete", text="Nothing is missing: every phase is described as well as the data allow.")
    return Verdict(
        "missing",
        tuple(named),
        tuple(named),
        f"The base model lacks {_listed(named, forms)}. With {'it' if len(named) == 1 else 'them'} every phase is "
        "described as well as the data allow.",
        forms=forms or {},
    )


def nearly(
    named: Sequence[str],
    phase: str,
    worst: float,
    *,
    tried: bool,
    reasons: tuple[str, ...] = (),
    forms: Forms | None = None,
) -> Verdict:
    """The verdict when what is left beside the named effects is small; ``tried``: whether others were, after them."""
    return Verdict(
        "missing",
        tuple(named),
        tuple(named),
        f"The base model lacks {_listed(named, forms)}. A small misfit remains ({phase}, {worst:.1f} floors)"
        + (" that no other effect that was tried explains." if tried else "."),
        reasons,
        forms=forms or {},
    )


def undecided(named: Sequence[str], groups: Sequence[Sequence[str]], forms: Forms | None = None) -> Verdict:
    """The verdict when several effects describe the data alike: one of each of the ``groups`` is missing."""
    apart = "; nor ".join(_listed(group, forms) for group in groups)
    text = f"These data cannot tell {apart} apart."
    if named:
        text = f"The base model lacks {_listed(named, forms)}, and besides: {text[0].lower()}{text[1:]}"
    tags = tuple(dict.fromkeys(tag for group in groups for tag in group))
    return Verdict("ambiguous", tuple(named), tags, text, forms=forms or {})


def nothing(
    named: Sequence[str],
    judged: Sequence[Judged],
    rung: _Errors,
    limits: Thresholds = THRESHOLDS,
    forms: Forms | None = None,
) -> Verdict:
    """The verdict when no candidate passes: something is missing, unless the model, fitted once more, describes all."""
    if is_complete(rung.train, rung.held, limits):
        return finished(named, forms)
    phase, worst = worst_phase(rung.train, rung.held, limits)
    nearest = min(judged, key=lambda j: j.cost, default=None)
    text = f"Something is missing ({phase} is off by {worst:.1f} floors) and no effect that was tried explains it"
    if nearest is not None:
        said = described(nearest.candidate.tag, nearest.candidate.form)
        text += f"; nearest is {said}, but {'; '.join(nearest.failures) or 'it does not suffice'}"
    reasons = nearest.failures if nearest is not None else ()
    if not named and is_adequate(rung.train, rung.held, limits, limits.remainder):
        return Verdict(
            "complete",
            text=f"A small misfit remains ({phase}, {worst:.1f} floors) that no effect that was tried takes away; "
            "otherwise every phase is described as well as the data allow.",
        )
    if not named:
        return Verdict("unknown", (), (), text + ".", reasons)
    if is_adequate(rung.train, rung.held, limits):
        return nearly(named, phase, worst, tried=True, reasons=reasons, forms=forms)
    text = f"{_listed(named, forms)} {'helps' if len(named) == 1 else 'help'}, but {text[0].lower()}{text[1:]}."
    return Verdict("unknown", tuple(named), tuple(named), text, reasons, forms=forms or {})


def described(tag: str, form: Mapping[str, str] | None = None) -> str:
    """An effect in a sentence: its tag, and the form of its law where it has several."""
    what = [] if tag != "inertia" else ["mass that moves with the block"]
    what += [f"{name}: {chosen}" for name, chosen in (form or {}).items()]
    return f"{tag} ({', '.join(what)})" if what else tag


def _listed(tags: Sequence[str], forms: Forms | None = None) -> str:
    tags = [described(tag, (forms or {}).get(tag)) for tag in tags]
    return tags[0] if len(tags) == 1 else f"{', '.join(tags[:-1])} and {tags[-1]}"
