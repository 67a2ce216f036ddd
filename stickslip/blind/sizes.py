"""Amplitudes found against amplitudes hidden, where generator and catalogue measure an effect in the same way."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

from .answers import Answer

# catalogue's amplitude = factor x generator's. What is not here cannot be compared: the catalogue gives the shape of
# the backbone where the generator changes the lines (plasticity, curvature, roll-off, unequal-contacts), or only the
# amplitude together with an inner parameter has a meaning (wear).
_SAME = (
    "velocity-weakening", "slip-weakening", "contact-ageing", "rate-and-state", "direct-effect",
    "position-dependent-friction", "thermal-creep", "viscoelastic-contact", "contact-damping", "adhesion",
    "residual-load", "contact-renewal", "inertia", "load-modulation", "drive-ripple", "machine-compliance",
    "base-vibration", "sensor-drift", "sensor-high-pass", "sensor-low-pass", "sensor-gain",
)  # fmt: skip
_FACTORS: dict[tuple[str, str | None], float] = {
    **{(tag, None): 1.0 for tag in _SAME},
    ("viscous-drag", None): 1e-3,  # N s/m against the force at 1 mm/s
    ("tilt", None): -1.0,  # the generator's pull lifts
    ("nonlinear-spring", "quadratic"): 1 / 2.5e-4,  # at 0.25 mm against per metre
    ("nonlinear-spring", "cubic"): 1e-4 / 2.5e-4**2,
    # the strongest sine of a wave that is none
    ("load-modulation", "triangle"): 8 / pi**2,
    ("drive-ripple", "triangle"): 8 / pi**2,
    ("load-modulation", "three tones"): 0.6,
    ("position-dependent-friction", "three waves"): 0.6,
    ("position-dependent-friction", "saw"): 0.8 / 0.927,
    ("base-vibration", "two modes"): 0.7,
}
# forms without a counterpart: three tones of the same size
_NO_COUNTERPART = (("base-vibration", "band"),)
# fitted forms whose amplitude is the generator's only where it has the same form, or not a certain other one
_FITTED: dict[str, dict[str, tuple[str, ...]]] = {
    "nonlinear-spring": {"quadratic": ("quadratic",), "cubic": ("cubic",)},
    "position-dependent-friction": {"trend": ()},
}


@dataclass(frozen=True)
class Size:
    """An amplitude found: in SI, its stated standard deviation, and the true one in the same unit.

    ``phased``: the effect has a phase, so that its sign means nothing (half a period changes it).
    """

    tag: str
    own_form: bool
    multiple: float
    value: float
    std: float | None
    truth: float
    phased: bool = False

    @property
    def within_two(self) -> bool:
        """Whether it has the right sign and is within a factor of two."""
        found, truth = self._pair()
        return 0.5 <= found / truth <= 2.0

    def within(self, deviations: float) -> bool | None:
        """Whether the truth is within so many stated standard deviations; None where none is stated."""
        found, truth = self._pair()
        return None if self.std is None else abs(found - truth) <= deviations * self.std

    def _pair(self) -> tuple[float, float]:
        return (abs(self.value), abs(self.truth)) if self.phased else (self.value, self.truth)


def factor(tag: str, form: str, fitted: str | None = None) -> float | None:
    """The catalogue's amplitude over the generator's.

    Args:
        tag: of the effect.
        form: that the generator gave it.
        fitted: form of the catalogue's law that was fitted, where it has several.

    Returns:
        None where the two cannot be compared.
    """
    if (tag, form) in _NO_COUNTERPART:
        return None
    if fitted is not None and form not in _FITTED.get(tag, {}).get(fitted, (form,)):
        return None
    return _FACTORS.get((tag, form), _FACTORS.get((tag, None)))


def compared(effects: list[dict[str, Any]], answer: Answer) -> list[Size]:
    """Amplitudes of the hidden effects that were named, as far as they can be compared."""
    from ..physics.effects import catalogue

    out = []
    for effect in effects:
        tag = effect["tag"]
        if answer.kind != "missing" or tag not in answer.named:
            continue
        scale = factor(tag, effect["form"], answer.forms.get(tag, {}).get("form"))
        law = catalogue.get(tag)
        found = answer.parameters.get(f"{tag}.{law.amplitude}")
        if scale is None or found is None or found.get("value") is None:
            continue
        size = found["value"], found.get("std"), scale * effect["amplitude"]
        out.append(Size(tag, effect["own_form"], effect["multiple"], *size, phased=law.periodic is not None))
    return out
