"""What a form of an effect may change, and how effects are listed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from stickslip.errors import InputError, nearest

from .. import array_layout as S
from ..dynamics import Rig
from ..lines import Array, Surface
from ..sensor import Sensor


@dataclass
class Setup:
    """One apparatus, before it is run: everything an effect can touch."""

    rig: Rig = field(default_factory=Rig)
    surface: Surface = field(default_factory=Surface)
    sensor: Sensor = field(default_factory=Sensor)
    effects: Array = field(default_factory=lambda: np.zeros(S.EFFECT_SIZE))
    relaxation: tuple[float, float] = (0.05, 0.0)
    roughness_spread: Array | None = None
    groups: int | None = 128

    def put(self, **slots: float) -> dict[str, float]:
        """Set slots of the kernel by name; returns them as the record of the inner parameters."""
        for name, value in slots.items():
            self.effects[S.EFFECT_SLOTS[name]] = value
        return dict(slots)

    def with_rig(self, **changes: Any) -> None:
        self.rig = replace(self.rig, **changes)

    def with_surface(self, **changes: Any) -> None:
        self.surface = replace(self.surface, **changes)

    def with_sensor(self, **changes: Any) -> None:
        self.sensor = replace(self.sensor, **changes)


Rng = np.random.Generator
Apply = Callable[[Setup, float, Rng], dict[str, Any]]
FormApply = Callable[..., dict[str, Any]]  # takes the ``form`` as well
Draw = Callable[[Rng], float]


@dataclass(frozen=True)
class Form:
    """One functional form of an effect; ``own`` where it is not the one that textbooks print."""

    name: str
    own: bool
    apply: Apply


@dataclass(frozen=True)
class Effect:
    """A hidden effect.

    Attributes:
        unit: unit of the amplitude.
        low, high: plausible range of its size where slips still occur.
        detect: smallest amplitude that noise alone would let one see at five standard deviations, if known.
        signed: whether either sign makes sense.
        inside: whether its tag is one of a published catalogue of effects (else nothing known should explain it).
        sign: the sign it has where only one makes sense.
    """

    tag: str
    unit: str
    low: float
    high: float
    forms: tuple[Form, ...]
    detect: float | None = None
    signed: bool = False
    inside: bool = True
    sign: float = 1.0
    decoy: bool = False

    def draw(self, rng: np.random.Generator) -> float:
        """An amplitude, log-uniform over the plausible range."""
        size = float(np.exp(rng.uniform(np.log(self.low), np.log(self.high))))
        if self.signed:
            return size * (1.0 if rng.random() < 0.5 else -1.0)
        return size * self.sign

    def pick(self, name: str | None, rng: np.random.Generator) -> Form:
        if name is None:
            return self.forms[int(rng.integers(len(self.forms)))]
        for form in self.forms:
            if form.name == name:
                return form
        raise InputError(f"'{self.tag}' has no form '{name}'", hint=nearest(name, [form.name for form in self.forms]))


def forms(apply: FormApply, textbook: Mapping[str, Any], own: Mapping[str, Any]) -> tuple[Form, ...]:
    """The forms of an effect, name -> the ``form`` that ``apply`` takes; those of textbooks first."""
    every = [(False, *item) for item in textbook.items()] + [(True, *item) for item in own.items()]
    return tuple(Form(name, is_own, partial(apply, form=form)) for is_own, name, form in every)


def slots(amplitude: str, form: str | None = None, **drawn: Draw) -> FormApply:
    """Puts the amplitude, what is drawn and the number of the form into slots of the kernel, drawn in this order."""

    def apply(setup: Setup, size: float, rng: Rng, **chosen: float) -> dict[str, Any]:
        inner = {name: draw(rng) for name, draw in drawn.items()}
        return setup.put(**{amplitude: size}, **inner, **({} if form is None else {form: chosen["form"]}))

    return apply


def between(low: float, high: float) -> Draw:
    """Draws log-uniformly."""
    return lambda rng: log_uniform(rng, low, high)


def phase(rng: Rng) -> float:
    """Draws a share of a period."""
    return rng.random()


def log_uniform(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
