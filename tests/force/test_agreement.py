"""The force that a law holds along a given motion is that which the solver found when it made the motion.

The solver's steps know how the velocity changes within them: where the block turns and elements stick. Everything but
that is the same to rounding: up to the first turning point as it is, beyond it with the bends of the path told.
"""

from __future__ import annotations

from functools import lru_cache

import equinox as eqx
import numpy as np
import pytest

from stickslip.physics.contact import Bank
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import Sensor
from stickslip.simulation.solve import Tolerance

from . import solver_motion

EXACT = 1e-10  # of the strength
UNTOLD = 1e-3  # of the strength: bends not told, where a step at an arrest is some hundredths of the healing time
SHARES = {"direct-effect": 0.02, "rate-and-state": 0.02}  # more of them, and the block slides for ever


@lru_cache(maxsize=64)
def slips(name: str) -> solver_motion.Slips:
    law = next(law for law in solver_motion.LAWS if solver_motion.named(law) == name)
    return solver_motion.simulated(solver_motion.effects_with(law, SHARES.get(law[0], 0.1)))


QUICK = {"viscous-drag"}


def every_law(laws):
    """Parameters of a test, those that take long to compile marked as slow."""
    names = [solver_motion.named(law) for law in laws]
    return pytest.mark.parametrize(
        "name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in names]
    )


def wrong(found: solver_motion.Slips, until: int | None = None, bends: bool = True) -> float:
    """Largest difference of the two forces, over the strength."""
    apart = solver_motion.held(found, bends).contact - found.steps.contact_force
    return float(np.abs(apart[:until]).max() / solver_motion.STRENGTH)


@pytest.fixture(scope="module")
def base() -> solver_motion.Slips:
    return solver_motion.simulated(())


def test_the_base_model_holds_what_the_solver_found(base):
    v = base.steps.v
    assert np.count_nonzero((v[1:] > 1e-3) & (v[:-1] <= 1e-3)) >= 3  # slips
    assert base.turned > 40  # the first loading
    assert wrong(base, base.turned, bends=False) < EXACT
    assert wrong(base) < EXACT


def test_bends_within_a_step_are_all_that_is_missing():
    """They matter by less than one in a thousand, and less in shorter steps: by what caps grow back within one."""
    coarse, finer = (
        solver_motion.simulated((), Tolerance(f, 1e-8 * f, 1e-5 * f), 3 * solver_motion.KNOTS) for f in (2e-3, 5e-5)
    )
    assert 1e-6 < wrong(coarse, bends=False) < UNTOLD
    assert wrong(finer, bends=False) < 0.3 * wrong(coarse, bends=False)


@every_law(solver_motion.LAWS)
def test_every_law_holds_what_the_solver_found(name):
    found = slips(name)
    assert found.steps.x[-1] > 140e-6  # it slips
    assert found.turned < found.steps.t.size - 50  # and sticks again
    assert wrong(found) < EXACT  # told from the start: a drive that ripples slows what slides before the block turns
    pull = solver_motion.held(found).pull
    np.testing.assert_allclose(pull, found.steps.spring_force, rtol=1e-12, atol=1e-14)


@every_law([law for law in solver_motion.LAWS if not catalogue.get(law[0]).measured])
def test_the_law_is_in_the_force(name, base):
    """Every law does something along the base's motion, but those of the sensor, which move nothing."""
    found = slips(name)
    plain = solver_motion.at_steps(solver_motion.march(base.model, base.way), base)
    law = solver_motion.at_steps(solver_motion.march(found.model, base.way), base)
    changed = max(
        float(np.abs(getattr(law, part) - getattr(plain, part)).max()) for part in ("pull", "body", "contact")
    )
    sensor = issubclass(catalogue.get(name.split()[0]), Sensor) and name != "machine-compliance series"
    if sensor:
        assert changed < 1e-12 * solver_motion.STRENGTH
    elif name.split()[0] != "inertia":  # which is in the mass
        assert changed > 1e-6 * solver_motion.STRENGTH


def test_elements_add_up_to_the_contact(base):
    held = solver_motion.held(base)
    strength = np.asarray(base.model.bank.strength)
    np.testing.assert_allclose(held.elements @ strength, held.contact, rtol=0.0, atol=1e-14)
    assert np.abs(held.elements).max() <= 1.0 + 1e-9


def test_the_tangent_is_that_of_what_sticks(base):
    """A virgin contact loaded one way is as stiff as its tangent before and after let expect."""
    x = np.linspace(0.0, 1.5e-6, 400)
    way = solver_motion.way_of(np.linspace(0.0, 10.0, x.size), x, np.full(x.size, 1.5e-7))
    held = solver_motion.march(base.model, way)
    contact, tangent = (np.asarray(a)[: x.size] for a in (held.contact, held.tangent))
    slope = np.diff(contact) / np.diff(x)
    slack = 2e-3 * tangent[0]  # weakening sets in
    assert np.all(slope <= tangent[:-1] + slack)
    assert np.all(slope >= tangent[1:] - slack)
    assert np.all(np.diff(tangent) <= 1e-9 * tangent[0])
    assert tangent[0] == pytest.approx(float(np.sum(base.model.bank.stiffness)))
    assert tangent[-1] == 0.0


def test_strength_and_stretch_of_an_event_are_those_of_its_elements(base):
    bank = base.model.bank
    scaled = eqx.tree_at(lambda m: m.bank, base.model, Bank(bank.stiffness * 1.1 / 1.3, bank.strength * 1.1))
    way = base.way._replace(strength=1.1 * base.way.strength, stretch=1.3 * base.way.stretch)
    of_event, of_bank = solver_motion.march(base.model, way), solver_motion.march(scaled, base.way)
    np.testing.assert_allclose(of_event.contact, of_bank.contact, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(of_event.tangent[1:], of_bank.tangent[1:], rtol=1e-12)
    assert (
        np.abs(of_event.contact - solver_motion.march(base.model, base.way).contact).max()
        > 0.05 * solver_motion.STRENGTH
    )


def test_the_shape_of_an_event_stretches_large_yield_displacements_more(base):
    bank = base.model.bank
    reach = np.asarray(bank.strength / bank.stiffness)
    apart = np.log(reach) - np.log(reach).mean()
    shaped = eqx.tree_at(lambda m: m.bank.stiffness, base.model, bank.stiffness * np.exp(-0.2 * apart))
    of_event = solver_motion.march(base.model, base.way._replace(shape=0.2 * base.way.strength))
    of_bank = solver_motion.march(shaped, base.way)
    np.testing.assert_allclose(of_event.contact, of_bank.contact, rtol=0.0, atol=1e-13)
    assert (
        np.abs(of_event.contact - solver_motion.march(base.model, base.way).contact).max()
        > 0.01 * solver_motion.STRENGTH
    )


def test_elements_slide_where_they_carry_their_cap(base):
    held = solver_motion.march(base.model, base.way)
    carried = np.abs(np.asarray(held.elements))
    slides = np.asarray(held.slides)
    assert slides.all(axis=1).any() and not slides[0].any()
    assert carried[slides].min() > carried.max() * 0.7  # what weakening leaves of the cap
    sticking = np.where(slides, 0.0, np.asarray(base.model.bank.stiffness)).sum(axis=1)
    np.testing.assert_allclose(sticking[1:], held.tangent[1:], rtol=1e-12)


def test_caps_that_fall_as_the_block_turns_back_are_met_to_second_order():
    """Where the block stops and rings, caps fall with the velocity while elements unload: along its way, not before.

    By the falling cap first and the way back then, errors would halve with the steps and be a per cent of the strength
    with twenty of them a period.
    """
    stribeck = catalogue.get("velocity-weakening")(drop=np.float64(0.12), velocity=np.float64(2e-4))
    model = solver_motion.with_effects(solver_motion.base_model(()), (stribeck,))
    fast, stop, period, decay, ringing = 1e-3, 2e-3, 2e-3, 3e-3, 8e-8  # m/s, s, s, s, m

    def force(steps: int) -> np.ndarray:
        t = np.linspace(0.0, 6e-3, steps + 1)
        after, turn = np.maximum(t - stop, 0.0), 2.0 * np.pi / period
        wave = ringing * np.exp(-after / decay + 1j * turn * after)
        x = np.where(t < stop, fast * (t - 0.5 * t**2 / stop), 0.5 * fast * stop + wave.real - ringing)
        v = np.where(t < stop, fast * (1.0 - t / stop), ((1j * turn - 1.0 / decay) * wave).real)
        return np.asarray(solver_motion.march(model, solver_motion.way_of(t, x, v)).contact)[: steps + 1]

    exact = force(3840)
    errors = [np.abs(force(n) - exact[:: 3840 // n]).max() / solver_motion.STRENGTH for n in (60, 120, 240, 480)]
    assert errors[0] < 2e-3
    assert np.log2(errors[0] / errors[-1]) / 3.0 > 1.85
