"""From a vector of free parameters to a model: what is measured, what is free, which effects are in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ...physics.contact import power_law_bank
from ...physics.effects.base import Effect
from ...physics.model import Block, LoadPoint, Model, Weakening
from ...simulation.shooting import MOST_STEPS
from .parameters import Free, to_si, vector

START = "start."  # with the number of a run: when its first slip comes, where the record does not begin virgin
PHASE = "phase"  # of an effect that is periodic; with the number of a run, for no record begins where another did


def run_of(name: str) -> int | None:
    """The run that a parameter belongs to, or None where it belongs to the model."""
    head, _, number = name.rpartition(".")
    own = head + "." == START or head.endswith(f".{PHASE}")
    return int(number) if own and number.isdigit() else None


class Numbers(NamedTuple):
    """The numbers of a model, whether a fit moves them or not: one compiled program serves them all.

    Attributes:
        values: SI value of every parameter of the base and of the effects, by name.
        effects: instances, whose fields ``values`` overwrites.
    """

    values: dict[str, Any]
    effects: tuple[Effect, ...]


class Family(NamedTuple):
    """What decides about a compiled program: of a composition all but its numbers and which of them are free.

    Attributes:
        contacts, bins, most_steps: as of :class:`Composition`.
        names: of all parameters.
        structure: of the effects.
    """

    contacts: int
    bins: int
    most_steps: int
    names: tuple[str, ...]
    structure: Any

    def model(
        self,
        numbers: Numbers,
        event: Array,
        nodes: Any,
        stiffness: Array,
        start: tuple[Any, Any, Any] | None = None,
    ) -> Model:
        """The model of one cycle.

        Args:
            numbers: of the composition.
            event: ln factors on u_max and p in this cycle, shape (2,).
            nodes: times and positions of the load point.
            stiffness: of the spring where the run has its own, else nan (N/m).
            start: how much later than at its full strength the contact first slips (m of the load point's travel),
                whether the run starts virgin, and load point less block at its onsets (m); default virgin.
        """
        v = numbers.values
        bank = power_law_bank(
            v["contact.strength"],
            v["contact.u_max"] * jnp.exp(event[0]),
            1.0 + (v["contact.p"] - 1.0) * jnp.exp(event[1]),
            v["contact.spread"],
            contacts=self.contacts,
            n=self.bins,
        )
        spring = jnp.where(jnp.isnan(stiffness), v["rig.spring_stiffness"], stiffness)
        block = Block(mass=v["rig.mass"], spring_stiffness=spring, damping=v["rig.damping"])
        weakening = Weakening(
            ratio=1.0 - v["weakening.drop"],
            slip_distance=v["weakening.slip_distance"],
            healing_time=v["weakening.healing_time"],
        )
        stretch = jnp.zeros(())
        if start is not None:
            later, virgin, seen = start
            stretch = jnp.where(virgin, 0.0, v["contact.strength"] / spring - seen + later)
        load_point = LoadPoint(nodes[0], nodes[1], stretch)
        return Model(block, bank, weakening, load_point, tuple(_set(e, v) for e in numbers.effects))


def _set(effect: Effect, values: dict[str, Array]) -> Effect:
    mine = {k.split(".", 1)[1]: v for k, v in values.items() if k.split(".", 1)[0] == effect.tag}
    for name, value in mine.items():
        effect = eqx.tree_at(attrgetter(name), effect, value)
    return effect


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

    def family(self) -> Family:
        """What compiles to one program."""
        names = tuple(sorted(self._fixed() | self._moved()))
        return Family(self.contacts, self.bins, self.most_steps, names, jax.tree.structure(self.effects))

    def numbers(self, z: np.ndarray, run: int | None = None) -> Numbers:
        """All numbers, the free ones at ``z`` on the search scale, shape (n,); phases are those of a ``run``."""
        values = self._fixed() | self._moved(z, run)
        return Numbers({name: np.float64(value) for name, value in sorted(values.items())}, self.effects)

    def _fixed(self) -> dict[str, float]:
        return {"rig.mass": self.mass, **self.fixed}

    def _moved(self, z: np.ndarray | None = None, run: int | None = None) -> dict[str, float]:
        moved = to_si(self.free, vector(self.free) if z is None else z)
        out = {name: value for name, value in moved.items() if run_of(name) is None}
        for name, value in moved.items():
            head, own = name.rpartition(".")[0], run_of(name)
            if own is not None and not name.startswith(START) and (own == run or head not in out):
                out[head] = value  # without a run the phase is that in the first
        return out

    def later(self, z: np.ndarray, run: int) -> float:
        """How much later than at full strength a run that does not begin virgin first slips (m of the drive's way)."""
        return to_si(self.free, z).get(f"{START}{run}", 0.0)

    def model(self, z: np.ndarray, event: Array, nodes: Any, stiffness: Array) -> Model:
        """The model of a cycle of a virgin contact; arguments as of :meth:`Family.model`."""
        return self.family().model(self.numbers(z), event, nodes, stiffness)

    def with_effect(self, effect: Effect, free: Sequence[Free]) -> Composition:
        """The same with one effect more."""
        return replace(self, free=(*self.free, *free), effects=(*self.effects, effect))

    def without(self, tag: str) -> Composition:
        """The same without an effect and its parameters."""
        free = tuple(f for f in self.free if not f.name.startswith(f"{tag}."))
        effects = tuple(e for e in self.effects if e.tag != tag)
        return replace(self, free=free, effects=effects)
