"""An effect made visible: one small rig with a hold, simulated with and without it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...physics.effects.base import Effect
from ...physics.params import specs
from ..conformance.gradients import present
from .load import make_scenario
from .simulation import simulate

if TYPE_CHECKING:
    import xarray

RIG: dict[str, Any] = {
    "schema": 1,
    "title": "demonstration",
    "block": {"mass": 0.0894, "spring_stiffness": 1000.0, "damping": 5.0},
    "drive": {
        "piece": [
            {"velocity": 2e-4, "duration": 2.5},
            {"velocity": 0.0, "duration": 2.0},
            {"velocity": 2e-4, "duration": 1.0},
        ]
    },
    "contact": {
        "kind": "power-law",
        "contacts": 4,
        "normal_force": 0.31,
        "friction_coefficient": 0.21,
        "u_max": 0.95e-6,
        "p": 3.3,
    },
    "weakening": {"ratio": 0.85, "slip_distance": 1e-6, "healing_time": 0.02},
    "output": {"sampling_rate": 10_000.0},
}


def typical_amplitude(cls: type[Effect]) -> float:
    """A fifth of the way from absent to the end of the plausible range that is further off."""
    return present(specs(cls)[cls.amplitude], 0.2)


def with_and_without(cls: type[Effect]) -> tuple[xarray.Dataset, xarray.Dataset, dict[str, float]]:
    """Data sets of `simulate` without and with an effect, and the amplitude it was given."""
    values = {cls.amplitude: float(f"{typical_amplitude(cls):.3g}")}
    without = simulate(make_scenario(RIG))
    with_it = simulate(make_scenario({**RIG, "effect": [{"type": cls.tag, **values}]}))
    return without, with_it, values
