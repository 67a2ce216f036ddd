"""Forms of the effects of block, load, drive and surroundings."""

from __future__ import annotations

from typing import Any

from .base import Effect, Form, Rng, Setup, between, forms, phase, slots


def _mass(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    setup.with_rig(mass=setup.rig.mass * (1 + a))
    return {"mass": setup.rig.mass}


def _drag(setup: Setup, a: float, rng: Rng, *, form: tuple[float, float]) -> dict[str, Any]:
    return setup.put(DRAG_C=a, DRAG_N=rng.uniform(*form))


def _spot(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    setup.with_sensor(compliance=a)
    return {"compliance": a}


def _nonlinear(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(NLS_EPS=a, NLS_Y0=2.5e-4, NLS_FORM=form)


_modulation = slots("MOD_EPS", "MOD_FORM", MOD_F=between(3.0, 60.0), MOD_PHASE=phase)
_ripple = slots("RIPPLE_A", "RIPPLE_FORM", RIPPLE_PITCH=between(8e-5, 1e-3), RIPPLE_PHASE=phase)
_vibration = slots("VIB_A", "VIB_FORM", VIB_F=between(5.0, 40.0), VIB_PHASE=phase)
EFFECTS = (
    Effect("inertia", "1", 0.01, 0.1, (Form("mass of the spring", False, _mass),)),
    Effect(
        "viscous-drag", "N s/m", 0.5, 8.0,
        forms(_drag, {"quadratic": (2.0, 2.0)}, {"sublinear": (0.5, 0.75), "superlinear": (1.4, 1.7)}), detect=7e-4,
    ),
    Effect(
        "load-modulation", "1", 1e-3, 1e-2, forms(_modulation, {"sine": 0.0}, {"triangle": 1.0, "three tones": 2.0}),
        detect=1e-4,
    ),
    Effect("tilt", "1", 5e-3, 0.1, forms(slots("TILT_K", "TILT_FORM"), {"lift": 0.0}, {"lever": 1.0}), detect=2e-3),
    Effect(
        "drive-ripple", "m", 5e-8, 3e-6, forms(_ripple, {"sine": 0.0}, {"two harmonics": 1.0, "triangle": 2.0}),
        detect=5e-8,
    ),
    Effect(
        "machine-compliance", "m/N", 2e-8, 6e-7,
        (Form("fixture", False, slots("COMPLIANCE")), Form("laser spot", False, _spot)), detect=3e-9,
    ),
    Effect(
        "nonlinear-spring", "1", 5e-3, 0.05, forms(_nonlinear, {"quadratic": 1.0}, {"cubic": 2.0}),
        detect=1.5e-3, signed=True,
    ),
    Effect(
        "base-vibration", "m/s^2", 5e-4, 1e-2, forms(_vibration, {"line": 0.0}, {"band": 1.0, "two modes": 2.0}),
    ),
)  # fmt: skip
