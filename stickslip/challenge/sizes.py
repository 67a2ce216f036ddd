"""Amplitudes found against amplitudes hidden, where generator and catalogue measure an effect in the same way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .answers import Answer

# catalogue's amplitude = factor x generator's. What is not here cannot be compared: the catalogue gives the shape of
# the backbone where the generator changes the lines (plasticity, curvature, roll-off, unequal-contacts), or only the
# amplitude together with an inner parameter has a meaning (wear).
_SAME = (
    "velocity-weakening", "slip-weakening", "contact-ageing", "rate-and-state", "direct-effect",
    "position-dependent-friction", "thermal-creep", "viscoelastic-contact", "contact-damping", "adhesion",
    "residual-load", "contact-renewal", "inertia", "load-modulation", "tilt", "drive-ripple", "machine-compliance",
    "base-vibration", "sensor-drift", "sensor-high-pass", "sensor-low-pass", "sensor-gain",
)  # fmt: skip
_FACTORS: dict[tuple[str, str | None], float] = {
    **{(tag, None): 1.0 for tag in _SAME},
    ("viscous-drag", None): 1e-3,  # N s/m against the force at 1 mm/s
    ("nonlinear-spring", "quadratic"): 1 / 2.5e-4,  # at 0.25 mm against per metre
    ("nonlinear-spring", "cubic"): 1e-3 / 2.5e-4**2,
}


@dataclass(frozen=True)
class Size:
    """An amplitude found: in SI, its stated standard deviation, and the true one in the same unit."""

    tag: str
    own_form: bool
    multiple: float
    value: float
    std: float | None
    truth: float

    @property
    def within_two(self) -> bool:
        """Whether it has the right sign and is within a factor of two."""
        return 0.5 <= self.value / self.truth <= 2.0

    def within(self, deviations: float) -> bool | None:
        """Whether the truth is within so many stated standard deviations; None where none is stated."""
        return None if self.std is None else abs(self.value - self.truth) <= deviations * self.std


def compared(effects: list[dict[str, Any]], answer: Answer) -> list[Size]:
    """Amplitudes of the hidden effects that were named, as far as they can be compared."""
    out = []
    for effect in effects:
        tag = effect["tag"]
        factor = _FACTORS.get((tag, None), _FACTORS.get((tag, effect["form"])))
        if answer.kind != "missing" or tag not in answer.named or factor is None:
            continue
        found = _parameter(answer.parameters, tag)
        if found is not None and found.get("value") is not None:
            out.append(
                Size(
                    tag, effect["own_form"], effect["multiple"], found["value"], found.get("std"),
                    factor * effect["amplitude"],
                )
            )  # fmt: skip
    return out


def _parameter(parameters: Mapping[str, Mapping[str, Any]], tag: str) -> Mapping[str, Any] | None:
    from ..effects import catalogue

    return parameters.get(f"{tag}.{catalogue.get(tag).amplitude}")
