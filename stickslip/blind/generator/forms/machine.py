"""Forms of the effects of block, load, drive and surroundings."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .base import Effect, Form, Setup, log_uniform

Rng = np.random.Generator


def _mass(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    setup.with_rig(mass=setup.rig.mass * (1 + a))
    return {"mass": setup.rig.mass}


def _drag(setup: Setup, a: float, rng: Rng, *, low: float, high: float) -> dict[str, Any]:
    return setup.put(DRAG_C=a, DRAG_N=rng.uniform(low, high))


def _modulation(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(MOD_EPS=a, MOD_F=log_uniform(rng, 3.0, 60.0), MOD_PHASE=rng.random(), MOD_FORM=form)


def _tilt(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(TILT_K=a, TILT_FORM=form)


def _ripple(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    pitch = log_uniform(rng, 8e-5, 1e-3)
    return setup.put(RIPPLE_A=a, RIPPLE_PITCH=pitch, RIPPLE_PHASE=rng.random(), RIPPLE_FORM=form)


def _series(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    return setup.put(COMPLIANCE=a)


def _spot(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    setup.with_sensor(compliance=a)
    return {"compliance": a}


def _nonlinear(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(NLS_EPS=a, NLS_Y0=2.5e-4, NLS_FORM=form)


def _vibration(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(VIB_A=a, VIB_F=log_uniform(rng, 5.0, 40.0), VIB_PHASE=rng.random(), VIB_FORM=form)


EFFECTS = (
    Effect("inertia", "1", 0.01, 0.1, (Form("mass of the spring", False, _mass),)),
    Effect(
        "viscous-drag", "N s/m", 0.5, 8.0,
        (
            Form("quadratic", False, partial(_drag, low=2.0, high=2.0)),
            Form("sublinear", True, partial(_drag, low=0.5, high=0.75)),
            Form("superlinear", True, partial(_drag, low=1.4, high=1.7)),
        ),
        detect=7e-4,
    ),
    Effect(
        "load-modulation", "1", 1e-3, 1e-2,
        (
            Form("sine", False, partial(_modulation, form=0.0)),
            Form("triangle", True, partial(_modulation, form=1.0)),
            Form("three tones", True, partial(_modulation, form=2.0)),
        ),
        detect=1e-4,
    ),
    Effect(
        "tilt", "1", 5e-3, 0.1,
        (Form("lift", False, partial(_tilt, form=0.0)), Form("lever", True, partial(_tilt, form=1.0))),
        detect=2e-3,
    ),
    Effect(
        "drive-ripple", "m", 5e-8, 3e-6,
        (
            Form("sine", False, partial(_ripple, form=0.0)),
            Form("two harmonics", True, partial(_ripple, form=1.0)),
            Form("triangle", True, partial(_ripple, form=2.0)),
        ),
        detect=5e-8,
    ),
    Effect(
        "machine-compliance", "m/N", 2e-8, 6e-7,
        (Form("fixture", False, _series), Form("laser spot", False, _spot)),
        detect=3e-9,
    ),
    Effect(
        "nonlinear-spring", "1", 5e-3, 0.05,
        (Form("quadratic", False, partial(_nonlinear, form=1.0)), Form("cubic", True, partial(_nonlinear, form=2.0))),
        detect=1.5e-3, signed=True,
    ),
    Effect(
        "base-vibration", "m/s^2", 5e-4, 1e-2,
        (
            Form("line", False, partial(_vibration, form=0.0)),
            Form("band", True, partial(_vibration, form=1.0)),
            Form("two modes", True, partial(_vibration, form=2.0)),
        ),
    ),
)  # fmt: skip
