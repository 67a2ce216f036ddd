"""How large a hidden effect is, in multiples of the amplitude from which it can be seen at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .generator.forms import Effect, Form

LARGEST = 30.0  # multiples of detection
# tag -> form -> amplitude in the unit of the generator, made by tests/challenge/visibility.py
DETECTION: dict[str, dict[str, float]] = {
    "velocity-weakening": {"exponent 1": 0.014, "hyperbolic": 0.017, "exponent 2": 0.013, "exponent 1/2": 0.0043},
    "slip-weakening": {"exponential": 0.0049, "linear": 0.0045, "hyperbolic": 0.0039},
    "contact-ageing": {"logarithm": 0.00032, "power": 0.00025},
    "rate-and-state": {"ageing law": 0.00029, "slip law": 0.00026},
    "direct-effect": {"logarithm": 0.00027, "asinh": 0.00027},
    "position-dependent-friction": {"sine": 0.0005, "three waves": 0.00054, "saw": 0.00041},
    "wear": {"linear": 0.00046, "logarithm": 0.0016, "saturating": 0.00069, "softer by event": 0.021},
    "flash-heating": {"lumped": 0.0037},
    "thermal-creep": {"Eyring": 8.1e-08, "power": 8.2e-08},
    "viscoelastic-contact": {"single": 0.072, "renewed": 0.018, "stretched": 0.016},
    "contact-damping": {"sticking": 1.9e-06, "fading": 4.5e-06},
    "plasticity": {"cap": 0.15, "soft": 0.11},
    "adhesion": {"contact": 0.021, "range": 0.0036},
    "residual-load": {"scaled": 0.009, "some springs": 0.00035},
    "contact-renewal": {"Poisson": 480.0, "fixed life": 610.0},
    "unequal-contacts": {"load": 0.39, "roughness": 0.27},
    "curvature": {"parabola": 11000.0, "quartic": 12000.0},
    "roll-off": {"flat": 1.3, "smooth": 1.3},
    "inertia": {"mass of the spring": 0.0079},
    "viscous-drag": {"quadratic": 0.21, "sublinear": 0.56, "superlinear": 0.31},
    "load-modulation": {"sine": 0.00032, "triangle": 0.00038, "three tones": 0.00038},
    "tilt": {"lift": 0.0091, "lever": 0.0078},
    "drive-ripple": {"sine": 1.4e-07, "two harmonics": 1.3e-07, "triangle": 1.6e-07},
    "machine-compliance": {"fixture": 9e-08, "laser spot": 6.8e-08},
    "nonlinear-spring": {"quadratic": 0.005, "cubic": 0.0041},
    "base-vibration": {"line": 0.0006, "band": 0.00068, "two modes": 0.00046},
    "sensor-drift": {"linear": 5.3e-09, "settling": 9.8e-09},
    "sensor-high-pass": {"first order": 4e-06, "second order": 2.8e-06},
    "sensor-low-pass": {"first order": 6.4e-05, "Bessel": 7.8e-05},
    "sensor-gain": {"constant": 0.0026, "bent": 0.0039},
    "yaw-mode": {"one mode": 0.0017},
    "temperature-ramp": {"tanh": 0.0012},
    "loosening-clamp": {"linear": 0.004, "settling": 0.0058},
    "eddy-brake": {"bilinear": 0.076},
    "anelastic-spring": {"one branch": 0.012},
    "magnetic-detent": {"sine": 0.00027},
}


def detection(effect: Effect, form: str) -> float:
    """The amplitude from which an effect can be seen in one of its forms, in its unit: five standard deviations.

    Not of noise alone but of noise and the scatter of the contact together, in five runs of a rig whose friction,
    weakening, damping and roughness are unknown (see ``tests/challenge/visibility.py``); geometric mean of two rigs.
    """
    return DETECTION[effect.tag][form]


def visible_forms(effect: Effect) -> list[Form]:
    """The forms that can be seen at some plausible amplitude."""
    return [form for form in effect.forms if effect.high >= detection(effect, form.name)]


def largest_multiple(effect: Effect, form: str) -> float:
    """The largest multiple to be drawn: 30, or less where the plausible range ends before."""
    return min(LARGEST, effect.high / detection(effect, form))


def draw_multiple(effect: Effect, form: str, rng: np.random.Generator) -> float:
    """A multiple of detection, log-uniform from 1 to the largest."""
    return float(np.exp(rng.uniform(0.0, np.log(largest_multiple(effect, form)))))


def amplitude(effect: Effect, form: str, multiple: float, sign: float) -> float:
    """Amplitude of an effect at a multiple of detection; ``sign`` counts where either sign makes sense."""
    return multiple * detection(effect, form) * (sign if effect.signed else effect.sign)
