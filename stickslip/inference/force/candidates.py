"""Every effect in every form: where its inner parameters are best, and the model refitted in full with it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np

from ...errors import StickslipError
from ...physics.effects import catalogue
from ...physics.effects.base import Effect, Geometry
from ...physics.params import Spec, specs
from ...system.progress import breathe, portion
from ..fit.parameters import Free, effect_parameters
from .composition import is_own
from .fit import Fit, adapted, refit
from .linearised import Array
from .periodogram import best_wave, waves
from .point import Point
from .problem import Problem
from .signatures import Explained, signatures

FEW = 12  # members of a family for which no program of their own is compiled
STARTS = 4  # members of a family from which a refit is begun
SHORT = 6  # evaluations from each start, after which the better half of them goes to its end
EVEN = 1.0  # of two forms' costs: less is no reason to try one from where the other ended
LARGE = 4.0  # times the promised amplitude: the model without the effect has taken a part of it, and laws may be bent
FAR = 0.25  # of the way to a bound, from where an effect is begun of which nothing small is seen
PROMISING = 3.0  # fall of the cost that chance alone promises
BESIDE = 0.03  # of the amplitude from which a refit gained nothing, from where it is begun anew
SIMILAR = 0.9  # cosine between what two members do to the residuals, from which one start serves both


class Start(NamedTuple):
    """Where a refit begins.

    Attributes:
        values: of the effect (SI).
        base: of the model without it, which has made room for the effect.
        turns: a phase for each run, shape (R,), where the effect has one.
        error: standard deviation of the amplitude there (SI).
    """

    values: dict[str, float]
    base: Point
    turns: Array | None = None
    error: float = np.inf


@dataclass(frozen=True)
class Candidate:
    """One form of an effect on top of a model.

    Attributes:
        tag, form: which.
        promise: fall of the cost that its best member promises for a small amplitude.
        fit: with the effect in it; None where it could not be fitted.
        note: why.
        members: how many values of the inner parameters were tried.
        visible: amplitude that would be five standard deviations (SI, distance from the null).
        start: values of the effect that its fit began with (SI).
    """

    tag: str
    form: dict[str, str]
    promise: float
    fit: Fit | None
    note: str = ""
    members: int = 1
    visible: float | None = None
    start: dict[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the amplitude."""
        return f"{self.tag}.{catalogue.get(self.tag).amplitude}"


def shapes_backbone(effect: Effect) -> bool:
    """Whether all that an effect does is to change the backbone, which the free bank measures anyway."""
    if not isinstance(effect, Geometry):
        return False
    return getattr(effect, "where", "series") == "series"


def every_form(tags: Sequence[str]) -> list[tuple[str, dict[str, str]]]:
    """All forms of the effects that act along the motion."""
    out = []
    for cls in map(catalogue.get, tags):
        tag = cls.tag
        if cls.drawn:  # another draw is another course: its events are what the scatter of the model describes
            continue
        for form in catalogue.forms(cls):
            if not shapes_backbone(cls(**form)):
                out.append((tag, form))
    return out


def grid(effect: Effect) -> list[dict[str, float]]:
    """Coarse grid of the inner parameters that have one."""
    axes: dict[str, tuple[float, ...]] = {}
    for name, spec in specs(effect).items():
        if name == effect.amplitude or is_own(name):
            continue
        own = float(getattr(effect, name))
        axes[name] = _axis(spec, own)
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())] or [{}]


def _axis(spec: Spec, own: float) -> tuple[float, ...]:
    if not spec.grid:
        return (own,)
    return tuple(dict.fromkeys((*spec.grid, own))) if len(spec.grid) < 3 else spec.grid


def try_effect(base: Fit, explained: Explained, tag: str, forms: Sequence[dict[str, str]]) -> list[Candidate]:
    """An effect in some of its forms, each refitted in full, then once more from where the best of them ended."""
    made = [_tried(base, explained, tag, form) for form in forms]
    best = min(made, key=_cost)
    if best.fit is not None and catalogue.get(tag).periodic is None:
        made = [c if c.fit is None or c.fit.cost < best.fit.cost + EVEN else from_end(base, c, best.fit) for c in made]
    return [c if c.fit is None else replace(c, fit=copy(c.fit)) for c in made]  # without what is large and soon found


def _tried(base: Fit, explained: Explained, tag: str, form: dict[str, str]) -> Candidate:
    effect = catalogue.get(tag)(**form)
    try:
        if waves(effect):
            return _periodic(base, explained, effect, form)
        return _plain(base, explained, effect, form)
    except StickslipError as error:
        return Candidate(tag, form, 0.0, None, str(error).split("\n")[0])


def _cost(c: Candidate) -> float:
    return np.inf if c.fit is None else c.fit.cost


def _better(one: Candidate, other: Candidate) -> Candidate:
    return other if _cost(other) < _cost(one) else one


def from_end(base: Fit, c: Candidate, other: Fit) -> Candidate:
    """The candidate, or what is better than it: begun where another model with its effect ended."""
    effect, values = catalogue.get(c.tag)(**c.form), other.values
    start = {**c.start, **{n.partition(".")[2]: v for n, v in values.items() if n.startswith(f"{c.tag}.")}}
    z = np.array([f.inward(values[f.name]) for f in base.free])
    turns = {f.name: own * float(f.scale) for f, own in zip(_turned(other), other.point.phases, strict=True)}
    phases = np.array([turns[f.name] / float(f.scale) for f in _turned(base)]).reshape(-1, len(base.problem.runs))
    own = next((turn for name, turn in turns.items() if name.startswith(f"{c.tag}.")), None)
    point = replace(other.point, z=z, phases=phases)
    try:
        found = adapted(_begun(base, effect, Start(start, point, own)))
    except StickslipError:
        return c
    return _better(c, replace(c, fit=found, start=start))


def _turned(fit: Fit) -> tuple[Free, ...]:
    """What every run has of its own in a model."""
    return fit.problem.composition.phases


def _plain(base: Fit, explained: Explained, effect: Effect, form: dict[str, str]) -> Candidate:
    members = grid(effect)
    columns = (_columns if len(members) <= FEW else signatures)(base, effect, members)
    usable = np.isfinite(columns).all(axis=1) & (np.abs(columns).max(axis=1) > 0.0)
    if not usable.any():
        return Candidate(effect.tag, form, 0.0, None, "it has no effect on this motion")
    members = [m for m, ok in zip(members, usable, strict=True) if ok]
    orthogonal = explained.orthogonal(columns[usable].T)
    falls, sizes, errors = explained.singly(orthogonal)
    spec = specs(effect)[effect.amplitude]
    null = spec.null or 0.0
    inside = np.clip(sizes, spec.lower - null, spec.upper - null)
    # a parabola through the promise: what is left of it where the amplitude may not go all the way
    share = np.where(sizes != 0.0, inside / np.where(sizes != 0.0, sizes, 1.0), 0.0)
    falls = falls * (1.0 - (1.0 - share) ** 2)
    distinct = _distinct(orthogonal, falls)
    starts: list[Start] = []
    for i, times in ((distinct[0], 1.0), *((i, LARGE) for i in distinct if falls[i] > PROMISING)):
        size, least = times * float(inside[i]), 0.3 * float(errors[i])  # at the null itself inner parameters do nothing
        if abs(size) < least:
            size = least if size >= 0.0 and spec.upper > null else -least
        # not at the bound either
        size = float(np.clip(size, 0.5 * (spec.lower - null), 0.5 * (spec.upper - null)))
        point, part = base.yielding(size * columns[usable][i])
        values = {**members[i], effect.amplitude: null + part * size}
        if values not in [s.values for s in starts]:
            starts.append(Start(values, point, None, float(errors[i])))
    if falls[distinct[0]] <= PROMISING:  # nothing small is seen of it, which says nothing of a large one
        first = distinct[0]
        for bound in (spec.lower, spec.upper):
            if bound != null:
                values = {**members[first], effect.amplitude: null + FAR * (bound - null)}
                starts.append(Start(values, base.point, None, float(errors[first])))
    found, start = _best_of(base, effect, starts)
    if found.cost > base.cost:  # a dent beside the model without the effect, which is begun at itself
        values = {**start.values, effect.amplitude: null + BESIDE * (start.values[effect.amplitude] - null)}
        own = start._replace(values=values, base=base.point)
        found, start = min((found, start), (adapted(_begun(base, effect, own)), own), key=lambda end: end[0].cost)
    return Candidate(
        effect.tag, form, float(falls.max()), found, "", len(members), 5.0 * start.error, start.values
    )  # fmt: skip


def _distinct(orthogonal: Array, falls: Array) -> list[int]:
    """Members that promise most, each distinct from the ones before it in what it does to the residuals."""
    unit = orthogonal / (np.sqrt((orthogonal**2).sum(axis=0)) + 1e-300)
    chosen: list[int] = []
    for i in np.argsort(-falls).tolist():
        if all(abs(float(unit[:, i] @ unit[:, j])) < SIMILAR for j in chosen):
            chosen.append(i)
        if len(chosen) == STARTS:
            break
    return chosen


def _columns(base: Fit, effect: Effect, members: Sequence[dict[str, float]]) -> Array:
    """Derivative of the residual force in the amplitude at its null, shape (members, p): by the refit's own program."""
    null = specs(effect)[effect.amplitude].null or 0.0
    out = []
    for member in members:
        problem, free = with_start(base.problem, effect, {**member, effect.amplitude: null}, inside=False)
        name = f"{effect.tag}.{effect.amplitude}"
        at, own = next((i, f) for i, f in enumerate(problem.composition.shared) if f.name == name)
        slopes = problem.evaluate(_at(base.problem, free, Start(member, base.point)))
        out.append(slopes.shared[:, at] / own.slope(own.inward(null)))
    return np.stack(out)


def _begun(base: Fit, effect: Effect, start: Start) -> Fit:
    """The model refitted with an effect in a few evaluations.

    It is given sizes of its own of what is random: those of the base are as large as the lack of the effect makes them,
    and under them ends of a search that differ much look the same. Events may not differ more than in the base.
    """
    problem, free = with_start(base.problem, effect, start.values)
    bound = replace(base, scatter=base.scatter.within(base.scatter))
    return adapted(refit(problem, _at(base.problem, free, start), bound, SHORT), rounds=0)


def _best_of(base: Fit, effect: Effect, starts: Sequence[Start]) -> tuple[Fit, Start]:
    """The best of the refits from several starts: a few evaluations from each, and the better half goes to its end.

    Early costs say which starts lead nowhere, not which of the others lead furthest.
    """
    tried = []
    for i, start in enumerate(starts):
        breathe(0.5 * i / len(starts))
        tried.append((_begun(base, effect, start), start))
    with portion(0.5, 1.0):
        ends = sorted(tried, key=lambda end: end[0].cost)[: (len(tried) + 1) // 2]
        return min(((adapted(found), start) for found, start in ends), key=lambda end: end[0].cost)


def with_start(
    problem: Problem, effect: Effect, values: dict[str, float], inside: bool = True
) -> tuple[Problem, list[Free]]:
    """The problem with an effect more, whose search starts at these values (SI), and its free parameters.

    ``inside`` keeps the start off the bounds, one of which may be the null.
    """
    free = effect_parameters(effect, amplitude=values[effect.amplitude])
    free = [f if f.amplitude and not inside else _kept(f, values) for f in free]
    for name, value in values.items():
        effect = eqx.tree_at(attrgetter(name), effect, np.float64(value))
    return problem.with_composition(problem.composition.with_effect(effect, free)), free


def _kept(f: Free, values: dict[str, float]) -> Free:
    own = f.name.partition(".")[2]
    return f.starting(values[own]) if own in values else f


def _at(problem: Problem, free: Sequence[Free], start: Start) -> Point:
    own = [f for f in free if not is_own(f.name)]
    z = np.concatenate([start.base.z, [f.inward(f.start) for f in own]])
    phases = start.base.phases
    for f in free:
        if is_own(f.name):
            at = np.full(len(problem.runs), f.start) if start.turns is None else start.turns
            phases = np.vstack([phases, at / float(f.scale)])
    return replace(start.base, z=z, phases=phases)


def _periodic(base: Fit, explained: Explained, effect: Any, form: dict[str, str]) -> Candidate:
    """An effect with a period and a phase for each run: from the period of a periodogram on top of everything."""
    wave = best_wave(base, explained, effect)
    if wave is None:
        return Candidate(effect.tag, form, 0.0, None, "the records are too short for a period")
    limit = specs(effect)[effect.amplitude]
    amplitude = min(wave.amplitude, 0.9 * limit.upper)
    point, share = base.yielding(amplitude * wave.column(base.problem.run))
    start = {effect.periodic[0]: wave.value, effect.amplitude: share * amplitude}
    found = adapted(_begun(base, effect, Start(start, point, wave.phases)))
    # in the mean over runs and phases a wave is seen as each of its two parts is
    seen = explained.singly(explained.orthogonal(wave.columns.T))[2]
    return Candidate(effect.tag, form, wave.fall, found, "", wave.tried, 5.0 * float(np.mean(seen)), start)
