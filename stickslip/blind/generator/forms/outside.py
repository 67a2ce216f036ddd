"""Effects that no catalogue lists: nothing known should explain the campaigns that hold them."""

from __future__ import annotations

from typing import Any

from .base import Effect, Form, Rng, Setup, between, forms, log_uniform, phase, slots


def _yaw(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    setup.with_sensor(yaw_arm=0.8)
    return setup.put(YAW_EPS=a, YAW_F=rng.uniform(110.0, 260.0), YAW_ZETA=log_uniform(rng, 0.005, 0.03))


def _loose(setup: Setup, a: float, rng: Rng, *, form: float) -> dict[str, Any]:
    return setup.put(LOOSE_EPS=a, LOOSE_TIME=10.0 if form == 0.0 else 4.0, LOOSE_FORM=form)


def _eddy(setup: Setup, a: float, rng: Rng) -> dict[str, Any]:
    return setup.put(EDDY_C=a, EDDY_LENGTH=3e-4)


_ramp = slots("RAMP_EPS", RAMP_TAU=between(0.2, 2.0), RAMP_LENGTH=between(1e-6, 1e-5))
_anelastic = slots("ANEL_G", ANEL_TAU=between(0.1, 2.0))
_detent = slots("DETENT_F", DETENT_LENGTH=between(3e-4, 1e-3), DETENT_PHASE=phase)
EFFECTS = (
    Effect("yaw-mode", "1", 0.05, 0.4, (Form("one mode", True, _yaw),), inside=False),
    Effect("temperature-ramp", "1", 0.01, 0.08, (Form("tanh", True, _ramp),), inside=False, sign=-1.0),
    Effect("loosening-clamp", "1", 0.03, 0.2, forms(_loose, {}, {"linear": 0.0, "settling": 1.0}), inside=False),
    Effect("eddy-brake", "N s/m", 2.0, 12.0, (Form("bilinear", True, _eddy),), inside=False),
    Effect("anelastic-spring", "1", 0.01, 0.1, (Form("one branch", True, _anelastic),), inside=False),
    Effect("magnetic-detent", "N", 2e-3, 1.2e-2, (Form("sine", True, _detent),), inside=False),
)  # fmt: skip
