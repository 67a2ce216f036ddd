"""A ladder of models whose effects are chosen by a person, and the profile likelihood of what was fitted on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...errors import ArgumentError, FitError, InputError
from ...physics.effects import catalogue
from ...physics.effects.base import Effect
from ...physics.params import specs, variants
from ...system.progress import Tell, portion
from ..force.candidates import shapes_backbone, try_effect
from ..force.fit import Fit, deviations, fit_base
from ..force.profile_deviations import LEVEL, held, widened
from ..force.signatures import Explained
from ..uncertainty import Profile, profile
from .backbone_laws import shape_of, unshaped
from .decide import DISPERSION
from .final_comparison import settled
from .free_simulation import Confirmation, confirm
from .prepare import Prepared
from .search import Rung, without
from .stepwise_selection import Diagnosis, Verdict, leading, static_residual
from .wandering_level import level_of
from .work import Work

Form = tuple[str, Mapping[str, str]]  # tag and variants of an effect


@dataclass(frozen=True)
class Climbed:
    """Models of growing parts, each fitted on top of the one before it.

    Attributes:
        prepared: the data.
        ladder: the models; the last one is the model as it stands.
        gains: tag -> by how much an effect lowered the cost when it was added.
    """

    prepared: Prepared
    ladder: tuple[Rung, ...]
    gains: Mapping[str, float]

    @property
    def fit(self) -> Fit:
        """Of the last model."""
        last = self.ladder[-1].fit
        assert last is not None
        return last

    def confirmed(self, tell: Tell) -> Confirmation:
        """Base and last model run freely through the measured cycles."""
        return confirm(leading(self.ladder, {}), self.ladder[-1].model, self.prepared, Work(tell=tell))

    def as_diagnosis(self, confirmation: Confirmation, rig: Any) -> Diagnosis:
        """The same ladder without a search behind it, with the laws of its backbone; ``rig`` of the campaign."""
        shape = unshaped(self.fit, rig) if self.prepared.prescribed else shape_of(self.fit, rig)
        return Diagnosis(
            Verdict("fitted", tuple(self.gains)), self.ladder, (), {}, self.prepared, deviations(self.fit),
            shape, self.prepared.dropped, confirmation=confirmation, level=level_of(self.fit),
        )  # fmt: skip


def chosen(added: Sequence[str], key: str = "effects") -> list[Form]:
    """Effects by name: ``tag``, or ``tag:name=value`` for another form of its law than the usual one.

    Args:
        added: the names.
        key: what an error calls them.

    Raises:
        InputError: there is no such effect or form, or an effect is named twice.
    """
    effects: list[Form] = []
    for text in added:
        tag, colon, rest = text.strip().partition(":")
        try:
            usual = catalogue.get(tag)()
        except InputError as error:
            raise error.at(key=key) from None
        if any(usual.tag == other for other, _ in effects):
            raise InputError("an effect can be added once", key=key, value=tag, hint="name it in one form only")
        effects.append((usual.tag, _form(text, usual, rest, key) if colon else {}))
    return effects


def _form(text: str, effect: Effect, asked: str, key: str) -> dict[str, str]:
    """The variants that ``name=value,name=value`` asks for."""
    known = variants(effect)
    allowed = [f"{effect.tag}:{name}={choice}" for name, choices in known.items() for choice in choices]
    form = {}
    for part in asked.split(","):
        name, _, value = (word.strip() for word in part.partition("="))
        if value not in known.get(name, ()) or name in form:
            raise InputError(
                f"no form of {effect.tag}",
                key=key,
                value=text,
                allowed=", ".join(allowed) or f"{effect.tag}, which has one form",
                hint="a fit finds the values of its parameters by itself" if name in specs(effect) else None,
            )
        form[name] = value
    return form


def climb(prepared: Prepared, effects: Sequence[Form], tell: Tell) -> Climbed:
    """Fit the base along the measured motion, then each effect on top of the ones before it.

    Args:
        prepared: the data.
        effects: in this order.
        tell: told the stage and the share of it done.

    Raises:
        InputError: an effect only gives the backbone another shape, which is measured as it is.
        FitError: a model could not be fitted.
    """
    for tag, form in effects:
        _acts(tag, form)
    tell("the base model", 0.0)
    each = 1.0 / (len(effects) + 1)
    with portion(0.0, each, partial(tell, "the base model")):
        base = widened(fit_base(prepared.problem, prepared.start), [LEVEL], DISPERSION)
    first = Rung(("static",), None, static_residual(base), None, None)
    done = Climbed(prepared, (first, Rung.of(("static", "inertia"), "inertia", base)), {})
    for i, (tag, form) in enumerate(effects):
        tell(f"adding {tag}", (i + 1) * each)
        with portion((i + 1) * each, (i + 2) * each, partial(tell, f"adding {tag}")):
            done = extended(done, tag, form)
    return done


def extended(done: Climbed, tag: str, form: Mapping[str, str]) -> Climbed:
    """The ladder with an effect on top.

    Raises:
        InputError, FitError: as of :func:`climb`.
    """
    _acts(tag, form)
    base = done.fit
    with portion(0.0, 0.5):
        (found,) = try_effect(base, Explained(base), tag, [dict(form)])
    if found.fit is None:
        raise FitError(f"{tag} could not be fitted: {found.note or 'no finite model with it'}")
    with portion(0.5, 1.0):
        rung = Rung.of((*done.ladder[-1].model, tag), tag, settled(base, found))
    gain = max(base.cost - found.fit.cost, 0.0)
    return replace(done, ladder=(*done.ladder, rung), gains={**done.gains, tag: gain})


def shortened(done: Climbed, tag: str) -> Climbed:
    """The ladder with an effect taken out of its last model, which is fitted anew."""
    model = tuple(t for t in done.ladder[-1].model if t != tag)
    rung = Rung.of(model, None, without(done.fit, tag), tag)
    return replace(done, ladder=(*done.ladder, rung), gains={t: g for t, g in done.gains.items() if t != tag})


def replaced(done: Climbed, found: Fit) -> Climbed:
    """The ladder with another fit of its last model."""
    last = done.ladder[-1]
    return replace(done, ladder=(*done.ladder[:-1], Rung.of(last.model, last.added, found, last.removed)))


def _acts(tag: str, form: Mapping[str, str]) -> None:
    """Refuse what only gives the backbone another shape, and what is drawn at random."""
    if catalogue.get(tag).drawn:
        raise ArgumentError(
            "this effect is a random process, of which only size and length can be measured",
            key="effects", value=tag, hint="stickslip forecast estimates both; events may differ in any model",
        )  # fmt: skip
    if shapes_backbone(catalogue.get(tag)(**form)):
        raise ArgumentError(
            "the effect only changes the shape of the backbone, which the fit measures directly",
            key="effects",
            value=":".join([tag, *(f"{name}={value}" for name, value in form.items())]),
            hint="leave it out: its part is in the backbone already",
        )


def profiled(found: Fit, name: str, tell: Tell) -> Profile:
    """Profile likelihood of a shared parameter: held at values around its best one, all others refitted.

    Args:
        found: an optimum.
        name: of one of its free parameters.
        tell: told how many values are done.
    """
    USUAL = 9  # values
    k = [f.name for f in found.free].index(name)
    std = float(np.sqrt(max(found.covariance[k, k], 0.0)))
    return profile(
        name, float(found.point.z[k]), std, found.free[k].bounds,
        lambda value: held(found, name, value)[1] / DISPERSION,
        progress=lambda done: tell(f"profile of {name}: {done} values", min(done / USUAL, 1.0)),
    )  # fmt: skip
