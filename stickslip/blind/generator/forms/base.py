"""What a form of an effect may change, and how effects are listed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stickslip.errors import InputError, nearest

from .. import slots as S
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


Apply = Callable[[Setup, float, np.random.Generator], dict[str, Any]]


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


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
