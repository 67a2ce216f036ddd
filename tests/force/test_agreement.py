"""The force that a law holds along a given motion is that which the solver found when it made the motion.

The solver's steps know of a turning point inside of them, and a motion given by its knots does not. Up to the first
turning point, which is at the end of the first slip, the two agree to rounding. Beyond it every turning point becomes a
knot, and what remains is of the order of the solver's own error in such a step: the weakening at the turn is that of the
turn, not that of the step's end.
"""

from __future__ import annotations

from functools import lru_cache

import equinox as eqx
import numpy as np
import pytest

from stickslip.contact import Bank

from . import driven

EXACT = 1e-11  # of the strength
AT_TURNS = 3e-5  # of the strength, where steps of the solver are cut in two at turning points
# laws that see the velocity itself: at the turn, where it is zero, the contact is weaker than at the ends of the step
SLOW_IS_WEAK = {"direct-effect": 1.5e-3, "rate-and-state": 1e-3}
# an age that is renewed over a way of nanometres, which is the amplitude of the ringing
RENEWED = {"contact-renewal": 4e-4}
SHARES = {"direct-effect": 0.02, "rate-and-state": 0.02}  # more of them, and the block slides for ever


@lru_cache(maxsize=64)
def slips(name: str) -> driven.Slips:
    law = next(law for law in driven.LAWS if driven.named(law) == name)
    return driven.simulated(driven.effects_with(law, SHARES.get(law[0], 0.1)))


def wrong(found: driven.Slips, until: int | None = None) -> float:
    """Largest difference of the two forces, over the strength."""
    apart = driven.held(found).contact - found.steps.contact_force
    return float(np.abs(apart[:until]).max() / driven.STRENGTH)


@pytest.fixture(scope="module")
def base() -> driven.Slips:
    return driven.simulated(())


def test_the_base_model_holds_what_the_solver_found(base):
    v = base.steps.v
    assert np.count_nonzero((v[1:] > 1e-3) & (v[:-1] <= 1e-3)) >= 3  # slips
    assert np.abs(v[-1]) < 1e-4  # and sticks
    assert base.steps.x[base.turned] > 50e-6  # all of the first slip comes before the first turn
    assert wrong(base, base.turned) < EXACT
    assert wrong(base) < AT_TURNS


def test_what_is_left_is_that_a_step_may_turn():
    """Without the turning points as knots the elements do not unload as far as they did: twenty times as wrong."""
    without = driven.simulated((), turns=False)
    assert wrong(without, without.turned) < EXACT
    assert wrong(without) > 2e-5
    finer = driven.simulated((), driven.Tolerance(2e-3, 2e-11, 2e-8), turns=False)
    assert wrong(finer) < 0.5 * wrong(without)


@pytest.mark.parametrize("name", [driven.named(law) for law in driven.LAWS])
def test_every_law_holds_what_the_solver_found(name):
    found = slips(name)
    tag = name.split()[0]
    assert found.steps.x[-1] > 150e-6  # it slips
    assert found.turned < found.steps.t.size - 50  # and sticks again
    assert wrong(found, found.turned) < EXACT
    assert wrong(found) < {**SLOW_IS_WEAK, **RENEWED}.get(tag, AT_TURNS)
    pull = driven.held(found).pull
    np.testing.assert_allclose(pull, found.steps.spring_force, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("name", [driven.named(law) for law in driven.LAWS])
def test_the_law_is_in_the_force(name, base):
    """Every law does something along the base's motion, but those of the sensor, which move nothing."""
    found = slips(name)
    plain = driven.at_steps(driven.march(base.model, base.way), base)
    law = driven.at_steps(driven.march(found.model, base.way), base)
    changed = max(
        float(np.abs(getattr(law, part) - getattr(plain, part)).max()) for part in ("pull", "body", "contact")
    )
    sensor = name.split()[0].startswith("sensor") or name == "machine-compliance read-out"
    if sensor:
        assert changed < 1e-12 * driven.STRENGTH
    elif name.split()[0] != "inertia":  # which is in the mass
        assert changed > 1e-6 * driven.STRENGTH


def test_elements_add_up_to_the_contact(base):
    held = driven.held(base)
    strength = np.asarray(base.model.bank.strength)
    np.testing.assert_allclose(held.elements @ strength, held.contact, rtol=0.0, atol=1e-14)
    assert np.abs(held.elements).max() <= 1.0 + 1e-9


def test_the_tangent_is_that_of_what_sticks(base):
    """Of a virgin contact that is loaded one way the force rises by less than the tangent before, and more than after."""
    held, x = driven.held(base), base.steps.x
    upto = int(np.argmax(held.contact > 0.9 * driven.STRENGTH))
    slope = np.diff(held.contact[:upto]) / np.diff(x[:upto])
    before, after = held.tangent[: upto - 1], held.tangent[1:upto]
    creep = 0.02 * held.tangent[0]  # weakening sets in, by less than one element
    assert np.all(slope <= before + creep)
    assert np.all(slope >= after - creep)
    assert held.tangent[upto - 1] < 0.3 * held.tangent[0]


def test_strength_and_stretch_of_an_event_are_those_of_its_elements(base):
    bank = base.model.bank
    scaled = eqx.tree_at(lambda m: m.bank, base.model, Bank(bank.stiffness * 1.1 / 1.3, bank.strength * 1.1))
    way = base.way._replace(strength=1.1 * base.way.strength, stretch=1.3 * base.way.stretch)
    of_event, of_bank = driven.march(base.model, way), driven.march(scaled, base.way)
    np.testing.assert_allclose(of_event.contact, of_bank.contact, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(of_event.tangent[1:], of_bank.tangent[1:], rtol=1e-12)
    assert np.abs(of_event.contact - driven.march(base.model, base.way).contact).max() > 0.05 * driven.STRENGTH
