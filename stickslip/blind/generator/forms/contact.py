"""Forms of the effects that change the contact springs or the lines they come from."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .base import Effect, Form, Setup, log_uniform

Rng = np.random.Generator


def _creep(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(CREEP_V=a, CREEP_ALPHA=log_uniform(rng, 0.015, 0.08), CREEP_FORM=form)


def _visco(setup: Setup, a: float, rng: Rng, *, renew: float, spread: float) -> dict[str, Any]:
    setup.relaxation = (log_uniform(rng, 0.03, 2.0), spread)
    time, width = setup.relaxation
    return {**setup.put(VISCO_G=a, VISCO_RENEW=renew), "time": time, "spread": width}


def _kelvin(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(KELVIN_ETA=a, KELVIN_FORM=form)


def _residual(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(RESIDUAL_EPS=a, RESIDUAL_FORM=form)


def _renewal(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    setup.groups = 384  # single deaths must not show
    return setup.put(RENEW_RATE=a, RENEW_FORM=form)


def _plastic(setup: Setup, a: float, rng: Rng, *, form: str) -> dict[str, Any]:
    setup.with_surface(softening=a, softening_form=form)
    return {"softening": a}


def _adhesion(setup: Setup, a: float, rng: Rng, *, form: str) -> dict[str, Any]:
    setup.with_surface(adhesion=a, adhesion_form=form)
    return {"adhesion": a}


def _curvature(setup: Setup, a: float, rng: Rng, *, form: str) -> dict[str, Any]:
    setup.with_surface(curvature=a, curvature_form=form)
    return {"curvature": a}


def _roll_off(setup: Setup, a: float, rng: Rng, *, form: str) -> dict[str, Any]:
    if a > 0:
        setup.with_surface(roll_off=1 + a, roll_off_form=form)
    return {"roll_off": 1 + a}


def _unequal(setup: Setup, a: float, rng: Rng, *, what: str) -> dict[str, Any]:
    spread = rng.standard_normal(len(setup.rig.loads))
    spread = (spread - spread.mean()) / spread.std()
    if what == "load":
        loads = np.asarray(setup.rig.loads) * np.exp(a * spread)
        loads *= sum(setup.rig.loads) / loads.sum()
        if a != 0.0:
            setup.with_rig(loads=tuple(float(load) for load in loads))
        return {"loads": [float(load) for load in loads]}
    setup.roughness_spread = np.exp(a * spread)
    return {"roughness": [float(r) for r in setup.roughness_spread]}


EFFECTS = (
    Effect(
        "thermal-creep", "m/s", 2e-9, 1e-7,
        (Form("Eyring", False, partial(_creep, form=0.0)), Form("power", True, partial(_creep, form=1.0))),
        detect=8e-10,
    ),
    Effect(
        "viscoelastic-contact", "1", 0.005, 0.06,
        (
            Form("single", False, partial(_visco, renew=0.0, spread=0.0)),
            Form("renewed", False, partial(_visco, renew=1.0, spread=0.0)),
            Form("stretched", True, partial(_visco, renew=1.0, spread=1.3)),
        ),
        detect=2.5e-5,
    ),
    Effect(
        "contact-damping", "s", 2e-6, 3e-5,
        (Form("sticking", False, partial(_kelvin, form=0.0)), Form("fading", True, partial(_kelvin, form=1.0))),
        detect=4e-7,
    ),
    Effect(
        "plasticity", "1", 0.1, 0.7,
        (Form("cap", False, partial(_plastic, form="cap")), Form("soft", True, partial(_plastic, form="soft"))),
        detect=8e-3,
    ),
    Effect(
        "adhesion", "1", 0.005, 0.1,
        (
            Form("contact", False, partial(_adhesion, form="contact")),
            Form("range", True, partial(_adhesion, form="range")),
        ),
        detect=5e-3,
    ),
    Effect(
        "residual-load", "1", 0.03, 0.6,
        (Form("scaled", False, partial(_residual, form=0.0)), Form("some springs", True, partial(_residual, form=1.0))),
        detect=1e-3,
    ),
    Effect(
        "contact-renewal", "1/m", 2e4, 2e5,
        (Form("Poisson", False, partial(_renewal, form=0.0)), Form("fixed life", True, partial(_renewal, form=1.0))),
    ),
    Effect(
        "unequal-contacts", "1", 0.1, 0.5,
        (
            Form("load", False, partial(_unequal, what="load")),
            Form("roughness", True, partial(_unequal, what="roughness")),
        ),
        detect=2e-2,
    ),
    Effect(
        "curvature", "1/m", 2e3, 2e4,
        (
            Form("parabola", False, partial(_curvature, form="parabola")),
            Form("quartic", True, partial(_curvature, form="quartic")),
        ),
    ),
    Effect(
        "roll-off", "1", 0.5, 6.0,
        (Form("flat", False, partial(_roll_off, form="flat")), Form("smooth", True, partial(_roll_off, form="smooth"))),
    ),
)  # fmt: skip
