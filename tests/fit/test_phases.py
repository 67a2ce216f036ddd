"""An oscillation has one frequency and amplitude in all runs, and in each the phase at which its record begins."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.diagnose.heldout import _starts
from stickslip.diagnose.periods import within_record
from stickslip.effects import catalogue
from stickslip.fit.composition import Composition, run_of
from stickslip.fit.parameters import Free, effect_parameters
from stickslip.fit.record import shared

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


def test_a_campaign_of_one_run_has_one_phase_and_one_of_three_has_three():
    from tests.diagnose.test_search import measurement  # shapes only

    for velocities, names in (((1e-4,), [f"{TAG}.phase"]), ((1e-4, 2e-4), [f"{TAG}.phase.0", f"{TAG}.phase.1"])):
        data = measurement(velocities, 7, ())
        free = within_record(catalogue.make(TAG), effect_parameters(catalogue.make(TAG)), data)
        assert [f.name for f in free if ".phase" in f.name] == names


@pytest.mark.parametrize("true", [-2.9, 0.4, 1.7])
def test_the_phase_of_a_run_that_no_fit_has_seen_is_told_by_its_slips(true):
    """As the elongation with which such a run begins is; the first cycle, which that decides, has no say in it."""
    made, n = composition(2), 8
    at = np.linspace(0.0, 3.0, n)

    def recurrences(phase):
        return 1.0 + 0.02 * np.sin(2 * np.pi * 1.37 * at + phase)

    values = np.ones((2, n, 1))
    values[1, :, 0] = recurrences(true)
    values[1, 0, 0] += 0.5
    used = np.ones((2, n), bool)
    m = SimpleNamespace(
        values=values, valid=np.ones_like(values, bool), cycles=SimpleNamespace(used=used),
        layout=SimpleNamespace(slices=lambda: {"recurrence": slice(0, 1)}),
    )  # fmt: skip
    names = [f.name for f in made.free]
    asked = []

    def again(z, events, run, model):
        f = made.free[names.index(f"{TAG}.phase.1")]
        asked.append(run)
        out = model.copy()
        out[1, :, 0] = recurrences(f.outward(z[names.index(f"{TAG}.phase.1")]))
        return out

    fit = SimpleNamespace(
        free=made.free, z=np.array([f.inward(f.start) for f in made.free]), events=None, offsets=np.zeros_like(values),
        use=np.array([[True] * n, [False] * n]), columns=np.zeros((2, n, 1, len(names))),
    )  # fmt: skip
    found = _starts(SimpleNamespace(measurement=m, again=again), fit, ~fit.use, np.ones_like(values))
    assert set(asked) == {1}  # the run that was fitted keeps its phase
    assert found[1, 1:, 0] == pytest.approx(values[1, 1:, 0], abs=5e-4)
    assert np.array_equal(found[0], np.ones((n, 1)))
