"""An oscillation has one frequency and amplitude in all runs, and in each the phase at which its record begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.inference.fit.composition import Composition, run_of
from stickslip.inference.fit.parameters import Free, effect_parameters
from stickslip.inference.fit.serialised import shared
from stickslip.physics.effects import catalogue

TAG = "base-vibration"


@pytest.mark.parametrize(
    ("name", "run"),
    [
        ("start.2", 2), ("base-vibration.phase.11", 11), ("base-vibration.phase", None), ("contact.p", None),
        ("rig.spring_stiffness", None), ("my-effect.level.2", None),
    ],
)  # fmt: skip
def test_a_parameter_of_one_run_is_known_by_its_name(name, run):
    assert run_of(name) == run
    assert shared(name) is (run is None)


def composition(runs: int) -> Composition:
    base = Free("contact.strength", "N", "log", 0.2, 0.2, 1.0, 0.01, 10.0)
    own = effect_parameters(catalogue.make(TAG))
    phases = [f for f in own if f.name.endswith("phase")]
    others = [f for f in own if f not in phases]
    each = [replace(f, name=f"{f.name}.{r}") for f in phases for r in range(runs)]
    return Composition(0.1, 1, 8, (base,)).with_effect(catalogue.make(TAG), [*others, *each])


def test_every_run_has_its_own_phase_and_all_else_in_common():
    made = composition(3)
    z = np.array([f.inward(f.start) for f in made.free])
    wanted = {0: 0.3, 1: -1.2, 2: 2.5}
    for i, f in enumerate(made.free):
        if run_of(f.name) is not None:
            z[i] = f.inward(wanted[run_of(f.name)])
    found = [made.numbers(z, r).values for r in range(3)]
    assert [v[f"{TAG}.phase"] for v in found] == pytest.approx(list(wanted.values()))
    assert len({v[f"{TAG}.frequency"] for v in found}) == 1
    assert all(set(v) == set(made.family().names) for v in found)  # one compiled program serves them all
    assert made.numbers(z).values[f"{TAG}.phase"] == pytest.approx(0.3)
    assert made.without(TAG).free == made.free[:1]
