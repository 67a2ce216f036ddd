"""Several effects at once, up to all, anywhere in their ranges: numbers, caps and energy hold as they do without."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.physics.effects import catalogue
from stickslip.physics.params import specs
from stickslip.simulation.conformance.dynamics import ACTIVE, GAIN
from stickslip.simulation.conformance.rig import DRIVE, STOPPED, TIGHT, Rig, march_step, prescribed

EFFECTS = tuple(catalogue.get(tag)() for tag in catalogue.tags())


@st.composite
def several(draw) -> dict[int, dict[str, float]]:
    """Index of the effect -> its parameters; both near the null and over the whole range."""
    chosen = draw(st.lists(st.integers(0, len(EFFECTS) - 1), min_size=1, max_size=3, unique=True))
    values = {}
    for index in chosen:
        values[index] = {}
        for name, spec in specs(EFFECTS[index]).items():
            low = spec.lower if np.isfinite(spec.lower) else -1e3
            high = spec.upper if np.isfinite(spec.upper) else 1e3
            share = draw(st.one_of(st.floats(0.0, 1.0), st.floats(-6.0, 0.0).map(lambda e: 10.0**e)))
            even = low > 0 and high / low > 100
            values[index][name] = float(low * (high / low) ** share) if even else float(low + share * (high - low))
    return values


def marched(rig: Rig) -> Callable:
    """Forces, caps and what is seen of the elements through a prescribed motion, of the vector of parameters."""
    motions = prescribed()

    @jax.jit
    def elements(p):
        model = rig.model(p)
        bank = model.shaped()

        def increment(state, motion):
            state, seen = march_step(model, bank, state, motion)
            return state, (state.force, state.cap, seen)

        return jax.lax.scan(increment, model.rest(), motions)[1]

    return elements


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_several_effects_anywhere_in_their_ranges():
    rig = Rig(EFFECTS)
    elements = marched(rig)
    used: Counter[str] = Counter()
    ends: Counter[str] = Counter()

    @settings(max_examples=200, deadline=None, derandomize=True, database=None)
    @given(several())
    def laws(values):
        p = rig.defaults.copy()
        for index, of in values.items():
            used[EFFECTS[index].tag] += 1
            for name, value in of.items():
                p[rig.at(index)[name]] = value
        force, cap, seen = elements(p)
        assert all(np.isfinite(part).all() for part in (force, cap, *seen))
        assert np.all(np.abs(force) <= np.asarray(cap) * (1 + 1e-9) + 1e-15)
        for drive in (DRIVE, STOPPED):
            outcome = rig.run(p, drive, TIGHT)
            n = int(outcome.accepted)
            s = jax.tree.map(lambda a, n=n: np.asarray(a[:n]), outcome.steps)
            ends["at the end" if s.t[-1] >= 0.55 - 1e-12 else "out of steps"] += 1
            assert all(np.isfinite(part).all() for part in s)
            assert np.all(np.diff(s.t) > 0)
            energy = s.stored - s.spring_work
            if drive is STOPPED and not {EFFECTS[i].family for i in values} & set(ACTIVE):
                assert np.max(energy - np.minimum.accumulate(energy)) <= GAIN * np.ptp(energy)

    laws()
    assert len(used) == len(EFFECTS)
    assert ends["at the end"] > 10 * ends["out of steps"], ends


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_all_effects_at_once():
    """Each at a fiftieth of its range: a model may hold any set, so also the whole catalogue."""
    rig = Rig(EFFECTS)
    p = rig.defaults.copy()
    for index, effect in enumerate(EFFECTS):
        spec = specs(effect)[effect.amplitude]
        null = spec.null or 0.0
        end = spec.upper if spec.upper - null >= null - spec.lower else spec.lower
        p[rig.at(index)[effect.amplitude]] = null + 0.02 * (end - null)
    outcome = rig.run(p, DRIVE, TIGHT)
    alone = rig.run(rig.defaults, DRIVE, TIGHT)
    n = int(outcome.accepted)
    s = jax.tree.map(lambda a: np.asarray(a[:n]), outcome.steps)
    assert s.t[-1] >= 0.55 - 1e-12
    assert all(np.isfinite(part).all() for part in s)

    force, cap, seen = marched(rig)(p)
    assert all(np.isfinite(part).all() for part in (force, cap, *seen))
    assert np.all(np.abs(force) <= np.asarray(cap) * (1 + 1e-9) + 1e-15)
    without = np.asarray(alone.steps.x)[: int(alone.accepted)]
    assert abs(s.x[-1] - without[-1]) > 1e-9
