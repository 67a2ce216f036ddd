"""Every effect of the catalogue keeps its rules, and the checks notice effects that do not."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
import pytest
from jax import Array

from stickslip.physics.contact import Bank
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import BodyForce, Contact, Memory, Motion, Threshold
from stickslip.physics.params import parameter, variant
from stickslip.simulation.conformance import check_effect, check_effects
from stickslip.simulation.conformance.statics import check_metadata

TAGS = [
    "inertia",
    "velocity-weakening",
    "slip-weakening",
    "contact-ageing",
    "rate-and-state",
    "direct-effect",
    "thermal-creep",
    "viscoelastic-contact",
    "contact-damping",
    "viscous-drag",
    "plasticity",
    "adhesion",
    "residual-load",
    "contact-renewal",
    "unequal-contacts",
    "curvature",
    "roll-off",
    "load-modulation",
    "measured-load",
    "tilt",
    "position-dependent-friction",
    "wandering-friction",
    "wear",
    "flash-heating",
    "drive-ripple",
    "machine-compliance",
    "uneven-compliance",
    "nonlinear-spring",
    "base-vibration",
    "sensor-drift",
    "sensor-high-pass",
    "sensor-low-pass",
    "sensor-gain",
]
GROUPS = [TAGS[i : i + 6] for i in range(0, len(TAGS), 6)]


def test_the_catalogue_is_complete() -> None:
    assert sorted(catalogue.tags()) == sorted(TAGS)


@pytest.mark.slow
@pytest.mark.parametrize("tags", GROUPS, ids=lambda tags: "+".join(tags))
def test_effects_conform(tags: list[str]) -> None:
    findings = check_effects([catalogue.get(tag) for tag in tags])
    assert not findings, "\n".join(map(str, findings))


class Push(BodyForce):
    """Wrong: a force with the velocity gives energy."""

    tag: ClassVar[str] = "wrong-push"
    amplitude: ClassVar[str] = "push"
    push: Array = parameter(0.0, unit="N s/m", lower=-50.0, upper=50.0, null=0.0, doc="push")

    def force(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return self.push * motion.v


class Reset(Memory, Threshold):
    """Wrong: the age is put back by a switch, so that its end in the derivative is not that of the law."""

    tag: ClassVar[str] = "wrong-reset"
    amplitude: ClassVar[str] = "rate"
    rate: Array = parameter(0.0, unit="1", lower=0.0, upper=0.1, null=0.0, doc="growth")
    limit: Array = parameter(1e-5, unit="m/s", lower=1e-6, upper=1e-4, log=True, doc="velocity of reset")

    def start(self, bank: Bank) -> Array:
        return jnp.zeros(())

    def advance(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return jnp.where(motion.path > self.limit * motion.dt, 0.0, state + motion.dt)

    def strength(self, state: Array, motion: Motion, contact: Contact) -> Array:
        return 1.0 + self.rate * jnp.log1p(state / 1e-3)


class Rough(Threshold):
    """Wrong: no derivative where there is no way."""

    tag: ClassVar[str] = "wrong-root"
    amplitude: ClassVar[str] = "size"
    size: Array = parameter(0.0, unit="1", lower=0.0, upper=0.1, null=0.0, doc="size")
    reach: Array = parameter(1e-6, unit="m", lower=-1e-6, upper=1e-5, doc="distance")

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return 1.0 + self.size * jnp.sqrt(motion.x / self.reach)


class Offset(Threshold):
    """Wrong: not the identity at the null, by one unit in the last place."""

    tag: ClassVar[str] = "wrong-null"
    amplitude: ClassVar[str] = "size"
    size: Array = parameter(0.0, unit="1", lower=0.0, upper=0.1, null=0.0, doc="size")

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return 1.0 + 2.3e-16 + self.size


class Branch(Threshold):
    """Wrong: Python decides on a value that is traced."""

    tag: ClassVar[str] = "wrong-branch"
    amplitude: ClassVar[str] = "size"
    size: Array = parameter(0.0, unit="1", lower=0.0, upper=0.1, null=0.0, doc="size")

    def strength(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return 1.0 + self.size if motion.v > 0 else jnp.ones(())


@pytest.mark.slow
def test_wrong_effects_are_found() -> None:
    findings = check_effects([Push, Reset, Rough, Offset], full_metadata=False)
    found = {(f.tag, f.check) for f in findings}
    assert {
        ("wrong-push", "energy"),
        ("wrong-reset", "gradients"),
        ("wrong-root", "finite"),
        ("wrong-null", "null"),
    } <= found
    assert {f.check for f in findings if f.tag == "wrong-push"} <= {"energy", "metadata"}
    assert all(f.text for f in findings)


def test_a_branch_on_a_traced_value_is_found_and_spares_the_others() -> None:
    assert [f.check for f in check_effect(Branch, full_metadata=False) if f.check != "metadata"] == ["compilation"]


class Twofold(Offset):
    """Wrong: two forms, and one equation for both."""

    tag: ClassVar[str] = "wrong-forms"
    equation: ClassVar[str] = "F = 0"
    form: str = variant("one", ("one", "other"))


def test_forms_that_share_an_equation_are_found() -> None:
    texts = list(check_metadata(Twofold, True))
    assert any("same equation" in text and "other" in text for text in texts)
    assert not any("same equation" in text for text in check_metadata(Offset, True))


def test_an_exponent_that_is_no_parameter_is_found(monkeypatch) -> None:
    monkeypatch.setattr(Offset, "exponents", ("power",))
    assert any("'power' is no parameter" in f.text for f in check_effects([Offset]))


def test_missing_metadata_is_found() -> None:
    texts = [f.text for f in check_effects([Offset]) if f.check == "metadata"]
    assert any("source" in t for t in texts) and any("signature" in t for t in texts)
    assert any("symbol" in t for t in texts)
