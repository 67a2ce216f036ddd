"""The base with some effects, and which parameters of it are free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...physics.effects.base import Effect
from ..fit.parameters import Free

Array = NDArray[np.float64]
PHASE = "phase"
DAMPING = "rig.damping"
BESIDE = "rig.parallel_stiffness"  # of a spring beside the contact, which never slides (N/m)
SCALE = "sensor.force_scale"  # measured over true force of the spring, where nothing else was measured (1)
PULL = "start.pull"  # of the spring at the start of a record, where the contact is not virgin (N)


@dataclass(frozen=True)
class Composition:
    """The base with some effects, and what of it is free.

    Attributes:
        mass: of the block (kg).
        reach: yield displacements of the bank's elements (m), shape (k,), increasing.
        free: free parameters of base and effects, those called "phase" for every run.
        fixed: SI values of base parameters that are not free.
        effects: instances; their free fields are overwritten.
        nominal: what is known of the full strength beforehand (N), and the standard deviation of its logarithm.
    """

    mass: float
    reach: Array
    free: tuple[Free, ...]
    fixed: dict[str, float] = field(default_factory=dict)
    effects: tuple[Effect, ...] = ()
    nominal: tuple[float, float] = (1.0, np.inf)

    @property
    def shared(self) -> tuple[Free, ...]:
        """Free parameters with one value for all runs."""
        return tuple(f for f in self.free if not is_own(f.name))

    @property
    def phases(self) -> tuple[Free, ...]:
        """Free parameters with a value for every run."""
        return tuple(f for f in self.free if is_own(f.name))

    def with_effect(self, effect: Effect, free: Sequence[Free]) -> Composition:
        """The same with one effect more."""
        return replace(self, free=(*self.free, *free), effects=(*self.effects, effect))

    def without(self, tag: str) -> Composition:
        """The same without an effect."""
        return replace(
            self,
            free=tuple(f for f in self.free if not f.name.startswith(f"{tag}.")),
            effects=tuple(e for e in self.effects if e.tag != tag),
        )


def is_own(name: str) -> bool:
    """Whether a parameter has a value for every run."""
    return name == PULL or name.rpartition(".")[2] == PHASE
