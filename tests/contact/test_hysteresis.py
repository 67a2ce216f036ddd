"""Masing and return-point memory: the turning points against thousands of springs."""

import numpy as np
import pytest

from stickslip.physics.contact import (
    Hysteresis,
    RoughLines,
    power_law_backbone,
    power_law_bank,
    static_contact,
)
from tests.solve.ringing import microslip_ring_down

from .springs import spring_bank

F_S, U_MAX, P = 0.2604, 1e-6, 3.2


class Springs:
    """Every spring with its own return map, in numpy."""

    def __init__(self, bank):
        keep = np.asarray(bank.stiffness) > 0
        self.k, self.cap = np.asarray(bank.stiffness)[keep], np.asarray(bank.strength)[keep]
        self.f, self.u = np.zeros(self.k.size), 0.0

    def move_to(self, u):
        self.f, self.u = np.clip(self.f + self.k * (u - self.u), -self.cap, self.cap), u
        return self.f.sum()

    def virgin(self, u):
        return np.minimum(self.k * np.asarray(u)[..., None], self.cap).sum(axis=-1)


def rough_springs():
    """The touching springs of four rough lines."""
    table = RoughLines(n_springs=16384, lines=4, seed=1).indentation
    return Springs(spring_bank(static_contact(table, 0.31, 0.21)))


@pytest.fixture(scope="module")
def rough():
    springs = rough_springs()
    assert springs.k.size > 4000
    return springs


def fresh(springs):
    new = Springs.__new__(Springs)
    new.k, new.cap, new.f, new.u = springs.k, springs.cap, np.zeros(springs.k.size), 0.0
    return new, Hysteresis(springs.virgin)


def masing_error(rough):
    """Largest departure of loops from twice the virgin curve, over full friction."""
    errors = []
    for u_a in (0.2e-6, 0.6e-6, 2e-6):
        springs, _ = fresh(rough)
        f_a = springs.move_to(u_a)
        for u in np.linspace(u_a, -u_a, 20)[1:]:
            errors.append(springs.move_to(u) - (f_a - 2 * rough.virgin((u_a - u) / 2)))
        f_b = springs.f.sum()
        for u in np.linspace(-u_a, u_a, 20)[1:]:
            errors.append(springs.move_to(u) - (f_b + 2 * rough.virgin((u + u_a) / 2)))
    return np.abs(errors).max() / F_S


def test_masing(rough):
    assert masing_error(rough) < 1e-12


def test_return_point_memory(rough):
    """A reload that reaches the turning point it left goes on as if it had never turned, small loops and all."""
    straight, _ = fresh(rough)
    at, beyond = straight.move_to(0.6e-6), straight.move_to(0.75e-6)
    for factory in (0, 1):
        wandering = fresh(rough)[factory]
        wandering.move_to(0.6e-6)
        for u in (0.1e-6, 0.5e-6, 0.3e-6, 0.45e-6, 0.35e-6):
            wandering.move_to(u)
        assert wandering.move_to(0.6e-6) == pytest.approx(at, abs=1e-12 * F_S)
        assert wandering.move_to(0.75e-6) == pytest.approx(beyond, abs=1e-12 * F_S)


SCALES = (0.3, 1.0, 3.0)  # of random walks


def walk_error(rough, seed, scale):
    """Largest difference of turning points and springs on a random walk, over full friction."""
    rng = np.random.default_rng(seed)
    springs, stack = fresh(rough)
    u, errors = 0.0, []
    for _ in range(60):
        u = rng.choice([rng.normal() * scale * 0.5e-6, u + rng.normal() * 3e-8, -u])
        errors.append(stack.move_to(u) - springs.move_to(u))
    return np.abs(errors).max() / F_S


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("scale", SCALES)
def test_turning_points_equal_springs_on_random_walks(rough, seed, scale):
    assert walk_error(rough, seed, scale) < 1e-12


def test_closed_loops_are_forgotten():
    stack = Hysteresis(lambda u: power_law_backbone(u, U_MAX, F_S, P))
    for u in (5e-7, 1e-7, 4e-7, 2e-7, 3e-7):
        stack.move_to(u)
    assert len(stack.turning_points) == 4
    stack.move_to(4.5e-7)
    assert [u for u, _ in stack.turning_points] == [5e-7, 1e-7]
    stack.move_to(6e-7)
    assert stack.turning_points == ()
    assert stack.force == float(power_law_backbone(6e-7, U_MAX, F_S, P))


def test_inner_loops_between_the_same_limits_are_congruent(rough):
    def loop(way):
        springs, _ = fresh(rough)
        for u in way:
            springs.move_to(u)
        start = springs.move_to(2e-7)
        return np.array([springs.move_to(u) - start for u in (2.5e-7, 3e-7, 2.5e-7, 2e-7)])

    assert np.allclose(loop([6e-7, 2e-7, 3e-7]), loop([-6e-7, 3e-7]), rtol=0, atol=1e-12 * F_S)


@pytest.mark.parametrize("amplitude", [20e-9, 50e-9, 100e-9])
def test_ring_down_by_microslip_is_hyperbolic(amplitude):
    """A free block on the springs, leapfrog: its maxima against the law."""
    bank = power_law_bank(F_S, U_MAX, P, n=256)
    k, cap, mass = np.asarray(bank.stiffness), np.asarray(bank.strength), 0.0894
    omega = np.sqrt(k.sum() / mass)
    dt = 2 * np.pi / omega / 400
    f = np.zeros(k.size)
    for start in (amplitude, -amplitude, amplitude):  # on the loop of this amplitude
        f = np.clip(f + k * (start if start > 0 and not f.any() else 2 * start), -cap, cap)
    x, v, peaks, acceleration = amplitude, 0.0, [(0.0, amplitude)], -f.sum() / mass
    for step in range(1, 400 * 15):
        v_half = v + 0.5 * dt * acceleration
        f = np.clip(f + k * v_half * dt, -cap, cap)
        x, acceleration = x + v_half * dt, -f.sum() / mass
        before, v = v, v_half + 0.5 * dt * acceleration
        if before > 0 >= v:
            peaks.append((step * dt, x))
    t, peak = np.array(peaks).T
    law = microslip_ring_down(t, amplitude, omega, U_MAX, P)
    assert peak[-1] < 0.8 * amplitude
    assert np.abs(peak / law - 1).max() < 0.05
