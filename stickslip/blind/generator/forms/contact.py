"""Forms of the effects that change the contact springs or the lines they come from."""

from __future__ import annotations

from typing import Any

import numpy as np

from .base import Effect, Form, FormApply, Rng, Setup, between, forms, log_uniform, slots


def _visco(setup: Setup, a: float, rng: Rng, *, form: tuple[float, float]) -> dict[str, Any]:
    renew, spread = form
    setup.relaxation = (log_uniform(rng, 0.03, 2.0), spread)
    return {**setup.put(VISCO_G=a, VISCO_RENEW=renew), "time": setup.relaxation[0], "spread": spread}


def _renewal(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    setup.groups = 384  # single deaths must not show
    return setup.put(RENEW_RATE=a, RENEW_FORM=form)


def _surface(name: str) -> FormApply:
    """Sets a field of the surface and the form of it."""

    def apply(setup: Setup, a: float, rng: Rng, *, form: str) -> dict[str, Any]:
        setup.with_surface(**{name: a, f"{name}_form": form})
        return {name: a}

    return apply


def _roll_off(setup: Setup, a: float, rng: Rng, *, form: str) -> dict[str, Any]:
    if a > 0:
        setup.with_surface(roll_off=1 + a, roll_off_form=form)
    return {"roll_off": 1 + a}


def _unequal(setup: Setup, a: float, rng: Rng, *, form: str) -> dict[str, Any]:
    spread = rng.standard_normal(len(setup.rig.loads))
    spread = (spread - spread.mean()) / spread.std()
    if form == "load":
        loads = np.asarray(setup.rig.loads) * np.exp(a * spread)
        loads *= sum(setup.rig.loads) / loads.sum()
        if a != 0.0:
            setup.with_rig(loads=tuple(float(load) for load in loads))
        return {"loads": [float(load) for load in loads]}
    setup.roughness_spread = np.exp(a * spread)
    return {"roughness": [float(r) for r in setup.roughness_spread]}


def _named(apply: FormApply, textbook: str, own: str) -> tuple[Form, ...]:
    """Two forms that are told by their names."""
    return forms(apply, {textbook: textbook}, {own: own})


_creep = slots("CREEP_V", "CREEP_FORM", CREEP_ALPHA=between(0.015, 0.08))
_kelvin = slots("KELVIN_ETA", "KELVIN_FORM")
_residual = slots("RESIDUAL_EPS", "RESIDUAL_FORM")
EFFECTS = (
    Effect("thermal-creep", "m/s", 2e-9, 1e-7, forms(_creep, {"Eyring": 0.0}, {"power": 1.0}), detect=8e-10),
    Effect(
        "viscoelastic-contact", "1", 0.005, 0.06,
        forms(_visco, {"single": (0.0, 0.0), "renewed": (1.0, 0.0)}, {"stretched": (1.0, 1.3)}), detect=2.5e-5,
    ),
    Effect("contact-damping", "s", 2e-6, 3e-5, forms(_kelvin, {"sticking": 0.0}, {"fading": 1.0}), detect=4e-7),
    Effect("plasticity", "1", 0.1, 0.7, _named(_surface("softening"), "cap", "soft"), detect=8e-3),
    Effect("adhesion", "1", 0.005, 0.1, _named(_surface("adhesion"), "contact", "range"), detect=5e-3),
    Effect("residual-load", "1", 0.03, 0.6, forms(_residual, {"scaled": 0.0}, {"some springs": 1.0}), detect=1e-3),
    Effect("contact-renewal", "1/m", 2e4, 2e5, forms(_renewal, {"Poisson": 0.0}, {"fixed life": 1.0})),
    Effect("unequal-contacts", "1", 0.1, 0.5, _named(_unequal, "load", "roughness"), detect=2e-2),
    Effect("curvature", "1/m", 2e3, 2e4, _named(_surface("curvature"), "parabola", "quartic")),
    Effect("roll-off", "1", 0.5, 6.0, _named(_roll_off, "flat", "smooth")),
)  # fmt: skip
