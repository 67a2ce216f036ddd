"""From a vector of free parameters to a model: what is measured, what is free, which effects are in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ..contact import power_law_bank
from ..effects.base import Effect
from ..forward import MOST_STEPS
from ..model import Block, LoadPoint, Model, Weakening
from .parameters import Free

START = "start."  # with the number of a run: when its first slip comes, where the record does not begin virgin


class Given(NamedTuple):
    """The numbers of a composition that a fit does not move; apart, so that one compiled program serves them all.

    Attributes:
        mass: of the block (kg).
        fixed: SI values of base parameters that are not free.
        effects: instances; their free fields are overwritten.
    """

    mass: Any
    fixed: dict[str, Any]
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Composition:
    """A family of models: the base with some effects, and which of their parameters are free.

    Attributes:
        mass: of the block (kg), unless it is free (``rig.mass``).
        contacts: number of contacts.
        bins: Jenkins elements of the bank.
        free: the free parameters, base first.
        fixed: SI values of base parameters that are not free.
        effects: instances; their free fields are overwritten from the vector.
        most_steps: of the integration of one cycle.
    """

    mass: float
    contacts: int
    bins: int
    free: tuple[Free, ...]
    fixed: dict[str, float] = field(default_factory=dict)
    effects: tuple[Effect, ...] = ()
    most_steps: int = MOST_STEPS

    def given(self) -> Given:
        """What is not free, as arrays."""
        return Given(
            jnp.asarray(self.mass), {name: jnp.asarray(value) for name, value in self.fixed.items()}, self.effects
        )

    def model(
        self,
        z: Array,
        event: Array,
        nodes: Any,
        stiffness: Array,
        given: Given | None = None,
        start: tuple[Any, Any, Any] | None = None,
    ) -> Model:
        """The model of one cycle.

        Args:
            z: free parameters on the search scale, shape (n,).
            event: ln factors on u_max and p in this cycle, shape (2,).
            nodes: times and positions of the load point.
            stiffness: of the spring where the run has its own, else nan (N/m).
            given: the numbers that are not free; default this composition's own.
            start: number of the run, whether it starts virgin, and load point less block at its onsets (m);
                default virgin.
        """
        given = self.given() if given is None else given
        v = given.fixed | {
            f.name: jnp.exp(x) if f.scale == "log" else x * float(f.scale) for f, x in zip(self.free, z, strict=True)
        }
        bank = power_law_bank(
            v["contact.strength"],
            v["contact.u_max"] * jnp.exp(event[0]),
            1.0 + (v["contact.p"] - 1.0) * jnp.exp(event[1]),
            v["contact.spread"],
            contacts=self.contacts,
            n=self.bins,
        )
        spring = jnp.where(jnp.isnan(stiffness), v["rig.spring_stiffness"], stiffness)
        block = Block(
            mass=v.get("rig.mass", given.mass),
            spring_stiffness=spring,
            damping=v["rig.damping"],
        )
        weakening = Weakening(
            ratio=1.0 - v["weakening.drop"],
            slip_distance=v["weakening.slip_distance"],
            healing_time=v["weakening.healing_time"],
        )
        return Model(
            block,
            bank,
            weakening,
            LoadPoint(nodes[0], nodes[1], self._stretch(v, spring, start)),
            tuple(self._set(e, v) for e in given.effects),
        )

    def _stretch(self, v: dict[str, Array], spring: Array, start: tuple[Any, Any, Any] | None) -> Array:
        """Elongation of the spring at the start of the record: the contact slips first at its full strength, or a
        little (``start.<run>``) of the load point's travel later."""
        if start is None:
            return jnp.zeros(())
        run, virgin, seen = start
        own = [(int(f.name[len(START) :]), v[f.name]) for f in self.free if f.name.startswith(START)]
        later = sum((jnp.where(run == r, value, 0.0) for r, value in own), jnp.zeros(()))
        return jnp.where(virgin, 0.0, v["contact.strength"] / spring - seen + later)

    def _set(self, effect: Effect, values: dict[str, Array]) -> Effect:
        mine = {k.split(".", 1)[1]: v for k, v in values.items() if k.split(".", 1)[0] == effect.tag}
        for name, value in mine.items():
            effect = eqx.tree_at(attrgetter(name), effect, value)
        return effect

    def with_effect(self, effect: Effect, free: Sequence[Free]) -> Composition:
        """The same with one effect more."""
        return replace(self, free=(*self.free, *free), effects=(*self.effects, effect))

    def without(self, tag: str) -> Composition:
        """The same without an effect and its parameters."""
        free = tuple(f for f in self.free if not f.name.startswith(f"{tag}."))
        effects = tuple(e for e in self.effects if e.tag != tag)
        return replace(self, free=free, effects=effects)

    def key(self) -> tuple[Any, ...]:
        """What decides about a compilation: everything but the numbers of :meth:`given` and the free ones."""
        names = tuple((f.name, f.scale) for f in self.free)
        fixed, effects = tuple(sorted(self.fixed)), jax.tree.structure(self.effects)
        return self.contacts, self.bins, self.most_steps, names, fixed, effects
