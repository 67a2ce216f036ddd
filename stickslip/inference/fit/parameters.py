"""The free parameters of a fit: on which scale each is sought, where it starts, and what is known beforehand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...physics.effects.base import Effect
from ...physics.params import span, specs


@dataclass(frozen=True)
class Free:
    """One free parameter.

    Attributes:
        name: ``"contact.u_max"``, ``"contact-ageing.beta"``.
        unit: SI unit.
        scale: ``"log"`` (sought as a logarithm) or a number: the linear unit of one step of the search (SI).
        start: value at the start (SI).
        prior: best guess beforehand (SI), in whose neighbourhood ``width`` is one standard deviation.
        width: of the prior, on the search scale (of the logarithm, or in units of ``scale``); inf for none.
        lower, upper: hard bounds (SI).
        doc: in words.
        amplitude: whether its null value removes an effect.
        usual: from where to where such values lie as a rule (SI), if that is less than the bounds.
    """

    name: str
    unit: str
    scale: str | float
    start: float
    prior: float
    width: float
    lower: float
    upper: float
    doc: str = ""
    amplitude: bool = False
    usual: tuple[float, float] | None = None

    def inward(self, value: float) -> float:
        """SI -> search scale."""
        return float(np.log(value)) if self.scale == "log" else float(value) / float(self.scale)

    def outward(self, z: float) -> float:
        """Search scale -> SI; rounding leads none across a bound."""
        value = float(np.exp(z)) if self.scale == "log" else float(z) * float(self.scale)
        return min(max(value, self.lower), self.upper)

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds on the search scale."""
        return self.inward(self.lower), self.inward(self.upper)

    def slope(self, z: float) -> float:
        """d(SI)/d(search scale), to carry a standard deviation outward."""
        return self.outward(z) if self.scale == "log" else float(self.scale)

    @property
    def known(self) -> str:
        """The prior in words, in SI."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return self.known_as(lambda value: f"{value:.3g}{unit}")

    def known_as(self, text: Callable[[float], str]) -> str:
        """The prior in words; ``text`` writes a value (SI) with its unit."""
        if not np.isfinite(self.width):
            return "none but its bounds"
        if self.scale == "log":
            return f"log-normal around {text(self.prior)}, factor {float(f'{np.exp(self.width):.3g}'):g}"
        deviation = self.width * float(self.scale)
        share = " (half its range)" if np.isclose(deviation, 0.5 * (self.upper - self.lower)) else ""
        return f"normal around {text(self.prior)}, standard deviation {text(deviation)}{share}"

    def unusual(self, value: float, std: float) -> str:
        """Where values usually lie, if this one is beyond by more than its standard deviation; else nothing."""
        if self.usual is None:
            return ""
        low, high = self.usual
        return f"usually {span(low, high, self.unit)}" if value + std < low or value - std > high else ""

    def starting(self, value: float) -> Free:
        """The same, starting at ``value`` (SI), kept within its bounds."""
        return replace(self, start=float(np.clip(value, self.lower * (1 + 1e-9), self.upper * (1 - 1e-9))))


def effect_parameters(effect: Effect, amplitude: float | None = None) -> list[Free]:
    """Free parameters of an effect, from the specs beside its fields.

    A parameter that says nothing of its prior has this one: the amplitude none but its bounds; inner parameters one
    around their default, whose standard deviation is 0.35 of the range of the logarithm, or half the range where they
    are sought on a linear scale (for a phase, whose range is two periods, that is no preference).

    Args:
        effect: its values are where inner parameters start.
        amplitude: start of the amplitude (SI); default a twentieth of the way from its null to the further bound.
    """
    out = []
    for name, spec in specs(effect).items():
        default = float(getattr(effect, name))
        is_amplitude = name == effect.amplitude
        if is_amplitude:
            null = spec.null or 0.0
            reach = max(abs(spec.upper - null), abs(spec.lower - null))
            start = null + 0.05 * reach if amplitude is None else amplitude
            if spec.upper <= null:
                start = null - 0.05 * reach if amplitude is None else amplitude
            scale: str | float = 0.02 * reach
            width = np.inf
        elif spec.log and spec.lower > 0:
            start, scale = default, "log"
            width = 0.35 * float(np.log(spec.upper / spec.lower))
        else:
            start = default
            scale = 0.05 * (spec.upper - spec.lower)
            width = 10.0
        lower, upper = spec.lower, spec.upper
        if scale == "log" and default <= 0:
            start = float(np.sqrt(lower * upper))
        centre = start
        if spec.prior is not None or (is_amplitude and spec.width is not None):
            centre = (spec.null or 0.0) if spec.prior is None else spec.prior
        if spec.width is not None:
            width = spec.width if scale == "log" else spec.width / float(scale)
        out.append(
            Free(
                f"{effect.tag}.{name}", spec.unit, scale, start, centre, width, lower, upper, spec.doc, is_amplitude,
                spec.usual,
            )
        )  # fmt: skip
    return out


def priors(effect: Effect) -> dict[str, str]:
    """Name of every parameter of an effect -> what a fit takes to be known of it beforehand, in words."""
    return {f.name.split(".", 1)[1]: f.known for f in effect_parameters(effect)}


def vector(free: Sequence[Free]) -> np.ndarray:
    """Starts on the search scale, shape (n,)."""
    return np.array([f.inward(f.start) for f in free])


def to_si(free: Sequence[Free], z: np.ndarray) -> dict[str, float]:
    """Name -> SI value."""
    return {f.name: f.outward(float(v)) for f, v in zip(free, z, strict=True)}
