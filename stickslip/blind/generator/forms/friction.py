"""Forms of the effects that change friction itself: rate, state, time, place, wear, heat."""

from __future__ import annotations

from typing import Any

from .base import Effect, Form, Rng, Setup, between, forms, log_uniform, phase, slots


def _ageing(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    t0, length = log_uniform(rng, 1e-3, 0.3), log_uniform(rng, 3e-7, 3e-6)
    start = log_uniform(rng, 10.0, 300.0)
    return setup.put(AGE_B=a, AGE_T0=t0, AGE_D=length, AGE_POWER=form, AGE_START=start)


def _state(setup: Setup, b: float, rng: Rng, *, form: float) -> dict[str, Any]:
    speed, length = log_uniform(rng, 1e-9, 1e-6), log_uniform(rng, 3e-7, 3e-6)
    return setup.put(RS_B=b, RS_RATIO=rng.uniform(0.3, 0.8), RS_V=speed, RS_D=length, RS_FORM=form)


def _wear(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(WEAR_EPS=a, WEAR_LENGTH=5e-5, WEAR_FORM=form)


def _flash(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    loss = 1e-3  # 1 mW of friction warms the junctions by 1 K, more than 0.3 N of steel at 3 mm/s can reach
    return setup.put(HEAT_CHI=a, HEAT_LOSS=loss, HEAT_CAPACITY=loss * log_uniform(rng, 1e-3, 1e-2))


_stribeck = slots("STRIBECK_EPS", "STRIBECK_Q", STRIBECK_V=between(2e-4, 4e-3))
_slip = slots("SLIPW_EPS", "SLIPW_FORM", SLIPW_D=between(5e-8, 2e-6))
_direct = slots("DIRECT_A", "DIRECT_FORM", DIRECT_V=between(1e-9, 1e-7))
_position = slots("POS_EPS", "POS_FORM", POS_LENGTH=between(4e-5, 6e-4), POS_PHASE=phase)
EFFECTS = (
    Effect(
        "velocity-weakening", "1", 0.01, 0.12,
        forms(_stribeck, {"exponent 1": 1.0, "hyperbolic": 0.0}, {"exponent 2": 2.0, "exponent 1/2": 0.5}), detect=1e-3,
    ),
    Effect(
        "slip-weakening", "1", 0.01, 0.15, forms(_slip, {"exponential": 0.0}, {"linear": 1.0, "hyperbolic": 2.0}),
        detect=1e-3,
    ),
    Effect("contact-ageing", "1", 0.002, 0.015, forms(_ageing, {"logarithm": 0.0}, {"power": 0.06}), detect=2e-4),
    Effect("rate-and-state", "1", 0.001, 0.006, forms(_state, {"ageing law": 0.0}, {"slip law": 1.0}), detect=2e-4),
    Effect("direct-effect", "1", 3e-4, 0.003, forms(_direct, {"logarithm": 0.0}, {"asinh": 1.0}), detect=6e-5),
    Effect(
        "position-dependent-friction", "1", 0.005, 0.05,
        forms(_position, {"sine": 0.0}, {"three waves": 2.0, "saw": 3.0}), detect=1e-3,
    ),
    Effect(
        "wear", "1", 0.002, 0.02,
        (
            *forms(_wear, {"linear": 0.0}, {"logarithm": 1.0, "saturating": 2.0}),
            *forms(_wear, {"softer by event": 3.0}, {}),
        ),
        detect=3e-4, signed=True,
    ),
    Effect("flash-heating", "1/K", 1e-5, 3e-4, (Form("lumped", False, _flash),), decoy=True),
)  # fmt: skip
