"""Amplitudes of generator and catalogue side by side: what the factors between them rest on, and what is left out."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from invented import effect

from stickslip.blind.answers import Answer
from stickslip.blind.generator import EFFECTS, Drive, Rig, Setup, Surface, make_bank, simulate
from stickslip.blind.generator import array_layout as S
from stickslip.blind.generator.laws import body_force, load_point, spring_force, wave
from stickslip.blind.sizes import Size, compared, factor
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import Contact, Motion

TURNS = np.arange(0.0, 4000.0, 0.01 * np.sqrt(3))  # never the same place of a turn twice


def hidden(tag: str, form: str, amplitude: float = 1.0) -> np.ndarray:
    """The slots of an effect as the generator fills them."""
    setup = Setup()
    EFFECTS[tag].pick(form, np.random.default_rng(1)).apply(setup, amplitude, np.random.default_rng(1))
    return setup.effects


def at_one_turn(values: np.ndarray) -> float:
    """Size of the sine of one period a turn in a signal over TURNS."""
    window = np.hanning(TURNS.size)
    return float(2.0 * abs(np.sum(window * values * np.exp(-2j * np.pi * TURNS))) / window.sum())


def answered(tag: str, value: float, form: str | None = None) -> Answer:
    name = f"{tag}.{catalogue.get(tag).amplitude}"
    forms = {} if form is None else {tag: {"form": form}}
    return Answer("missing", (tag,), (tag,), parameters={name: {"value": value, "std": 0.1 * abs(value)}}, forms=forms)


def one(effects: list[dict[str, Any]], answer: Answer) -> Size:
    (found,) = compared(effects, answer)
    return found


@pytest.mark.parametrize("form", ["lift", "lever"])
def test_tilt_of_the_generator_lifts_and_that_of_the_catalogue_presses(form: str) -> None:
    """In steady sliding every spring is at its cap, so that the contact's force is the law itself."""
    coupling, rig = 0.08, Rig(mu_k=0.21)
    bank = make_bank(Surface(points=2048), np.full(4, 0.31), 1, groups=64)
    slid = simulate(rig, Drive.constant(1e-3), bank, hidden("tilt", form, coupling), duration=0.6, dt=2e-5, rate=1e3)
    assert slid.velocity[-1] == pytest.approx(1e-3, rel=1e-6)
    known = factor("tilt", form)
    assert known is not None
    nothing, pull = jnp.zeros(1), jnp.asarray(slid.spring_force[-1])
    motion = Motion(*[nothing] * 7, pull=pull)
    contact = Contact(nothing, nothing, jnp.asarray([rig.capacity]), nothing, nothing)
    law = {c: float(catalogue.make("tilt", coupling=c).strength(None, motion, contact)) for c in (0.08, -0.08)}
    assert slid.contact_force[-1] == pytest.approx(rig.capacity * law[known * coupling], rel=1e-9)
    assert abs(slid.contact_force[-1] / (rig.capacity * law[-known * coupling]) - 1.0) > 0.1


@pytest.mark.parametrize(
    ("tag", "form", "slot"),
    [
        ("load-modulation", "sine", S.MOD_FORM),
        ("load-modulation", "triangle", S.MOD_FORM),
        ("load-modulation", "three tones", S.MOD_FORM),
        ("position-dependent-friction", "sine", S.POS_FORM),
        ("position-dependent-friction", "three waves", S.POS_FORM),
        ("position-dependent-friction", "saw", S.POS_FORM),
    ],
)
def test_factors_of_waves_are_their_strongest_sine(tag: str, form: str, slot: int) -> None:
    kind = hidden(tag, form)[slot]
    assert factor(tag, form) == pytest.approx(at_one_turn(np.array([wave(c, kind) for c in TURNS])), rel=2e-4)


@pytest.mark.parametrize("form", ["sine", "two harmonics", "triangle"])
def test_factors_of_a_ripple_are_its_strongest_sine(form: str) -> None:
    eff = hidden("drive-ripple", form, 1e-6)
    pitch, drive = eff[S.RIPPLE_PITCH], (np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    lead = np.array([load_point(c * pitch, *drive, eff) - c * pitch for c in TURNS])
    assert 1e-6 * (factor("drive-ripple", form) or 0.0) == pytest.approx(at_one_turn(lead), rel=2e-4)


@pytest.mark.parametrize("form", ["line", "two modes"])
def test_factors_of_a_vibration_are_its_strongest_sine(form: str) -> None:
    eff, rig = hidden("base-vibration", form, 1e-3), Rig()
    force = np.array([body_force(c / eff[S.VIB_F], 0.0, 0.0, rig.vector(), eff) for c in TURNS])
    found = at_one_turn(force) / rig.mass
    assert 1e-3 * (factor("base-vibration", form) or 0.0) == pytest.approx(found, rel=1e-3)


@pytest.mark.parametrize("form", ["quadratic", "cubic"])
def test_nonlinear_springs_of_the_same_form_pull_equally(form: str) -> None:
    eff, rig, stretch = hidden("nonlinear-spring", form, 0.01), Rig().vector(), 3e-4
    known = factor("nonlinear-spring", form, form)
    assert known is not None
    pull, _ = spring_force(stretch, stretch, 0.0, 0.0, 1e-3, rig, eff)
    law = catalogue.make("nonlinear-spring", curvature=known * 0.01, form=form)
    assert float(law.pull(jnp.asarray(stretch), jnp.asarray(rig[S.SPRING] * stretch))) == pytest.approx(pull, rel=1e-12)


def test_the_sign_counts_unless_the_effect_has_a_phase() -> None:
    ripple = [effect("drive-ripple", 5.0, 1e-6, form="sine")]
    for sign in (1.0, -1.0):
        found = one(ripple, answered("drive-ripple", sign * 1.1e-6))
        assert found.within_two
        assert found.within(1.0 + 1e-6)
        assert not found.within(0.9)
    assert not one(ripple, answered("drive-ripple", 2.1e-6)).within_two
    tilt = [effect("tilt", 5.0, 0.05, form="lift")]
    assert one(tilt, answered("tilt", -0.05)).within_two
    assert not one(tilt, answered("tilt", 0.05)).within_two


def test_forms_that_mean_something_else_are_left_out() -> None:
    spring = [effect("nonlinear-spring", 5.0, 0.02, form="quadratic")]
    assert one(spring, answered("nonlinear-spring", 80.0, "quadratic")).truth == pytest.approx(80.0)
    assert compared(spring, answered("nonlinear-spring", 80.0, "cubic")) == []
    friction = [effect("position-dependent-friction", 5.0, 0.01, form="sine")]
    assert one(friction, answered("position-dependent-friction", 0.01, "wave")).within_two
    assert compared(friction, answered("position-dependent-friction", 0.01, "trend")) == []
    band = [effect("base-vibration", 5.0, 1e-3, form="band")]
    assert compared(band, answered("base-vibration", 1e-3)) == []
    assert compared([{**band[0], "form": "line"}], answered("base-vibration", 1e-3)) != []
