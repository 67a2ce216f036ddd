"""Forms of the effects of the vibrometer."""

from __future__ import annotations

from typing import Any

from .base import Effect, Rng, Setup, forms, log_uniform


def _drift(setup: Setup, a: float, rng: Rng, *, form: bool) -> dict[str, Any]:
    time = log_uniform(rng, 4.0, 20.0) if form else 0.0
    setup.with_sensor(drift=setup.sensor.drift + a, drift_settling=time)
    return {"drift": a, "settling": time}


def _high_pass(setup: Setup, a: float, rng: Rng, *, form: int) -> dict[str, Any]:
    setup.with_sensor(high_pass=a, high_pass_order=form)
    return {"cut": a, "order": form}


def _low_pass(setup: Setup, a: float, rng: Rng, *, form: int) -> dict[str, Any]:
    setup.with_sensor(low_pass=a, low_pass_order=form)
    return {"time": a, "order": form}


def _gain(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    setup.with_sensor(gain=a, gain_bend=form)
    return {"gain": a}


EFFECTS = (
    Effect(
        "sensor-drift", "m/s", 5e-10, 3e-8, forms(_drift, {"linear": False}, {"settling": True}),
        detect=2e-10, signed=True,
    ),
    Effect(
        "sensor-high-pass", "Hz", 1e-3, 0.1, forms(_high_pass, {"first order": 1}, {"second order": 2}), detect=2e-7,
    ),
    Effect("sensor-low-pass", "s", 1e-4, 1e-3, forms(_low_pass, {"first order": 1}, {"Bessel": 3}), detect=1e-4),
    Effect("sensor-gain", "1", 2e-3, 2e-2, forms(_gain, {"constant": 0.0}, {"bent": 5e-4}), signed=True),
)  # fmt: skip
