"""What a fit takes to be known of an effect's parameters beforehand, and that it is said."""

from __future__ import annotations

import re
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from stickslip.inference.fit.parameters import effect_parameters, priors
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import BodyForce, Contact, Motion
from stickslip.physics.params import parameter, specs
from stickslip.simulation.conformance import check_effect


def test_parameters_that_say_nothing_keep_the_old_rule_bit_for_bit() -> None:
    """The rule, written once more; nothing in the catalogue has a prior of its own."""
    for tag, cls in catalogue.EFFECTS.items():
        for form in catalogue.forms(cls):
            effect = cls(**form)
            for free in effect_parameters(effect):
                name = free.name.split(".", 1)[1]
                spec, default = specs(effect)[name], float(getattr(effect, name))
                assert spec.prior is None and spec.width is None
                reach = max(abs(spec.upper - (spec.null or 0.0)), abs(spec.lower - (spec.null or 0.0)))
                if name == cls.amplitude:
                    side = -1.0 if spec.upper <= (spec.null or 0.0) else 1.0
                    wanted = (0.02 * reach, (spec.null or 0.0) + side * 0.05 * reach, np.inf)
                elif spec.log and spec.lower > 0:
                    wanted = ("log", default, 0.35 * float(np.log(spec.upper / spec.lower)))
                else:
                    wanted = (0.05 * (spec.upper - spec.lower), default, 10.0)
                assert (free.scale, free.prior, free.width) == wanted, (tag, name)
                assert free.start == free.prior


def made(**more: Any) -> type[BodyForce]:
    """An effect with priors of its own."""

    class Push(BodyForce):
        tag: ClassVar[str] = "my-push"
        summary: ClassVar[str] = "a push"
        equation: ClassVar[str] = "F = F_0"
        amplitude: ClassVar[str] = "size"
        size: Array = parameter(0.0, unit="N", lower=-1.0, upper=1.0, null=0.0, doc="push", **more.get("size", {}))
        length: Array = parameter(
            1e-3, unit="m", lower=1e-6, upper=1.0, log=True, doc="length", **more.get("length", {})
        )
        phase: Array = parameter(0.0, unit="rad", lower=-3.0, upper=3.0, doc="phase", **more.get("phase", {}))

        def force(self, state: Any, motion: Motion, contact: Contact) -> Array:
            return self.size * jnp.sin(motion.x / self.length + self.phase)

    return Push


def test_priors_of_ones_own() -> None:
    cls = made(size={"width": 0.2}, length={"prior": 2e-3, "width": np.log(3.0)}, phase={"width": np.inf})
    size, length, phase = effect_parameters(cls())
    # on the scales of the search: steps of 2 % of the reach, and the logarithm
    assert (size.prior, size.width * size.scale) == pytest.approx((0.0, 0.2))
    assert size.start == pytest.approx(0.05), "the start is not the prior's business"
    assert (length.prior, length.start, length.width) == pytest.approx((2e-3, 1e-3, np.log(3.0)))
    assert phase.width == np.inf
    assert priors(cls()) == {
        "size": "normal around 0 N, standard deviation 0.2 N",
        "length": "log-normal around 0.002 m, factor 3",
        "phase": "none but its bounds",
    }


def test_a_centre_alone_keeps_the_usual_width() -> None:
    _, usual, _ = effect_parameters(made()())
    _, moved, _ = effect_parameters(made(length={"prior": 1e-2})())
    assert (moved.prior, moved.width, moved.start) == (1e-2, usual.width, usual.start)


def test_the_words_are_those_of_the_rule() -> None:
    assert priors(catalogue.make("contact-ageing")) == {
        "rate": "none but its bounds",
        "onset_time": "log-normal around 0.03 s, factor 56.2",
        "slip_distance": "log-normal around 1e-06 m, factor 25.1",
        "first_age": "log-normal around 10 s, factor 3160",
    }
    told = priors(catalogue.make("rate-and-state"))
    assert told["ratio"] == "normal around 0.6, standard deviation 1 (half its range)"
    for tag, cls in catalogue.EFFECTS.items():
        assert list(priors(cls())) == list(specs(cls)), tag


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"length": {"prior": 2.0}}, r"Push\.length.*beyond its bounds"),
        ({"phase": {"width": 0.0}}, "must be positive"),
        ({"phase": {"width": np.nan}}, "must be positive"),
        ({"size": {"width": -0.1}}, "must be positive"),
        ({"size": {"prior": 0.1}}, "needs a width"),
    ],
)
def test_a_prior_that_cannot_be_is_found(more: dict[str, Any], message: str) -> None:
    (finding,) = check_effect(made(**more), full_metadata=False)
    assert finding.check == "metadata"
    assert re.search(message, finding.text)
