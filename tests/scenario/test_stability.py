"""Stability of steady sliding against the roots of its characteristic equation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stickslip.simulation.scenario.schema import BlockTable, WeakeningTable
from stickslip.simulation.scenario.stability import steady_sliding


def growth(block: BlockTable, law: WeakeningTable, strength: float, velocity: float) -> float:
    """Largest real part of the roots of m s^3 + (c + m r) s^2 + (c_s + c r - K) s + c_s r."""
    m, c, k = block.mass, block.damping, block.spring_stiffness
    share = 1 + velocity * law.healing_time / law.slip_distance
    r = share / law.healing_time
    fall = (1 - law.ratio) * strength / law.slip_distance / share
    return float(np.roots([m, c + m * r, k + c * r - fall, k * r]).real.max())


def random_rigs(n: int = 300):
    rng = np.random.default_rng(7)
    for _ in range(n):
        block = BlockTable(
            mass=10 ** rng.uniform(-2, 0), spring_stiffness=10 ** rng.uniform(2, 5), damping=10 ** rng.uniform(-1, 1.5)
        )
        law = WeakeningTable(
            ratio=rng.uniform(0.5, 0.98), slip_distance=10 ** rng.uniform(-7, -5), healing_time=10 ** rng.uniform(-3, 0)
        )
        yield block, law, 0.26, 10 ** rng.uniform(-6, -2)


def test_verdict_is_that_of_the_roots():
    seen = set()
    for block, law, strength, velocity in random_rigs():
        rate = growth(block, law, strength, velocity)
        if abs(rate) < 1e-6:
            continue
        stable = steady_sliding(block, law, strength, velocity).stable
        assert stable == (rate < 0)
        seen.add(stable)
    assert seen == {True, False}


def test_critical_values_are_where_the_roots_cross():
    checked = 0
    for block, law, strength, velocity in random_rigs(80):
        found = steady_sliding(block, law, strength, velocity)
        if 0 < found.critical_velocity < math.inf:
            above, below = (growth(block, law, strength, s * found.critical_velocity) for s in (1.001, 0.999))
            assert above < 0 < below
            checked += 1
        if 0 < found.critical_stiffness < math.inf:
            stiff, soft = (
                growth(
                    block.model_copy(update={"spring_stiffness": s * found.critical_stiffness}), law, strength, velocity
                )
                for s in (1.001, 0.999)
            )
            assert stiff < 0 < soft
            checked += 1
    assert checked > 40


def test_limit_of_small_damping():
    """Where m r is large against c the boundary is v0 = sqrt(dF v_c/c) - v_c."""
    block = BlockTable(mass=0.0894, spring_stiffness=1000.0, damping=0.5)
    law = WeakeningTable(ratio=0.85, slip_distance=1e-6, healing_time=0.02)
    v_c = 1e-6 / 0.02
    expected = math.sqrt(0.15 * 0.2604 * v_c / 0.5) - v_c
    assert steady_sliding(block, law, 0.2604, 5e-5).critical_velocity == pytest.approx(expected, rel=0.15)


def test_without_damping_sliding_is_never_stable():
    block = BlockTable(mass=0.1, spring_stiffness=1e8, damping=0.0)
    found = steady_sliding(block, WeakeningTable(), 0.26, 1.0)
    assert not found.stable
    assert math.isinf(found.critical_velocity)
    assert math.isinf(found.critical_stiffness)
