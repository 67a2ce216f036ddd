"""The steps of ``stickslip fit --model inertial``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..campaign import Campaign
from ..conformance import try_laws
from ..diagnose.candidate import forms_of
from ..diagnose.heldout import held_out
from ..diagnose.holdout import training_cycles
from ..diagnose.refit import try_effect
from ..diagnose.static_rung import static_features
from ..effects import catalogue
from ..effects.base import Effect
from ..errors import FitError, InputError, nearest
from ..features.measurement import Measurement, measure
from ..fit.composition import Composition
from ..fit.inertial import DISPERSION, Fit, errors, fit
from ..fit.multistart import best_of
from ..fit.problem import Problem
from ..fit.record import KEY, fitted, record
from ..fit.solved import solved
from ..fit.start import FALLBACK_PERIOD, UNHEARD, base_composition, ringing
from ..floors import floors, scatter_factor
from ..motion import with_displacements
from ..params import specs, variants
from ..report.inertial_result import fit_sections, parameters
from ..residual import misfit
from ..segment import Segmentation
from ..trace import Trace
from ..uncertainty import profile
from .working import Tell, working

REFIT = ((2.5, 4), (1.0, 8))  # of a profile's points, from the neighbouring optimum
AGAIN = ((1.0, 12),)  # of a model, from where the same with one effect more arrived
NOTHING_UNSEEN = (
    'every run is fitted, so nothing is known of unseen ones: --holdout RUN, or role = "held-out" in the campaign, '
    "keeps one aside"
)
PIN = 1e-3  # width of the prior that holds a profiled parameter, on the search scale


@dataclass(frozen=True)
class Options:
    """What the command line asked for."""

    add: tuple[str, ...]
    files: tuple[Path, ...]
    profiles: tuple[str, ...]
    holdout: tuple[str, ...]
    starts: int
    scatter: float | None
    most_events: int
    most_steps: int


def fit_inertial(
    loaded: Campaign, traces: list[Trace], found: list[Segmentation], options: Options
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fit the dynamic model; what ``result.json`` and ``arrays.nc`` hold of it."""
    for path in options.files:
        catalogue.load_file(path)
    effects = chosen(options.add)
    try_laws(type(effect) for effect in effects)
    traces, notes = with_displacements(traces, found)
    usable = [(t, s) for t, s in zip(traces, found, strict=True) if t.displacement is not None and t.drive is not None]
    if not usable:
        raise InputError(
            "no trace has a drive and a displacement in metres",
            file=loaded.path,
            hint="give drive_velocity (and spring_stiffness where only the force is measured)",
        )
    own, segments = [t for t, _ in usable], [s for _, s in usable]
    unusable = [
        f"{t.name}: {'no drive' if t.drive is None else 'no displacement in metres'} in it, so it is not fitted"
        for t in traces
        if all(t is not kept for kept in own)
    ]
    heard = ringing(own, segments)
    if heard is None:
        notes.append(UNHEARD)
    period = heard or FALLBACK_PERIOD
    try:
        m = measure(
            own,
            segments,
            ring_period=period,
            most_cycles=options.most_events,
            most_steps=options.most_steps,
            contacts=loaded.rig.contacts,
        )
    except InputError as error:
        raise error.at(file=loaded.path) from None
    m = replace(m, new_lines=options.scatter)
    floor = floors(m)
    base = replace(base_composition(loaded, m), most_steps=options.most_steps)
    _check_names(options.profiles, base, effects)
    try:
        train = _training(m, traces, options.holdout)
    except InputError as error:
        raise error.at(file=loaded.path) from None
    if m.runs > 1 and train.sum() == m.cycles.used.sum():
        notes.append(NOTHING_UNSEEN)
    with working("fitting") as tell:
        composition, optimum, ladder = _climb(m, base, effects, floor, train, options.starts, tell)
        problem = Problem(composition, m)
        profiles = [_profile(name, problem, optimum, floor, tell) for name in options.profiles]
        tell("drawing the model through the data")
        sections, variables = fit_sections(problem, optimum, traces, found, floor, train, loaded.rig)
    result: dict[str, Any] = {
        "model_parts": ladder[-1]["model"],
        "ladder": ladder,
        **sections,
        "parameters": parameters(composition, optimum),
        **_model(composition, optimum, m, loaded),
        "profiles": profiles,
        "features": {"names": list(m.layout.names), "phases": list(m.layout.phases)},
        "fit": {
            "cost": optimum.cost,
            "evaluations": optimum.evaluations,
            "jacobians": optimum.jacobians,
            "covariance": optimum.covariance,
            "ring_period": period,
            "scatter_factor": scatter_factor(m),
            "cycles": int(train.sum()),
        },
        "notes": notes,
        "dropped": [*unusable, *m.dropped],
    }
    return result, variables


def chosen(added: Sequence[str]) -> list[Effect]:
    """The effects of ``--add``: ``tag``, or ``tag:name=value`` for another form of its law than the usual one.

    Raises:
        InputError: there is no such effect or form, or an effect is named twice.
    """
    effects: list[Effect] = []
    for text in added:
        tag, colon, rest = text.strip().partition(":")
        try:
            usual = forms_of(tag)[0]
        except InputError as error:
            raise error.at(key="--add") from None
        if any(tag == effect.tag for effect in effects):
            raise InputError("an effect can be added once", key="--add", value=tag, hint="name it in one form only")
        effects.append(type(usual)(**_form(text, usual, rest)) if colon else usual)
    return effects


def _form(text: str, effect: Effect, asked: str) -> dict[str, str]:
    """The variants that ``name=value,name=value`` asks for."""
    known = variants(effect)
    allowed = [f"{effect.tag}:{name}={choice}" for name, choices in known.items() for choice in choices]
    form = {}
    for part in asked.split(","):
        name, _, value = (word.strip() for word in part.partition("="))
        if value not in known.get(name, ()) or name in form:
            raise InputError(
                f"no form of {effect.tag}",
                key="--add",
                value=text,
                allowed=", ".join(allowed) or f"{effect.tag}, which has one form",
                hint="a fit finds the values of its parameters by itself" if name in specs(effect) else None,
            )
        form[name] = value
    return form


def _check_names(names: tuple[str, ...], base: Composition, effects: list[Any]) -> None:
    from ..fit.parameters import effect_parameters

    known = [f.name for f in base.free] + [f.name for e in effects for f in effect_parameters(e)]
    for name in names:
        if name not in known:
            raise InputError("no free parameter of that name", key="--profile", value=name, hint=nearest(name, known))


def _training(m: Measurement, traces: list[Trace], holdout: tuple[str, ...]) -> np.ndarray:
    """Cycles that are fitted, shape (R, n): those of all runs that are not held out."""
    held = holdout or tuple(t.name for t in traces if t.role == "held-out" and t.name in m.names)
    return training_cycles(m, held) if held else np.asarray(m.cycles.used)


def _climb(
    m: Measurement,
    base: Composition,
    effects: list[Any],
    floor: np.ndarray,
    train: np.ndarray,
    starts: int,
    tell: Tell,
) -> tuple[Composition, Fit, list[dict[str, Any]]]:
    """The base model, then one effect after the other."""
    problem = Problem(base, m)
    optimum = best_of(problem, floor, train, starts=starts, progress=tell)
    ladder = [
        _static_step(problem, optimum, floor, train),
        _step(problem, optimum, floor, train, ["static", "inertia"], None),
    ]
    composition = base
    for effect in effects:
        tell(f"adding {effect.tag}")
        found = try_effect(effect, composition, optimum, m, floor, train, threads=problem.threads, progress=tell)
        if found.fit is None or found.composition is None or found.note:
            raise FitError(f"{effect.tag} could not be fitted: {found.note or 'no finite model with it'}")
        # a model less converged than the one with the effect would make a gain of nothing
        tell(f"the model without {effect.tag} once more")
        before, k = Problem(composition, m), len(composition.free)
        again = fit(before, floor, z=found.fit.z[:k], events=found.fit.events, stages=AGAIN, use=train)
        if again.cost < optimum.cost:
            ladder[-1] = _step(before, again, floor, train, ladder[-1]["model"], ladder[-1]["added"])
        composition, optimum = found.composition, found.fit
        step = _step(Problem(composition, m), optimum, floor, train, [*ladder[-1]["model"], effect.tag], effect.tag)
        ladder.append(step)
    return composition, optimum, ladder


def _step(
    problem: Problem, optimum: Fit, floor: np.ndarray, train: np.ndarray, model: list[str], added: str | None
) -> dict[str, Any]:
    m = problem.measurement
    fitted = errors(m, optimum, floor)
    unseen = np.asarray(m.cycles.used) & ~train
    held = held_out(problem, optimum, floor, unseen) if unseen.any() else None
    return {
        "model": model,
        "added": added,
        "cost": optimum.cost,
        "parameters": len(optimum.free),
        "train_error": fitted.total,
        "heldout_error": None if held is None else held.error,
        "by_phase": fitted.by_phase,
        "heldout_by_phase": {} if held is None else held.by_phase,
        "alike": fitted.alike,
    }


def _static_step(problem: Problem, optimum: Fit, floor: np.ndarray, train: np.ndarray) -> dict[str, Any]:
    m = problem.measurement
    stiffness = problem.composition.fixed.get("rig.spring_stiffness") or optimum.values.get(
        "rig.spring_stiffness", np.nan
    )
    model = static_features(m, floor, optimum, stiffness, train)
    found = [
        misfit(replace(m, valid=m.valid & part[..., None]), model, floor)
        for part in (train, np.asarray(m.cycles.used) & ~train)
    ]
    return {
        "model": ["static"],
        "added": None,
        "train_error": found[0].total,
        "heldout_error": found[1].total or None,
        "by_phase": found[0].by_phase,
        "heldout_by_phase": found[1].by_phase,
    }


def _model(composition: Composition, optimum: Fit, m: Measurement, loaded: Campaign) -> dict[str, Any]:
    """The equations of the fitted model with its values, and all that is needed to make it again."""
    found = fitted(composition, optimum, m, loaded.rig)
    words = solved(found)
    return {"equations": [{"text": words.text(), "latex": words.latex()}], KEY: record(found)}


def _profile(name: str, problem: Problem, optimum: Fit, floor: np.ndarray, tell: Callable[..., None]) -> dict[str, Any]:
    free = problem.composition.free
    k = [f.name for f in free].index(name)
    f, z0 = free[k], optimum.z.copy()

    def refit(value: float) -> float:
        at = f.outward(value)
        held = tuple(replace(g, prior=at, width=PIN) if i == k else g for i, g in enumerate(free))
        pinned = Problem(replace(problem.composition, free=held), problem.measurement)
        z = z0.copy()
        z[k] = value
        found = fit(pinned, floor, z=z, events=optimum.events, stages=REFIT, use=optimum.use)
        return (found.cost - ((found.z[k] - value) / PIN) ** 2) / DISPERSION

    std = float(np.sqrt(max(optimum.covariance[k, k], 0.0)))
    progress = lambda done, of: tell(f"profile of {name}: {done} of {of}", done / of)  # noqa: E731
    found = profile(name, float(z0[k]), std, f.bounds, refit, progress=progress)
    low, high = (f.outward(v) if np.isfinite(v) else None for v in found.interval)
    from . import show

    text = f"{found.text}; 95 % interval {show.quantity(low, f.unit, 3)} to {show.quantity(high, f.unit, 3)}"
    return {
        "name": name,
        "unit": f.unit,
        "value": [f.outward(float(v)) for v in found.z],
        "rise": found.rise,
        "interval": [low, high],
        "text": text,
    }
