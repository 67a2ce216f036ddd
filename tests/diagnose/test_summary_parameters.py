"""What a result says of a parameter beside its value."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stickslip.data.campaign import Rig
from stickslip.inference.diagnose.summary import parameters
from stickslip.inference.fit.parameters import effect_parameters
from stickslip.physics.effects import catalogue

NAME = "sensor-high-pass.cutoff"


@pytest.mark.parametrize(
    ("value", "std", "note"),
    [(4e-5, 4e-7, ""), (4e-5, 1e-4, "at its bound"), (0.0, 0.0, "at its bound"), (1.0, 2.0, "")],
)
def test_a_small_amplitude_that_is_well_known_is_not_at_its_bound(value, std, note):
    free = tuple(effect_parameters(catalogue.make("sensor-high-pass")))
    found: Any = SimpleNamespace(
        values={NAME: value}, std={NAME: std}, z=np.array([free[0].inward(value)]),
        composition=SimpleNamespace(free=free, fixed={}, mass=0.1),
    )  # fmt: skip
    fit: Any = SimpleNamespace(problem=SimpleNamespace(runs=[SimpleNamespace(prescribed=False)]))
    assert parameters(fit, found, Rig())[NAME]["note"] == note
