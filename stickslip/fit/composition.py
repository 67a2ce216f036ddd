"""From a vector of free parameters to a model: what is measured, what is free, which effects are in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from ..contact import power_law_bank
from ..effects.base import Effect
from ..model import Block, LoadPoint, Model, Weakening
from .parameters import Free

EVENT_WIDTHS = (0.12, 0.08)  # prior s.d. of ln(u_max) and ln(p) from event to event where lines are new every time


@dataclass(frozen=True)
class Composition:
    """A family of models: the base with some effects, and which of their parameters are free.

    Attributes:
        mass: of the block (kg).
        contacts: number of contacts.
        bins: Jenkins elements of the bank.
        free: the free parameters, base first.
        fixed: SI values of base parameters that are not free.
        effects: instances; their free fields are overwritten from the vector.
    """

    mass: float
    contacts: int
    bins: int
    free: tuple[Free, ...]
    fixed: dict[str, float] = field(default_factory=dict)
    effects: tuple[Effect, ...] = ()

    def outward(self, z: Array) -> dict[str, Array]:
        """Search scale -> SI, traceable."""
        fixed = {name: jnp.asarray(value) for name, value in self.fixed.items()}
        return fixed | {
            f.name: jnp.exp(v) if f.scale == "log" else v * float(f.scale) for f, v in zip(self.free, z, strict=True)
        }

    def model(self, z: Array, event: Array, nodes: Any, stiffness: Array) -> Model:
        """The model of one cycle.

        Args:
            z: free parameters on the search scale, shape (n,).
            event: ln factors on u_max and p in this cycle, shape (2,).
            nodes: times and positions of the load point.
            stiffness: of the spring where the run has its own, else nan (N/m).
        """
        v = self.outward(z)
        bank = power_law_bank(
            v["contact.strength"],
            v["contact.u_max"] * jnp.exp(event[0]),
            1.0 + (v["contact.p"] - 1.0) * jnp.exp(event[1]),
            v["contact.spread"],
            contacts=self.contacts,
            n=self.bins,
        )
        block = Block(
            mass=jnp.asarray(self.mass),
            spring_stiffness=jnp.where(jnp.isnan(stiffness), v["rig.spring_stiffness"], stiffness),
            damping=v["rig.damping"],
        )
        weakening = Weakening(
            ratio=1.0 - v["weakening.drop"],
            slip_distance=v["weakening.slip_distance"],
            healing_time=v["weakening.healing_time"],
        )
        return Model(block, bank, weakening, LoadPoint(*nodes), tuple(self._set(e, v) for e in self.effects))

    def _set(self, effect: Effect, values: dict[str, Array]) -> Effect:
        mine = {k.split(".", 1)[1]: v for k, v in values.items() if k.split(".", 1)[0] == effect.tag}
        for name, value in mine.items():
            effect = eqx.tree_at(attrgetter(name), effect, value)
        return effect

    def with_effect(self, effect: Effect, free: Sequence[Free]) -> Composition:
        """The same with one effect more."""
        return Composition(
            self.mass, self.contacts, self.bins, (*self.free, *free), self.fixed, (*self.effects, effect)
        )

    def key(self) -> tuple[Any, ...]:
        """What decides about a compilation."""
        return (
            self.contacts,
            self.bins,
            tuple((f.name, f.scale) for f in self.free),
            tuple(sorted(self.fixed)),
            tuple(
                (type(e), tuple(sorted((k, v) for k, v in vars(e).items() if isinstance(v, str)))) for e in self.effects
            ),
        )
