"""Forms of the effects of the vibrometer."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .base import Effect, Form, Setup, log_uniform

Rng = np.random.Generator


def _drift(setup: Setup, a: float, rng: Rng, *, settling: bool) -> dict[str, Any]:
    time = log_uniform(rng, 4.0, 20.0) if settling else 0.0
    setup.with_sensor(drift=setup.sensor.drift + a, drift_settling=time)
    return {"drift": a, "settling": time}


def _high_pass(setup: Setup, a: float, rng: Rng, *, order: int) -> dict[str, Any]:
    setup.with_sensor(high_pass=a, high_pass_order=order)
    return {"cut": a, "order": order}


def _low_pass(setup: Setup, a: float, rng: Rng, *, order: int) -> dict[str, Any]:
    setup.with_sensor(low_pass=a, low_pass_order=order)
    return {"time": a, "order": order}


def _gain(setup: Setup, a: float, rng: Rng, *, bent: bool) -> dict[str, Any]:
    setup.with_sensor(gain=a, gain_bend=5e-4 if bent else 0.0)
    return {"gain": a}


EFFECTS = (
    Effect(
        "sensor-drift", "m/s", 5e-10, 3e-8,
        (
            Form("linear", False, partial(_drift, settling=False)),
            Form("settling", True, partial(_drift, settling=True)),
        ),
        detect=2e-10, signed=True,
    ),
    Effect(
        "sensor-high-pass", "Hz", 1e-3, 0.1,
        (
            Form("first order", False, partial(_high_pass, order=1)),
            Form("second order", True, partial(_high_pass, order=2)),
        ),
        detect=2e-7,
    ),
    Effect(
        "sensor-low-pass", "s", 1e-4, 1e-3,
        (Form("first order", False, partial(_low_pass, order=1)), Form("Bessel", True, partial(_low_pass, order=3))),
        detect=1e-4,
    ),
    Effect(
        "sensor-gain", "1", 2e-3, 2e-2,
        (Form("constant", False, partial(_gain, bent=False)), Form("bent", True, partial(_gain, bent=True))),
        signed=True,
    ),
)  # fmt: skip
