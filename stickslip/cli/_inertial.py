"""The steps of ``stickslip fit --model inertial``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..campaign import Campaign
from ..conformance import try_laws
from ..diagnose.climb import Form, climb, profiled
from ..diagnose.prepare import prepare
from ..diagnose.summary import fitted_sections
from ..effects import catalogue
from ..effects.base import Effect
from ..errors import InputError, nearest
from ..fit.parameters import effect_parameters
from ..force.fit import Fit
from ..force.problem import Problem
from ..motion import with_displacements
from ..params import specs, variants
from ..report.diagnosis_result import trace_sections
from ..report.identifiability import identifiability
from ..segment import Segmentation
from ..trace import Trace
from . import show
from .working import Tell, working


@dataclass(frozen=True)
class Options:
    """What the command line asked for."""

    add: tuple[str, ...]
    files: tuple[Path, ...]
    profiles: tuple[str, ...]
    holdout: tuple[str, ...]


def fit_inertial(
    loaded: Campaign, traces: list[Trace], found: list[Segmentation], options: Options
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fit the dynamic model; what ``result.json`` and ``arrays.nc`` hold of it."""
    for path in options.files:
        catalogue.load_file(path)
    effects = chosen(options.add)
    try_laws(catalogue.get(tag) for tag, _ in effects)
    traces, notes = with_displacements(traces, found)
    prepared = prepare(loaded, traces, found, options.holdout)
    _check_names(options.profiles, prepared.problem, effects)
    with working("fitting") as tell:
        done, gains = climb(prepared, effects, loaded.rig, tell)
        profiles = [_profile(name, done.fit, tell) for name in options.profiles]
    sections, variables, fitted = fitted_sections(done, loaded.rig)
    described, pictured = trace_sections(traces, found)
    result: dict[str, Any] = {
        "model_parts": list(done.ladder[-1].model),
        **sections,
        "gains": gains,
        "profiles": profiles,
        "identifiability": identifiability(fitted, loaded.rig, sections["backbone"]["rough_line"]),
        **described,
        "fit": {
            "cost": done.fit.cost,
            "evaluations": done.fit.evaluations,
            "covariance": fitted.covariance,
            "ring_period": prepared.scales.ring,
            "cycles": done.fit.problem.events,
        },
        "notes": notes,
    }
    return result, variables | pictured


def chosen(added: Sequence[str]) -> list[Form]:
    """The effects of ``--add``: ``tag``, or ``tag:name=value`` for another form of its law than the usual one.

    Raises:
        InputError: there is no such effect or form, or an effect is named twice.
    """
    effects: list[Form] = []
    for text in added:
        tag, colon, rest = text.strip().partition(":")
        try:
            usual = catalogue.get(tag)()
        except InputError as error:
            raise error.at(key="--add") from None
        if any(usual.tag == other for other, _ in effects):
            raise InputError("an effect can be added once", key="--add", value=tag, hint="name it in one form only")
        effects.append((usual.tag, _form(text, usual, rest) if colon else {}))
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


def _check_names(names: Sequence[str], problem: Problem, effects: Sequence[Form]) -> None:
    own = [f.name for tag, form in effects for f in effect_parameters(catalogue.get(tag)(**form))]
    known = [f.name for f in problem.composition.shared] + own
    for name in names:
        if name not in known:
            raise InputError("no free parameter of that name", key="--profile", value=name, hint=nearest(name, known))


def _profile(name: str, fit: Fit, tell: Tell) -> dict[str, Any]:
    found = profiled(fit, name, tell)
    f = next(f for f in fit.free if f.name == name)
    low, high = (f.outward(v) if np.isfinite(v) else None for v in found.interval)
    text = f"{found.text}; 95 % interval {show.quantity(low, f.unit, 3)} to {show.quantity(high, f.unit, 3)}"
    return {
        "name": name,
        "unit": f.unit,
        "value": [f.outward(float(v)) for v in found.z],
        "rise": found.rise,
        "interval": [low, high],
        "text": text,
    }
