"""Forms of the effects that change friction itself: rate, state, time, place, wear, heat."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .base import Effect, Form, Setup, log_uniform

Rng = np.random.Generator


def _stribeck(setup: Setup, a: float, rng: Rng, *, q: float) -> dict[str, Any]:
    return setup.put(STRIBECK_EPS=a, STRIBECK_V=log_uniform(rng, 2e-4, 4e-3), STRIBECK_Q=q)


def _slip(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(SLIPW_EPS=a, SLIPW_D=log_uniform(rng, 5e-8, 2e-6), SLIPW_FORM=form)


def _ageing(setup: Setup, a: float, rng: Rng, *, power: float) -> dict[str, Any]:
    t0, length = log_uniform(rng, 1e-3, 0.3), log_uniform(rng, 3e-7, 3e-6)
    start = log_uniform(rng, 10.0, 300.0)
    return setup.put(AGE_B=a, AGE_T0=t0, AGE_D=length, AGE_POWER=power, AGE_START=start)


def _rate_state(setup: Setup, b: float, rng: Rng, *, form: float) -> dict[str, Any]:
    speed, length = log_uniform(rng, 1e-9, 1e-6), log_uniform(rng, 3e-7, 3e-6)
    return setup.put(RS_B=b, RS_RATIO=rng.uniform(0.3, 0.8), RS_V=speed, RS_D=length, RS_FORM=form)


def _direct(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(DIRECT_A=a, DIRECT_V=log_uniform(rng, 1e-9, 1e-7), DIRECT_FORM=form)


def _position(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    length = log_uniform(rng, 4e-5, 6e-4)
    return setup.put(POS_EPS=a, POS_LENGTH=length, POS_PHASE=rng.random(), POS_FORM=form)


def _wear(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(WEAR_EPS=a, WEAR_LENGTH=5e-5, WEAR_FORM=form)


def _flash(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    loss = 1e-3  # 1 mW of friction warms the junctions by 1 K, more than 0.3 N of steel at 3 mm/s can reach
    return setup.put(HEAT_CHI=a, HEAT_LOSS=loss, HEAT_CAPACITY=loss * log_uniform(rng, 1e-3, 1e-2))


EFFECTS = (
    Effect(
        "velocity-weakening", "1", 0.01, 0.12,
        (
            Form("exponent 1", False, partial(_stribeck, q=1.0)),
            Form("hyperbolic", False, partial(_stribeck, q=0.0)),
            Form("exponent 2", True, partial(_stribeck, q=2.0)),
            Form("exponent 1/2", True, partial(_stribeck, q=0.5)),
        ),
        detect=1e-3,
    ),
    Effect(
        "slip-weakening", "1", 0.01, 0.15,
        (
            Form("exponential", False, partial(_slip, form=0.0)),
            Form("linear", True, partial(_slip, form=1.0)),
            Form("hyperbolic", True, partial(_slip, form=2.0)),
        ),
        detect=1e-3,
    ),
    Effect(
        "contact-ageing", "1", 0.002, 0.015,
        (Form("logarithm", False, partial(_ageing, power=0.0)), Form("power", True, partial(_ageing, power=0.06))),
        detect=2e-4,
    ),
    Effect(
        "rate-and-state", "1", 0.001, 0.006,
        (
            Form("ageing law", False, partial(_rate_state, form=0.0)),
            Form("slip law", True, partial(_rate_state, form=1.0)),
        ),
        detect=2e-4,
    ),
    Effect(
        "direct-effect", "1", 3e-4, 0.003,
        (Form("logarithm", False, partial(_direct, form=0.0)), Form("asinh", True, partial(_direct, form=1.0))),
        detect=6e-5,
    ),
    Effect(
        "position-dependent-friction", "1", 0.005, 0.05,
        (
            Form("sine", False, partial(_position, form=0.0)),
            Form("three waves", True, partial(_position, form=2.0)),
            Form("saw", True, partial(_position, form=3.0)),
        ),
        detect=1e-3,
    ),
    Effect(
        "wear", "1", 0.002, 0.02,
        (
            Form("linear", False, partial(_wear, form=0.0)),
            Form("logarithm", True, partial(_wear, form=1.0)),
            Form("saturating", True, partial(_wear, form=2.0)),
            Form("softer by event", False, partial(_wear, form=3.0)),
        ),
        detect=3e-4, signed=True,
    ),
    Effect("flash-heating", "1/K", 1e-5, 3e-4, (Form("lumped", False, _flash),), decoy=True),
)  # fmt: skip
